//! Choosing the modes of a problem that is decomposed parity class by parity class.
//!
//! Every reduced basis of a bake is found in the same four steps:
//!
//! 1. Each parity class ([`ParityClasses`]) is decomposed by itself: with [`svd`](crate::linalg::svd::svd), or from the
//!    Gram matrix of one side of its matrix where the other side is long ([`GramModes`]; the method of snapshots,
//!    Sirovich 1987).
//! 2. The singular values of all classes are sorted together, largest first ([`ModeChoice::largest`]).
//! 3. The list is cut to the number of modes that is asked for, but never between equal values
//!    ([`whole_multiplets`]).
//! 4. Each kept singular vector gets a sign, so that its largest entry in the coordinates of its class is positive,
//!    and is unfolded to all points ([`ModeChoice::basis`]).
//!
//! Equal singular values are ordered by class, then by position in the class. So a choice depends on the values alone,
//! and not on the number of threads.

use crate::linalg::matrix::{Matrix, dot, multiply, multiply_add};
use crate::linalg::parity::ParityClasses;
use crate::linalg::svd::{dropped_energy_beyond_first, largest_entry_sign, symmetric_eigen};
use rayon::prelude::*;

/// Singular values that are closer than this, relatively, belong to one multiplet of the symmetry. A cut never separates
/// them, because which vectors of a multiplet come first is a matter of rounding.
pub const MULTIPLET_TOLERANCE: f64 = 1e-6;

/// Singular values below this fraction of the largest are rounding errors of the decomposition.
const SMALLEST_SINGULAR_VALUE: f64 = 1e-12;

/// Eigenvalues of a Gram matrix below this fraction of the largest are rounding errors. They are squares, so modes below
/// 1e-6 of the first are lost.
pub const GRAM_FLOOR: f64 = 1e-12;

/// What [`GramModes::of_shifted`] adds to the diagonal, as a fraction of the diagonal's largest entry.
const SHIFT: f64 = 1e-6;

/// The largest count up to `modes` that does not cut through equal singular values and leaves out those lost in
/// rounding. `singular_values` fall.
///
/// The first multiplet is kept whole even where it is larger than `modes`, because no modes at all are no basis.
pub fn whole_multiplets(singular_values: &[f64], modes: usize) -> usize {
    let largest = singular_values.first().copied().unwrap_or(0.0);
    let significant = singular_values
        .iter()
        .take_while(|&&s| s > SMALLEST_SINGULAR_VALUE * largest)
        .count();
    let mut kept = modes.min(significant);
    if kept < significant {
        let next = singular_values[kept];
        while kept > 0 && singular_values[kept - 1] - next <= MULTIPLET_TOLERANCE * next {
            kept -= 1;
        }
        while kept == 0
            || singular_values[0] - singular_values[kept]
                <= MULTIPLET_TOLERANCE * singular_values[0]
        {
            kept += 1;
            if kept == significant {
                break;
            }
        }
    }
    kept
}

/// One mode of one parity class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ParityMode {
    /// The parity class.
    pub class: usize,
    /// Position among the modes of that class, whose singular values fall.
    pub position: usize,
}

/// The largest modes of all parity classes together.
#[derive(Clone, Debug)]
pub struct ModeChoice {
    /// Singular values of the modes of all classes, kept or not, largest first.
    pub singular_values: Vec<f64>,
    /// The modes that are kept; mode k has `singular_values[k]`.
    pub kept: Vec<ParityMode>,
}

