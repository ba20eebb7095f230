//! Splitting signals on a symmetric set of points into parity classes.
//!
//! Let mirrors that commute with one another map a point set to itself. Then every signal on the points
//! is a sum of parts, one for each class; a class says under which mirrors its part is odd. An operator
//! that respects the mirrors never mixes classes, so it can be decomposed class by class. The problems
//! are smaller, and the parity of singular vectors is exact: without classes, rounding decides how the
//! vectors of equal singular values mix.

use crate::linalg::matrix::Matrix;

/// The 2^m parity classes of a point set under m commuting mirrors.
///
/// Bit k of a class says that its signals are odd under mirror k. The products of mirrors make a group of
/// 2^m elements; bit k of an element says that mirror k takes part.
#[derive(Clone, Debug)]
pub struct ParityClasses {
    point_count: usize,
    mirrors: Vec<Vec<u32>>,
    /// Each orbit lists (point, group element that takes the first point of the orbit there).
    orbits: Vec<Vec<(u32, u32)>>,
    /// By class: the orbits on which its signals can differ from zero.
    members: Vec<Vec<u32>>,
}

impl ParityClasses {
    /// The classes under the given mirrors, each a permutation of the points that is its own inverse.
    ///
    /// # Panics
    /// If a mirror has the wrong length, is not its own inverse, or two do not commute.
    pub fn new(point_count: usize, mirrors: &[Vec<u32>]) -> Self {
        for mirror in mirrors {
            assert_eq!(mirror.len(), point_count, "mirror length");
            assert!(
                (0..point_count).all(|i| mirror[mirror[i] as usize] as usize == i),
                "a mirror must be its own inverse"
            );
            for other in mirrors {
                assert!(
                    (0..point_count)
                        .all(|i| mirror[other[i] as usize] == other[mirror[i] as usize]),
                    "mirrors must commute"
                );
            }
        }
        let group_size = 1u32 << mirrors.len();
        let mut seen = vec![false; point_count];
        let mut orbits = Vec::new();
        let mut members = vec![Vec::new(); group_size as usize];
        for point in 0..point_count {
            if seen[point] {
                continue;
            }
            let mut orbit: Vec<(u32, u32)> = Vec::new();
            let mut stabilizer = Vec::new();
            for element in 0..group_size {
                let at = image(mirrors, element, point as u32);
                if at as usize == point {
                    stabilizer.push(element);
                }
                if !seen[at as usize] {
                    seen[at as usize] = true;
                    orbit.push((at, element));
                }
            }
            for (class, list) in members.iter_mut().enumerate() {
                // A signal that is odd under a mirror is zero at the points that the mirror keeps.
                if stabilizer.iter().all(|&e| sign(class, e) > 0.0) {
                    list.push(orbits.len() as u32);
                }
            }
            orbits.push(orbit);
        }
        Self {
            point_count,
            mirrors: mirrors.to_vec(),
            orbits,
            members,
        }
    }

    /// Number of classes: two to the power of the number of mirrors.
    pub fn class_count(&self) -> usize {
        1 << self.mirrors.len()
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.point_count
    }

    /// Number of coordinates of a class. Over all classes they add up to the number of points.
    pub fn dimension(&self, class: usize) -> usize {
        self.members[class].len()
    }

    /// The orbits of the points under the mirrors. Each orbit lists (point, group element that takes the
    /// first point of the orbit there).
    pub fn orbits(&self) -> impl Iterator<Item = &[(u32, u32)]> {
        self.orbits.iter().map(Vec::as_slice)
    }

    /// Where a group element takes a point.
    pub fn image(&self, element: u32, point: u32) -> u32 {
        image(&self.mirrors, element, point)
    }

    /// +1 or -1: how signals of `class` change under mirror number `mirror`.
    pub fn parity(&self, class: usize, mirror: usize) -> f64 {
        sign(class, 1 << mirror)
    }

