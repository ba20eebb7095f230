//! From linear colours to what a screen shows.

use super::picture::Picture;
use glam::Vec3;

/// Luminance that auto exposure gives the median pixel.
const MIDDLE_GREY: f32 = 0.2;

/// Auto exposure lets at most this share of the pixels become white.
const WHITE_SHARE: f64 = 0.02;

/// Relative luminance of linear RGB with sRGB's primaries.
pub fn luminance(colour: Vec3) -> f32 {
    colour.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Pixels darker than this share of the brightest count as unlit.
const UNLIT_SHARE: f32 = 0.01;

/// The factor that exposes pictures well: the median pixel becomes a middle grey, unless too many pixels would then be
/// white. Unlit pixels do not count. 1 for pictures without light.
pub fn auto_exposure(pictures: &[&Picture]) -> f32 {
    let mut lit: Vec<f32> = pictures
        .iter()
        .flat_map(|picture| &picture.pixels)
        .map(|&colour| luminance(colour))
        .filter(|&value| value > 0.0 && value.is_finite())
        .collect();
    if lit.is_empty() {
        return 1.0;
    }
    lit.sort_by(f32::total_cmp);
    let at = |values: &[f32], share: f64| values[((values.len() - 1) as f64 * share) as usize];
    let bright = at(&lit, 1.0 - WHITE_SHARE);
    let dark = lit.partition_point(|&value| value < UNLIT_SHARE * bright);
    // The curve takes a value of 2 to nearly white.
    let exposure = (MIDDLE_GREY / at(&lit[dark..], 0.5)).min(2.0 / bright);
    exposure.clamp(1e-20, 1e20)
}

/// Scales by the exposure, compresses highlights and encodes as 8-bit sRGB, three bytes a pixel.
pub fn tone_map(picture: &Picture, exposure: f32) -> Vec<u8> {
    picture
        .pixels
        .iter()
        .flat_map(|&colour| {
            let rolled = (colour * exposure).max(Vec3::ZERO).map(roll_off);
            rolled.to_array().map(srgb_byte)
        })
        .collect()
}

/// Narkowicz's fit of the ACES film curve (2016).
fn roll_off(x: f32) -> f32 {
    if !x.is_finite() {
        return 1.0;
    }
    // The curve is flat beyond this, and squares stay finite.
    let x = x.min(1e3);
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).min(1.0)
}

fn srgb_byte(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brighter_never_becomes_darker() {
        let mut last = 0;
        for k in 0..2000 {
            let byte = srgb_byte(roll_off(k as f32 * 0.01));
            assert!(byte >= last);
            last = byte;
        }
        assert_eq!(srgb_byte(roll_off(f32::INFINITY)), 255);
        assert_eq!(srgb_byte(roll_off(0.0)), 0);
    }

    #[test]
    fn exposure_does_not_depend_on_unlit_pixels() {
        let mut picture = Picture::new(10, 10);
        assert_eq!(auto_exposure(&[&picture]), 1.0);
        picture.pixels[..40].fill(Vec3::splat(50.0));
        let exposure = auto_exposure(&[&picture]);
        assert!((exposure - MIDDLE_GREY / 50.0).abs() < 1e-6);
    }
}
