//! Signs of a polynomial of degree four on [0, 1], from its Bernstein coefficients.
//!
//! The values of the polynomial are convex combinations of its coefficients. Its first and last values are
//! the first and the last coefficient. It has at most as many zeros as the coefficients have changes of
//! sign. Halving the interval (de Casteljau) makes all three statements sharper. See G. Farin, "Curves and
//! Surfaces for CAGD", chapter 5.

/// How many times the interval is halved in search of a sign.
///
/// Dips below zero that are shorter than 2^-16 of the interval may be missed. Between two points of the
/// unit cube they are less than 1e-8 deep.
const DEPTH: u32 = 16;

/// Most steps of the safeguarded Newton iteration. Bisection alone would take 53 to use up the digits.
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
    /// The polynomial with the given coefficients of 1, t, t², t³, t⁴.
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

    /// The same polynomial, but values at 0 and 1 that are negative by at most `tolerance` become zero;
    /// `None` if one is lower.
    pub(super) fn with_ends_on_the_wall(mut self, tolerance: f64) -> Option<Self> {
        for end in [0, 4] {
            if self.bernstein[end] < -tolerance {
                return None;
            }
            self.bernstein[end] = self.bernstein[end].max(0.0);
        }
        Some(self)
    }

    /// True if no value on [0, 1] is negative. The value at 0 must not be negative.
    pub(super) fn stays_non_negative(&self) -> bool {
        first_crossing(&self.bernstein, DEPTH).is_none()
    }

    /// The first t in [0, 1] where values turn negative. A negative value at 0 counts as zero.
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
            // Written so that NaN and infinity, from a slope of zero, fail.
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

/// An interval of [0, 1] that contains the first change of values from positive to negative and no other,
/// and at whose end the value is negative. The first coefficient must not be negative.
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
    // The right half starts where the left one ends. That value is not negative, or the left half would
    // contain a crossing.
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
        // Simple zeros at 0.2, 0.5 and 0.8; negative between the first two and after the last.
        let powers = [0.08, -0.66, 1.5, -1.0, 0.0];
        let t = Quartic::new(powers).first_negative().expect("it crosses");
        // The slope is 0.18, so the zero errs by a few ulp of the coefficients over 0.18.
        assert!((t - 0.2).abs() < 1e-13, "{t}");
    }

    #[test]
    fn a_polynomial_that_touches_zero_does_not_cross_it() {
        // (t - 0.3)² has a double zero.
        let touching = Quartic::new([0.09, -0.6, 1.0, 0.0, 0.0]);
        assert!(touching.stays_non_negative());
        let crossing = Quartic::new([0.09 - 1e-6, -0.6, 1.0, 0.0, 0.0]);
        assert!(!crossing.stays_non_negative());
    }

    #[test]
    fn ends_may_be_negative_by_the_tolerance_but_not_by_more() {
        let falling = Quartic::new([1.0, -1.0 - 1e-9, 0.0, 0.0, 0.0]);
        assert!(
            falling
                .with_ends_on_the_wall(1e-6)
                .is_some_and(|q| q.stays_non_negative())
        );
        assert!(falling.with_ends_on_the_wall(1e-12).is_none());
    }
}