impl ModeChoice {
    /// Keeps the largest modes of all classes, `modes` of them at most unless the first multiplet is larger, and fewer
    /// where a multiplet would be cut ([`whole_multiplets`]).
    ///
    /// `values_of_classes` lists the singular values of each class.
    pub fn largest<'a>(
        values_of_classes: impl IntoIterator<Item = &'a [f64]>,
        modes: usize,
    ) -> Self {
        let mut all: Vec<(f64, ParityMode)> = values_of_classes
            .into_iter()
            .enumerate()
            .flat_map(|(class, values)| {
                let modes = values.iter().enumerate();
                modes.map(move |(position, &value)| (value, ParityMode { class, position }))
            })
            .collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let singular_values: Vec<f64> = all.iter().map(|&(value, _)| value).collect();
        all.truncate(whole_multiplets(&singular_values, modes));
        Self {
            singular_values,
            kept: all.into_iter().map(|(_, mode)| mode).collect(),
        }
    }

    /// Drops modes beyond the first `count`, even in the middle of a multiplet.
    pub fn truncate(&mut self, count: usize) {
        self.kept.truncate(count);
    }

    /// Singular values of the kept modes, largest first.
    pub fn scales(&self) -> &[f64] {
        &self.singular_values[..self.kept.len()]
    }

    /// Number of kept modes in a class: the first ones of that class.
    pub fn count_of_class(&self, class: usize) -> usize {
        self.kept.iter().filter(|mode| mode.class == class).count()
    }

    /// Fraction that the modes left out hold of the energy beyond the first mode
    /// ([`dropped_energy_beyond_first`]).
    pub fn dropped_energy(&self) -> f64 {
        dropped_energy_beyond_first(&self.singular_values, self.kept.len())
    }

    /// The basis of the kept modes. `vector` gives the unit vector of a mode, with any sign, in the coordinates of its
    /// class; it is called for kept modes only, from several threads.
    pub fn basis(
        &self,
        classes: &ParityClasses,
        vector: impl Fn(ParityMode) -> Vec<f64> + Sync,
    ) -> ParityBasis {
        let vectors: Vec<Vec<f64>> = self
            .kept
            .par_iter()
            .map(|&mode| {
                let mut vector = vector(mode);
                let sign = largest_entry_sign(&vector);
                vector.iter_mut().for_each(|x| *x *= sign);
                classes.unfold(mode.class, &vector)
            })
            .collect();
        ParityBasis {
            vectors: Matrix::from_columns(classes.point_count(), &vectors),
            scales: self.scales().to_vec(),
            parity: self.kept.iter().map(|mode| mode.class as u8).collect(),
            dropped_energy: self.dropped_energy(),
        }
    }
}

/// An orthonormal basis whose vectors each have a parity under every mirror.
#[derive(Clone, Debug)]
pub struct ParityBasis {
    /// Points x modes, orthonormal.
    pub vectors: Matrix<f64>,
    /// Singular value of each mode, largest first.
    pub scales: Vec<f64>,
    /// Parity class of each mode: bit k is set if the mode is odd under mirror k.
    pub parity: Vec<u8>,
    /// Fraction that the modes left out hold of the energy beyond the first mode.
    pub dropped_energy: f64,
}

/// Singular values of a matrix and its singular vectors on one side, from the Gram matrix of that side.
///
/// For a matrix with a long and a short side this is far cheaper than an SVD, and good for modes down to 1e-6 of the
/// first. Smaller ones are left out.
#[derive(Clone, Debug)]
pub struct GramModes {
    /// Singular values, largest first.
    pub singular_values: Vec<f64>,
    /// Eigenvectors of the Gram matrix, one a column, with any sign. Column k belongs to `singular_values[k]`; further
    /// columns are rounding errors.
    pub vectors: Matrix<f64>,
}

impl GramModes {
    /// Decomposes a Gram matrix, of which only the lower triangle is read.
    pub fn of(gram: &Matrix<f64>) -> Self {
        let (values, vectors) = symmetric_eigen(gram.view());
        Self::above_floor(&values, vectors)
    }

