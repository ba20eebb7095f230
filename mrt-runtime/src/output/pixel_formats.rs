//! Number formats of textures.

use half::f16;

/// The bits of the half-precision number nearest to `x`; values beyond ±65,504 become ±65,504, NaN becomes 0.
pub(crate) fn f16_bits(x: f32) -> u16 {
    let largest = f32::from(f16::MAX);
    if x.is_nan() {
        return 0;
    }
    f16::from_f32(x.clamp(-largest, largest)).to_bits()
}

/// Three numbers with 9 bits each and a shared exponent: Vulkan's `E5B9G9R9_UFLOAT_PACK32`, OpenGL's `RGB9_E5` (Khronos
/// data format specification, section 10.6). Negative numbers and NaN become 0, numbers above 65,408 become 65,408. The
/// error is at most 1/511 of the largest of the three, and 2^-25 where that is less.
pub(crate) fn rgb9e5(rgb: [f32; 3]) -> u32 {
    const MANTISSA_BITS: i32 = 9;
    const BIAS: i32 = 15;
    const LARGEST: f32 = 65_408.0;
    // Comparisons with NaN are false, so NaN becomes 0.
    let rgb = rgb.map(|x| if x > 0.0 { x.min(LARGEST) } else { 0.0 });
    let most = rgb[0].max(rgb[1]).max(rgb[2]);
    let floor_log2 = (most.to_bits() >> 23) as i32 - 127;
    let mut exponent = floor_log2.max(-BIAS - 1) + 1 + BIAS;
    let scale = |exponent: i32| {
        // One over the step between mantissas: a power of two, and a normal number for every exponent from 0 to 31.
        let power = BIAS + MANTISSA_BITS - exponent;
        f32::from_bits(((power + 127) as u32) << 23)
    };
    // Rounding may carry into a tenth bit.
    if (most * scale(exponent) + 0.5) as u32 == 1 << MANTISSA_BITS {
        exponent += 1;
    }
    let [r, g, b] = rgb.map(|x| (x * scale(exponent) + 0.5) as u32);
    (exponent as u32) << 27 | b << 18 | g << 9 | r
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(packed: u32) -> [f64; 3] {
        let step = 2f64.powi((packed >> 27) as i32 - 24);
        [0, 9, 18].map(|shift| f64::from(packed >> shift & 511) * step)
    }

    #[test]
    fn shared_exponents_are_within_half_a_step() {
        let mut colours = vec![[1.0, 0.5, 0.25], [65_408.0, 1.0, 0.0], [511.5, 3.0, 0.1]];
        for k in 0..2000u32 {
            let at = |j: u32| ((k * 37 + j * 101) % 997) as f32 / 31.0;
            let scale = 2f32.powi((k % 30) as i32 - 20);
            colours.push([at(1) * scale, at(2) * scale, at(3) * scale]);
        }
        for rgb in colours {
            let rgb = rgb.map(|x: f32| x.min(65_408.0));
            let largest = f64::from(rgb[0].max(rgb[1]).max(rgb[2]));
            // Half a step. The largest takes at least 256 steps, or 255.5 where rounding carried. Below 2^-16 the
            // exponent is 0 and a step is 2^-24.
            let bound = (largest / 511.0).max(2f64.powi(-25));
            for (x, found) in rgb.into_iter().zip(decode(rgb9e5(rgb))) {
                assert!((f64::from(x) - found).abs() <= bound, "{rgb:?}: {found}");
            }
        }
    }

    #[test]
    fn nan_and_negative_numbers_are_black_and_infinity_is_the_brightest() {
        assert_eq!(rgb9e5([f32::NAN, -1.0, 0.0]), 0);
        assert_eq!(decode(rgb9e5([f32::INFINITY; 3])), [65_408.0; 3]);
        assert_eq!(f16_bits(f32::NAN), 0);
        assert_eq!(f16_bits(1e9), 0x7bff);
        assert_eq!(f16_bits(-f32::INFINITY), 0xfbff);
    }
}