    /// The part of `signal` in a class, in orthonormal coordinates.
    ///
    /// # Panics
    /// If the signal does not have one value for each point.
    pub fn fold(&self, class: usize, signal: &[f64]) -> Vec<f64> {
        assert_eq!(signal.len(), self.point_count, "signal length");
        self.members[class]
            .iter()
            .map(|&orbit| {
                let orbit = &self.orbits[orbit as usize];
                let sum: f64 = orbit
                    .iter()
                    .map(|&(point, element)| sign(class, element) * signal[point as usize])
                    .sum();
                sum / (orbit.len() as f64).sqrt()
            })
            .collect()
    }

    /// The signal with the given coordinates in a class and nothing in the others; inverse of
    /// [`ParityClasses::fold`] for signals of the class.
    ///
    /// # Panics
    /// If the number of coordinates is not that of the class.
    pub fn unfold(&self, class: usize, coordinates: &[f64]) -> Vec<f64> {
        assert_eq!(coordinates.len(), self.dimension(class), "coordinates");
        let mut signal = vec![0.0; self.point_count];
        for (&orbit, &value) in self.members[class].iter().zip(coordinates) {
            let orbit = &self.orbits[orbit as usize];
            let value = value / (orbit.len() as f64).sqrt();
            for &(point, element) in orbit {
                signal[point as usize] = sign(class, element) * value;
            }
        }
        signal
    }

    /// [`ParityClasses::fold`] of every column.
    pub fn fold_columns(&self, class: usize, signals: &Matrix<f64>) -> Matrix<f64> {
        let columns: Vec<_> = (0..signals.columns())
            .map(|j| self.fold(class, signals.column(j)))
            .collect();
        Matrix::from_columns(self.dimension(class), &columns)
    }
}

fn image(mirrors: &[Vec<u32>], element: u32, point: u32) -> u32 {
    mirrors
        .iter()
        .enumerate()
        .filter(|(bit, _)| element >> bit & 1 == 1)
        .fold(point, |at, (_, mirror)| mirror[at as usize])
}

/// The character of `class` at a group element: a factor of -1 for each mirror that is in both.
fn sign(class: usize, element: u32) -> f64 {
    if (class as u32 & element).count_ones().is_multiple_of(2) {
        1.0
    } else {
        -1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::matrix::dot;

    /// A 3 x 4 grid with its two mirrors; the odd side has points on a mirror line.
    fn grid() -> ParityClasses {
        let flip = |f: &dyn Fn(u32, u32) -> u32| (0..12).map(|p| f(p % 3, p / 3)).collect();
        let mirror_x = flip(&|x, y| (2 - x) + 3 * y);
        let mirror_y = flip(&|x, y| x + 3 * (3 - y));
        ParityClasses::new(12, &[mirror_x, mirror_y])
    }

    #[test]
    fn classes_split_a_signal_without_loss() {
        let classes = grid();
        let signal: Vec<f64> = (0..12).map(|k| f64::from(k * k % 7) - 2.5).collect();
        let mut sum = [0.0; 12];
        let mut energy = 0.0;
        let mut dimensions = 0;
        for class in 0..classes.class_count() {
            let coordinates = classes.fold(class, &signal);
            energy += dot(&coordinates, &coordinates);
            dimensions += coordinates.len();
            for (s, part) in sum.iter_mut().zip(classes.unfold(class, &coordinates)) {
                *s += part;
            }
        }
        assert_eq!(dimensions, 12);
        // Four roots and sums of twelve terms: a few ulp.
        assert!((energy - dot(&signal, &signal)).abs() < 1e-12);
        for (a, b) in sum.iter().zip(&signal) {
            assert!((a - b).abs() < 1e-14);
        }
    }

    #[test]
    fn an_unfolded_signal_has_its_class_parity() {
        let classes = grid();
        for class in 0..4 {
            let coordinates: Vec<f64> = (0..classes.dimension(class))
                .map(|k| 1.0 + k as f64)
                .collect();
            let signal = classes.unfold(class, &coordinates);
            for y in 0..4 {
                for x in 0..3 {
                    let mirrored = signal[(2 - x) + 3 * y];
                    assert_eq!(mirrored, classes.parity(class, 0) * signal[x + 3 * y]);
                }
            }
        }
    }
}