    /// As [`GramModes::of`], with a small multiple of the identity added before the decomposition and taken from the
    /// eigenvalues afterwards.
    ///
    /// For matrices of low rank: at eigenvalues of exactly zero nalgebra's iteration turns by angles that underflow,
    /// and gives NaN.
    pub fn of_shifted(mut gram: Matrix<f64>) -> Self {
        let size = gram.rows();
        let largest = (0..size).map(|j| gram[(j, j)]).fold(0.0, f64::max);
        let shift = SHIFT * largest;
        for j in 0..size {
            gram[(j, j)] += shift;
        }
        let (mut values, vectors) = symmetric_eigen(gram.view());
        values.iter_mut().for_each(|value| *value -= shift);
        Self::above_floor(&values, vectors)
    }

    fn above_floor(eigenvalues: &[f64], vectors: Matrix<f64>) -> Self {
        let floor = GRAM_FLOOR * eigenvalues.first().copied().unwrap_or(0.0);
        Self {
            singular_values: eigenvalues
                .iter()
                .take_while(|&&value| value > floor && value > 0.0)
                .map(|value| value.sqrt())
                .collect(),
            vectors,
        }
    }
}

/// `aᵀ a`, the scalar products of all columns, over the threads.
pub fn gram_of_columns(a: &Matrix<f64>) -> Matrix<f64> {
    let size = a.columns();
    let lower: Vec<Vec<f64>> = (0..size)
        .into_par_iter()
        .map(|j| (j..size).map(|i| dot(a.column(i), a.column(j))).collect())
        .collect();
    Matrix::from_fn(size, size, |i, j| lower[i.min(j)][i.max(j) - i.min(j)])
}

/// `gram += a aᵀ`, the scalar products of all rows.
///
/// # Panics
/// If `gram` is not square with as many rows as `a`.
pub fn add_gram_of_rows(gram: &mut Matrix<f64>, a: &Matrix<f64>) {
    assert_eq!(
        (gram.rows(), gram.columns()),
        (a.rows(), a.rows()),
        "size of the Gram matrix"
    );
    let product = multiply(a.view(), a.transposed().view());
    for (sum, &x) in gram.data_mut().iter_mut().zip(product.data()) {
        *sum += x;
    }
}

/// The sum of the columns of `a` with the given weights.
///
/// # Panics
/// Unless there is one weight for each column.
pub fn combined_columns(a: &Matrix<f64>, weights: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; a.rows()];
    let weights = Matrix::from_columns(weights.len(), &[weights]);
    multiply_add(a.view(), weights.view(), &mut sum);
    sum
}

/// Singular values and pairs of singular vectors of a matrix that is too large for an SVD, from the Gram matrix of its
/// shorter side.
pub struct Snapshots {
    modes: GramModes,
    /// True if the vectors of `modes` are left singular vectors.
    is_left: bool,
}

impl Snapshots {
    /// Decomposes the smaller of `a aᵀ` and `aᵀ a`.
    ///
    /// Cost: `m * n * min(m, n)` operations for the Gram matrix, over the threads, and its eigenvectors.
    pub fn of(a: &Matrix<f64>) -> Self {
        let is_left = a.rows() <= a.columns();
        let gram = if is_left {
            gram_of_columns(&a.transposed())
        } else {
            gram_of_columns(a)
        };
        Self {
            modes: GramModes::of_shifted(gram),
            is_left,
        }
    }

    /// Singular values, largest first.
    pub fn singular_values(&self) -> &[f64] {
        &self.modes.singular_values
    }

