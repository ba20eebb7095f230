//! Signs of a polynomial of degree four on [0, 1], from its Bernstein coefficients.
//!
//! The polynomial is a convex combination of its coefficients, its first and last values are the first and
//! last coefficient, and it has at most as many zeros as they have changes of sign; cutting the interval in
//! half (de Casteljau) makes all three sharper. See G. Farin, "Curves and Surfaces for CAGD", chapter 5.

/// Times that the interval is halved in search of a sign. Dips below zero that are shorter than
/// 2^-16 of it may be missed; between two points of the unit cube they are less than 1e-8 deep.
const DEPTH: u32 = 16;

/// Steps of the safeguarded Newton iteration; bisection alone would use up the digits in 53.
const MAX_STEPS: u32 = 64;

/// A polynomial of degree four.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quartic {
    /// Coefficients of 1, t, t², t³, t⁴.
    powers: [f64; 5],
    /// Bernstein coefficients on [0, 1].
    bernstein: [f64; 5],
}

impl Quartic {
    /// From the coefficients of 1, t, t², t³, t⁴.
    pub(super) fn new(powers: [f64; 5]) -> Self {
        let [a, b, c, d, e] = powers;
        let bernstein = [
            a,
            a + b / 4.0,
            a + b / 2.0 + c / 6.0,
            a + 0.75 * b + c / 2.0 + d / 4.0,
            a + b + c + d + e,
        ];
        Self { powers, bernstein }
    }

    /// The same with values at 0 and 1 that are negative by rounding made zero; `None` where one is below
    /// `-tolerance`.
    pub(super) fn with_ends_on_the_wall(mut self, tolerance: f64) -> Option<Self> {
        for end in [0, 4] {
            if self.bernstein[end] < -tolerance {
                return None;
            }
            self.bernstein[end] = self.bernstein[end].max(0.0);
        }
        Some(self)
    }

    /// True where no value on [0, 1] is negative; the first is taken to be none.
    pub(super) fn stays_non_negative(&self) -> bool {
        first_crossing(&self.bernstein, DEPTH).is_none()
    }

    /// The first t in [0, 1] where values turn negative; the value at 0 counts as at least zero.
    pub(super) fn first_negative(&self) -> Option<f64> {
        let mut bernstein = self.bernstein;
        bernstein[0] = bernstein[0].max(0.0);
        let (mut low, mut high) = first_crossing(&bernstein, DEPTH)?;
        let mut t = 0.5 * (low + high);
        for _ in 0..MAX_STEPS {
            let [a, b, c, d, e] = self.powers;
            let value = a + t * (b + t * (c + t * (d + t * e)));
            let slope = b + t * (2.0 * c + t * (3.0 * d + t * (4.0 * e)));
            if value < 0.0 {
                high = t;
            } else {
                low = t;
            }
            let newton = t - value / slope;
            // Also false where the slope is zero.
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            if next == t || high - low <= f64::EPSILON {
                break;
            }
            t = next;
        }
        Some(t)
    }
}

/// An interval in [0, 1] at whose end values are negative, and on which they turned so once and for the
/// first time. The first coefficient must not be negative.
fn first_crossing(bernstein: &[f64; 5], depth: u32) -> Option<(f64, f64)> {
    if bernstein.iter().all(|&b| b >= 0.0) {
        return None;
    }
    let turns_once = bernstein
        .windows(2)
        .all(|pair| pair[0] >= 0.0 || pair[1] <= 0.0);
    if bernstein[4] < 0.0 && (turns_once || depth == 0) {
        return Some((0.0, 1.0));
    }
    if depth == 0 {
        return None;
    }
    let (left, right) = halves(bernstein);
    // The right half starts where the left one ends: not below zero, or the left one had a crossing.
    first_crossing(&left, depth - 1)
        .map(|(a, b)| (0.5 * a, 0.5 * b))
        .or_else(|| first_crossing(&right, depth - 1).map(|(a, b)| (0.5 + 0.5 * a, 0.5 + 0.5 * b)))
}

/// Bernstein coefficients on the two halves of the interval.
fn halves(bernstein: &[f64; 5]) -> ([f64; 5], [f64; 5]) {
    let mut row = *bernstein;
    let mut left = [0.0; 5];
    let mut right = [0.0; 5];
    for k in 0..5 {
        left[k] = row[0];
        right[4 - k] = row[4 - k];
        for i in 0..4 - k {
            row[i] = 0.5 * (row[i] + row[i + 1]);
        }
    }
    (left, right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crossing_is_found_before_a_later_one() {
        // Zeros at 0.2, 0.5 and 0.8, each simple; negative between the first two and after the last.
        let powers = [0.08, -0.66, 1.5, -1.0, 0.0];
        let t = Quartic::new(powers).first_negative().expect("it crosses");
        // A simple zero of slope 0.18: a few ulp of the coefficients by that.
        assert!((t - 0.2).abs() < 1e-13, "{t}");
    }

    #[test]
    fn touching_zero_is_not_crossing_it() {
        // (t - 0.3)²: the double zero splits into nothing but rounding.
        let touching = Quartic::new([0.09, -0.6, 1.0, 0.0, 0.0]);
        assert!(touching.stays_non_negative());
        let crossing = Quartic::new([0.09 - 1e-6, -0.6, 1.0, 0.0, 0.0]);
        assert!(!crossing.stays_non_negative());
    }

    #[test]
    fn ends_on_the_wall_are_forgiven_rounding_and_no_more() {
        let falling = Quartic::new([1.0, -1.0 - 1e-9, 0.0, 0.0, 0.0]);
        assert!(
            falling
                .with_ends_on_the_wall(1e-6)
                .is_some_and(|q| q.stays_non_negative())
        );
        assert!(falling.with_ends_on_the_wall(1e-12).is_none());
    }
}
