//! Encoding a matrix: the choice of scales, and rounding.

use super::matrix::{CowValues, ModeAxis, Storage, StoredMatrix, assert_finite};
use crate::linalg::matrix::Matrix;
use half::f16;
use std::borrow::Cow;

/// The largest `f16` value of a mode is in 2^14 ..= 2^15: as far as possible above the subnormal
/// numbers, yet a binade below the largest number, so that rounding up cannot reach infinity.
const F16_TOP_EXPONENT: i32 = 14;
/// Largest scale for `f16`: its product with the largest half-precision number is still finite.
const F16_LARGEST_SCALE_EXPONENT: i32 = 112;

impl StoredMatrix<'static> {
    /// Rounds a matrix to `storage`, with one scale per mode unless that is `f32`.
    ///
    /// `f16` divides by a power of two, exactly, and rounds to nearest, ties to even, so the error
    /// does not depend on the magnitude of a mode. `int8` rounds to multiples of 1/127 of the mode's
    /// largest magnitude, likewise. The same matrix gives the same bits on every machine.
    ///
    /// Cost: two passes over the matrix.
    ///
    /// # Panics
    /// If an element is infinite or NaN.
    pub fn encode(matrix: &Matrix<f32>, storage: Storage, modes: ModeAxis) -> Self {
        assert_finite(matrix);
        let scales: Vec<f32> = match storage {
            Storage::F32 => Vec::new(),
            Storage::F16 => mode_maxima(matrix, modes).map(f16_scale).collect(),
            Storage::Int8 => mode_maxima(matrix, modes).map(int8_scale).collect(),
        };
        let values = match storage {
            Storage::F32 => CowValues::F32(Cow::Owned(matrix.data().to_vec())),
            Storage::F16 => {
                let values = scaled(matrix, modes, &scales).map(round_to_f16);
                CowValues::F16(Cow::Owned(values.collect()))
            }
            Storage::Int8 => {
                let values = scaled(matrix, modes, &scales).map(round_to_int8);
                CowValues::Int8(Cow::Owned(values.collect()))
            }
        };
        StoredMatrix {
            rows: matrix.rows(),
            columns: matrix.columns(),
            modes,
            values,
            scales: Cow::Owned(scales),
        }
    }
}

/// The power of two that a mode with the given largest magnitude is divided by; 1 for a mode of zeros.
///
/// Powers of two are exact factors, so a product may multiply by them before or after it sums. The
/// limits at both ends lose nothing: at the lower one, the numbers of a mode are multiples of 2^-149
/// and stay exact or normal; at the upper one, the largest value lies one binade higher.
fn f16_scale(largest: f32) -> f32 {
    if largest == 0.0 {
        return 1.0;
    }
    // A subnormal number gives -127, which the lower limit covers.
    let exponent = (largest.to_bits() >> 23) as i32 - 127;
    let smallest = f32::MIN_EXP - 1;
    let scale = (exponent - F16_TOP_EXPONENT).clamp(smallest, F16_LARGEST_SCALE_EXPONENT);
    f32::from_bits(((scale + 127) as u32) << 23)
}

/// Nearest half-precision number, ties to even.
///
/// A number beyond the largest finite one becomes that one, an error of at most 2^-11. Only numbers
/// next to `f32::MAX` get there.
fn round_to_f16(x: f32) -> f16 {
    let largest = Storage::F16.largest_value();
    // Not `from_f32`, whose code depends on features that other crates may set.
    f16::from_f32_const(x.clamp(-largest, largest))
}

/// A 127th of the largest magnitude of a mode; 1 for a mode of zeros.
///
/// The scale is never subnormal, because some machines take subnormal numbers for zero. So modes below
/// 127 x 2^-126, about 1.5e-36, are stored more coarsely.
fn int8_scale(largest: f32) -> f32 {
    let steps = Storage::Int8.largest_value();
    if largest == 0.0 {
        return 1.0;
    }
    let scale = (largest / steps).max(f32::MIN_POSITIVE);
    // The quotient may have been rounded up; next to `f32::MAX` the product then overflows.
    if (scale * steps).is_finite() {
        scale
    } else {
        scale.next_down()
    }
}