    /// Left and right singular vector of mode `k` of `a`, the decomposed matrix. The left one's largest entry is
    /// positive.
    pub fn pair(&self, a: &Matrix<f64>, k: usize) -> (Vec<f64>, Vec<f64>) {
        let known = self.modes.vectors.column(k);
        let scale = 1.0 / self.modes.singular_values[k];
        let mut other = if self.is_left {
            (0..a.columns()).map(|j| dot(a.column(j), known)).collect()
        } else {
            combined_columns(a, known)
        };
        other.iter_mut().for_each(|x| *x *= scale);
        let (mut u, mut v) = if self.is_left {
            (known.to_vec(), other)
        } else {
            (other, known.to_vec())
        };
        let sign = largest_entry_sign(&u);
        u.iter_mut().chain(&mut v).for_each(|x| *x *= sign);
        (u, v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::matrix::transpose_multiply;
    use crate::linalg::svd::svd;

    #[test]
    fn a_cut_never_separates_equal_values() {
        let values = [4.0, 3.0, 3.0 * (1.0 - 1e-8), 2.0, 1.0, 1.0];
        let kept: Vec<usize> = (0..8)
            .map(|modes| whole_multiplets(&values, modes))
            .collect();
        assert_eq!(kept, [1, 1, 1, 3, 4, 4, 6, 6]);
    }

    #[test]
    fn the_first_multiplet_stays_whole_though_it_is_larger_than_asked_for() {
        assert_eq!(whole_multiplets(&[2.0, 2.0, 2.0, 1.0], 2), 3);
        assert_eq!(whole_multiplets(&[2.0, 2.0, 2.0], 1), 3);
        assert_eq!(whole_multiplets(&[], 3), 0);
    }

    #[test]
    fn values_lost_in_rounding_are_never_kept() {
        assert_eq!(whole_multiplets(&[1.0, 0.5, 1e-13, 1e-14], 9), 2);
        assert_eq!(whole_multiplets(&[0.0, 0.0], 9), 0);
    }

    #[test]
    fn modes_of_all_classes_come_largest_first_and_equal_ones_by_class() {
        let values: [&[f64]; 3] = [&[5.0, 2.0], &[3.0], &[5.0, 4.0, 0.1]];
        let choice = ModeChoice::largest(values, 4);
        let kept: Vec<[usize; 2]> = choice.kept.iter().map(|m| [m.class, m.position]).collect();
        assert_eq!(kept, [[0, 0], [2, 0], [2, 1], [1, 0]]);
        assert_eq!(choice.singular_values, [5.0, 5.0, 4.0, 3.0, 2.0, 0.1]);
        assert_eq!(choice.scales(), [5.0, 5.0, 4.0, 3.0]);
        assert_eq!(
            [0, 1, 2].map(|class| choice.count_of_class(class)),
            [1, 1, 2]
        );
        // Beyond the first mode: 25 + 16 + 9 kept, 4 + 0.01 dropped.
        assert!((choice.dropped_energy() - 4.01 / 54.01).abs() < 1e-15);
    }

    /// A 4 x 4 grid of points with its two mirrors.
    fn grid() -> ParityClasses {
        let mirror_x = (0..16).map(|p| 3 - p % 4 + p / 4 * 4).collect();
        let mirror_y = (0..16).map(|p| p % 4 + (3 - p / 4) * 4).collect();
        ParityClasses::new(16, &[mirror_x, mirror_y])
    }

    /// Signals on the grid: with each of them come its mirror images, so that every singular vector has a parity.
    fn symmetric_signals(classes: &ParityClasses) -> Matrix<f64> {
        let columns: Vec<Vec<f64>> = (0..5)
            .flat_map(|signal: u32| (0..4).map(move |element| (signal, element)))
            .map(|(signal, element)| {
                let value = |p: u32| f64::from((p * p + 3 * signal * p + signal) % 11) - 4.0;
                (0..16).map(|p| value(classes.image(element, p))).collect()
            })
            .collect();
        Matrix::from_columns(16, &columns)
    }

    fn assert_is_the_svd(basis: &ParityBasis, classes: &ParityClasses, signals: &Matrix<f64>) {
        let whole = svd(signals.view());
        let modes = basis.scales.len();
        let products = transpose_multiply(basis.vectors.view(), basis.vectors.view());
        for (j, (found, expected)) in basis.scales.iter().zip(&whole.singular_values).enumerate() {
            // Roots of eigenvalues that err by a rounding of the largest.
            assert!((found - expected).abs() < 1e-9 * whole.singular_values[0]);
            for i in 0..modes {
                let expected = f64::from(u8::from(i == j));
                assert!((products[(i, j)] - expected).abs() < 1e-9);
            }
            for mirror in 0..2 {
                let sign = classes.parity(usize::from(basis.parity[j]), mirror);
                for p in 0..16 {
                    let image = classes.image(1 << mirror, p) as usize;
                    let mirrored = basis.vectors[(image, j)];
                    assert!((mirrored - sign * basis.vectors[(p as usize, j)]).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn class_by_class_gives_the_modes_of_the_whole() {
        let classes = grid();
        let signals = symmetric_signals(&classes);
        let folded: Vec<Matrix<f64>> = (0..4)
            .map(|class| classes.fold_columns(class, &signals))
            .collect();
        let by_rows: Vec<GramModes> = folded
            .iter()
            .map(|part| {
                let mut gram = Matrix::zeros(part.rows(), part.rows());
                add_gram_of_rows(&mut gram, part);
                GramModes::of(&gram)
            })
            .collect();
        let by_columns: Vec<GramModes> = folded
            .iter()
            .map(|part| GramModes::of_shifted(gram_of_columns(part)))
            .collect();
        let values = |parts: &[GramModes]| -> Vec<Vec<f64>> {
            parts.iter().map(|p| p.singular_values.clone()).collect()
        };
        let of_rows = ModeChoice::largest(values(&by_rows).iter().map(Vec::as_slice), 9);
        let of_columns = ModeChoice::largest(values(&by_columns).iter().map(Vec::as_slice), 9);
        assert_eq!(of_rows.kept, of_columns.kept);
        let rows = of_rows.basis(&classes, |mode| {
            by_rows[mode.class].vectors.column(mode.position).to_vec()
        });
        let columns = of_columns.basis(&classes, |mode| {
            let part = &by_columns[mode.class];
            let scale = part.singular_values[mode.position];
            let weights: Vec<f64> = part
                .vectors
                .column(mode.position)
                .iter()
                .map(|w| w / scale)
                .collect();
            combined_columns(&folded[mode.class], &weights)
        });
        assert_is_the_svd(&rows, &classes, &signals);
        assert_is_the_svd(&columns, &classes, &signals);
        for (a, b) in rows.vectors.data().iter().zip(columns.vectors.data()) {
            assert!((a - b).abs() < 1e-6, "{a} against {b}");
        }
    }

    #[test]
    fn a_truncated_choice_may_cut_a_multiplet() {
        let values: [&[f64]; 1] = [&[2.0, 2.0, 2.0]];
        let mut choice = ModeChoice::largest(values, 1);
        assert_eq!(choice.kept.len(), 3);
        choice.truncate(1);
        assert_eq!(choice.scales(), [2.0]);
    }

    #[test]
    fn dark_signals_have_no_modes() {
        let modes = GramModes::of_shifted(Matrix::zeros(3, 3));
        assert!(modes.singular_values.is_empty());
        assert!(
            GramModes::of(&Matrix::zeros(0, 0))
                .singular_values
                .is_empty()
        );
    }

    #[test]
    fn snapshots_of_either_side_give_the_same_modes() {
        let wide = Matrix::from_fn(4, 9, |i, j| ((3 * i + 5 * j + i * j) % 7) as f64 - 2.0);
        let tall = wide.transposed();
        let (a, b) = (Snapshots::of(&wide), Snapshots::of(&tall));
        let values = a.singular_values().iter().zip(b.singular_values());
        for (k, (x, y)) in values.enumerate() {
            // Roots of eigenvalues that err by a rounding of the largest.
            assert!((x - y).abs() < 1e-9);
            let ((u, v), (v_too, u_too)) = (a.pair(&wide, k), b.pair(&tall, k));
            assert!((dot(&u, &u_too).abs() - 1.0).abs() < 1e-9);
            assert!((dot(&v, &v_too).abs() - 1.0).abs() < 1e-9);
            let image = combined_columns(&wide, &v);
            assert!((dot(&image, &u) - x).abs() < 1e-9);
        }
        assert_eq!(a.singular_values().len(), 4);
        assert_eq!(b.singular_values().len(), 4);
    }
}
