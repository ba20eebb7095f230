//! Colours of vertices, which many programs write behind the coordinates although the format has none.
//!
//! They are taken as sRGB: MeshLab and scanners write the bytes of a screen, Blender converts to sRGB, and three.js and
//! Godot read them so. Some write 0 to 255 instead of 0 to 1.

use glam::Vec3;

/// No colour from 0 to 1 is beyond this, not even one that overshoots, and hardly an image from 0 to 255 stays below.
const LARGEST_SHARE: f32 = 2.0;

/// Linear RGB, 0 to 1; white for vertices that have no colour, which are NaN.
pub(super) fn linear_colours(colours: &[Vec3]) -> Vec<Vec3> {
    let finite = colours.iter().filter(|colour| colour.is_finite());
    let largest = finite
        .map(|colour| colour.max_element())
        .fold(0.0, f32::max);
    let white = if largest > LARGEST_SHARE { 255.0 } else { 1.0 };
    let linear = |&colour: &Vec3| match colour.is_finite() {
        true => (colour / white)
            .clamp(Vec3::ZERO, Vec3::ONE)
            .map(linear_from_srgb),
        false => Vec3::ONE,
    };
    colours.iter().map(linear).collect()
}

/// IEC 61966-2-1.
fn linear_from_srgb(shown: f32) -> f32 {
    if shown <= 0.04045 {
        shown / 12.92
    } else {
        ((shown + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ranges_give_the_same_linear_colours() {
        let bytes = [
            Vec3::new(188.0, 137.0, 99.0),
            Vec3::NAN,
            Vec3::new(0.0, 10.0, 255.0),
        ];
        let shares = bytes.map(|colour| colour / 255.0);
        let linear = linear_colours(&shares);
        let expected = Vec3::new(0.5029, 0.2502, 0.1248);
        assert!(
            (linear[0] - expected).abs().max_element() < 1e-4,
            "{linear:?}"
        );
        assert_eq!(linear[1], Vec3::ONE);
        assert!((linear[2].y - 10.0 / 255.0 / 12.92).abs() < 1e-6);
        let difference = |(a, b): (&Vec3, Vec3)| (*a - b).abs().max_element();
        let both = linear.iter().zip(linear_colours(&bytes));
        assert!(both.map(difference).fold(0.0, f32::max) < 1e-6);
        assert_eq!(linear_colours(&[Vec3::new(-1.0, 1.5, 0.0)]), [Vec3::Y]);
    }
}
