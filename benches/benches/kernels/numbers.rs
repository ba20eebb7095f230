//! Operands whose exact sums are known, and how near a sum in `f32` must be to them.

use mrt_core::simd::Aligned;
use mrt_core::simd::tiles::{CHANNELS, PackedNumber};

/// Numbers as operators are stored.
pub trait Number: PackedNumber + bytemuck::Pod {
    /// A number of -8 to 8, which every storage holds exactly.
    fn of(small: i8) -> Self;
}

impl Number for f32 {
    fn of(small: i8) -> f32 {
        f32::from(small)
    }
}

/// `f16` by its bits.
impl Number for u16 {
    fn of(small: i8) -> u16 {
        half::f16::from_f32_const(f32::from(small)).to_bits()
    }
}

impl Number for i8 {
    fn of(small: i8) -> i8 {
        small
    }
}

/// Number `k` of an operator: -8 to 8, without a pattern that kernels could share.
pub fn small(k: usize) -> i8 {
    let mixed = (k as u32).wrapping_mul(2_654_435_761) >> 16;
    (mixed % 17) as i8 - 8
}

/// Number `k` of an operator, for exact sums.
pub fn exact_small(k: usize) -> f64 {
    f64::from(small(k))
}

/// Positive numbers, as of light, which no storage rounds.
pub fn light(count: usize) -> Aligned<f32> {
    (0..count).map(|k| 0.1 + 0.01 * (k % 97) as f32).collect()
}

/// Red, green and blue of a signal, one after the other in memory.
pub fn channels(signal: &[f32]) -> [&[f32]; CHANNELS] {
    let length = signal.len() / CHANNELS;
    std::array::from_fn(|c| &signal[c * length..(c + 1) * length])
}

/// A sum in `f64` and the sum of its terms' magnitudes.
#[derive(Clone, Copy)]
pub struct ExactSum {
    value: f64,
    magnitude: f64,
}

impl ExactSum {
    pub fn of(terms: impl Iterator<Item = f64>) -> ExactSum {
        let zero = ExactSum {
            value: 0.0,
            magnitude: 0.0,
        };
        terms.fold(zero, |sum, term| ExactSum {
            value: sum.value + term,
            magnitude: sum.magnitude + term.abs(),
        })
    }

    /// The sum, or 0 where it is negative.
    pub fn or_zero(self) -> ExactSum {
        ExactSum {
            value: self.value.max(0.0),
            ..self
        }
    }

    /// # Panics
    /// If `found` is further away than the rounding of a sum in `f32`.
    pub fn check(self, found: f32) {
        let difference = (f64::from(found) - self.value).abs();
        let value = self.value;
        assert!(
            difference <= 1e-5 * self.magnitude,
            "{found} instead of {value}"
        );
    }
}