/// Nearest integer, ties to even. The clamp is for rounding errors: nothing else exceeds 127.
fn round_to_int8(x: f32) -> i8 {
    let largest = Storage::Int8.largest_value();
    x.round_ties_even().clamp(-largest, largest) as i8
}

/// Largest magnitude of each mode.
fn mode_maxima(matrix: &Matrix<f32>, modes: ModeAxis) -> impl Iterator<Item = f32> {
    let mut maxima = vec![0f32; modes.count(matrix.rows(), matrix.columns())];
    for j in 0..matrix.columns() {
        let column = matrix.column(j).iter().map(|x| x.abs());
        match modes {
            ModeAxis::Rows => {
                for (largest, x) in maxima.iter_mut().zip(column) {
                    *largest = largest.max(x);
                }
            }
            ModeAxis::Columns => maxima[j] = column.fold(0.0, f32::max),
        }
    }
    maxima.into_iter()
}

/// Every element divided by the scale of its mode, column by column.
fn scaled(matrix: &Matrix<f32>, modes: ModeAxis, scales: &[f32]) -> impl Iterator<Item = f32> {
    (0..matrix.columns()).flat_map(move |j| {
        let column = matrix.column(j).iter().enumerate();
        column.map(move |(i, x)| match modes {
            ModeAxis::Rows => x / scales[i],
            ModeAxis::Columns => x / scales[j],
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The midpoint of two neighbours goes to the even one, every other number to the nearer one.
    #[test]
    fn f16_rounds_to_nearest_even_everywhere() {
        for bits in 0..f16::MAX.to_bits() {
            let (low, high) = (f16::from_bits(bits), f16::from_bits(bits + 1));
            // Exact: the sum of two neighbours has twelve significant bits.
            let middle = (low.to_f32_const() + high.to_f32_const()) * 0.5;
            let even = if bits % 2 == 0 { low } else { high };
            for (x, expected) in [
                (low.to_f32_const(), low),
                (middle.next_down(), low),
                (middle, even),
                (middle.next_up(), high),
            ] {
                assert_eq!(round_to_f16(x), expected, "{x:e}");
                assert_eq!(round_to_f16(-x), -expected, "-{x:e}");
            }
        }
        assert_eq!(round_to_f16(f32::MAX), f16::MAX);
    }

    #[test]
    fn int8_rounds_to_nearest_even_and_stays_symmetric() {
        for (x, expected) in [
            (0.5, 0),
            (1.5, 2),
            (-0.5, 0),
            (-2.5, -2),
            (126.6, 127),
            (127.000_01, 127),
            (-127.000_01, -127),
        ] {
            assert_eq!(round_to_int8(x), expected, "{x}");
        }
    }

    #[test]
    fn scales_are_normal_and_their_products_finite() {
        let mut largest = f32::from_bits(1);
        while largest.is_finite() {
            for x in [largest, largest.next_down(), largest.next_up()] {
                let (half, int8) = (f16_scale(x), int8_scale(x));
                assert!(half.is_normal() && half.to_bits() << 9 == 0, "{x:e}");
                assert!((half * f16::MAX.to_f32_const()).is_finite(), "{x:e}");
                assert!(int8.is_normal() && (int8 * 127.0).is_finite(), "{x:e}");
                // From 2^127 on, values lie one binade higher.
                assert!(x / half <= if x < 2f32.powi(127) { 32768.0 } else { 65536.0 });
                // Two units in the last place: one for the scale, one for this quotient.
                assert!(x / int8 <= 127.000_02, "{x:e}");
            }
            largest *= 2.0;
        }
        assert!((int8_scale(f32::MAX) * 127.0).is_finite());
        assert_eq!((f16_scale(0.0), int8_scale(0.0)), (1.0, 1.0));
    }
}
