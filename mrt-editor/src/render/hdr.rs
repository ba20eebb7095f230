//! Radiance HDR: pixels as three mantissas of a byte each and one exponent, run-length encoded (Ward, "Real pixels",
//! Graphics Gems II, 1991; the file format of Radiance).

use super::Picture;
use glam::Vec3;

/// Rows of these widths may be run-length encoded; others are stored as they are.
const ENCODED_WIDTHS: std::ops::Range<usize> = 8..32_768;

/// Equal bytes that one code stands for, and different bytes that follow one code, at most.
const MAX_RUN: usize = 127;
const MAX_LITERAL: usize = 128;

/// Equal bytes from which on a run is shorter than the bytes themselves.
const MIN_RUN: usize = 3;

/// The bytes of a file that holds the picture. Each channel keeps 8 bits relative to the pixel's brightest one; negative
/// numbers and NaN become 0, and what exceeds 2^126 becomes that.
pub fn encode(picture: &Picture) -> Vec<u8> {
    let mut bytes = format!(
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n",
        picture.height, picture.width
    )
    .into_bytes();
    for row in picture.pixels.chunks(picture.width.max(1)) {
        let pixels: Vec<[u8; 4]> = row.iter().map(|&colour| rgbe(colour)).collect();
        if !ENCODED_WIDTHS.contains(&row.len()) {
            bytes.extend_from_slice(pixels.as_flattened());
            continue;
        }
        bytes.extend([2, 2, (row.len() >> 8) as u8, row.len() as u8]);
        for part in 0..4 {
            let plane: Vec<u8> = pixels.iter().map(|pixel| pixel[part]).collect();
            encode_runs(&plane, &mut bytes);
        }
    }
    bytes
}

/// Mantissas of red, green and blue, and their common exponent plus 128.
fn rgbe(colour: Vec3) -> [u8; 4] {
    const LARGEST: f32 = (1u128 << 126) as f32;
    // NaN is not brighter than 0.
    let colour = colour
        .to_array()
        .map(|x| x.max(0.0))
        .map(|x| x.min(LARGEST));
    let brightest = colour.into_iter().fold(0.0, f32::max);
    if brightest < f32::MIN_POSITIVE {
        return [0; 4];
    }
    // Numbers are at least half of 2^exponent and below it.
    let exponent = (brightest.to_bits() >> 23) as i32 - 126;
    let scale = 256.0 / 2f64.powi(exponent);
    let [r, g, b] = colour.map(|x| (f64::from(x) * scale) as u8);
    [r, g, b, (exponent + 128) as u8]
}

fn encode_runs(plane: &[u8], bytes: &mut Vec<u8>) {
    let run_at = |at: usize| {
        let same = plane[at..].iter().take_while(|&&byte| byte == plane[at]);
        same.take(MAX_RUN).count()
    };
    let mut at = 0;
    while at < plane.len() {
        let run = run_at(at);
        if run >= MIN_RUN {
            bytes.extend([128 + run as u8, plane[at]]);
            at += run;
            continue;
        }
        let mut end = at + run;
        while end < plane.len() && end - at < MAX_LITERAL && run_at(end) < MIN_RUN {
            end += 1;
        }
        bytes.push((end - at) as u8);
        bytes.extend_from_slice(&plane[at..end]);
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixels of an encoded row.
    fn decode_row(mut bytes: &[u8], width: usize) -> Vec<Vec3> {
        assert_eq!(bytes[..4], [2, 2, (width >> 8) as u8, width as u8]);
        bytes = &bytes[4..];
        let mut planes = vec![Vec::new(); 4];
        for plane in &mut planes {
            while plane.len() < width {
                let (code, rest) = bytes.split_first().expect("a code");
                let code = usize::from(*code);
                let used = if code > 128 {
                    plane.extend(vec![rest[0]; code - 128]);
                    1
                } else {
                    plane.extend_from_slice(&rest[..code]);
                    code
                };
                bytes = &rest[used..];
            }
            assert_eq!(plane.len(), width);
        }
        assert!(bytes.is_empty());
        let pixel = |x: usize| {
            let scale = 2f32.powi(i32::from(planes[3][x]) - 136);
            Vec3::from_array([0, 1, 2].map(|part: usize| f32::from(planes[part][x]) * scale))
        };
        (0..width).map(pixel).collect()
    }

    #[test]
    fn a_decoded_row_is_the_encoded_one_within_a_mantissa() {
        let width = 700;
        let mut row = Picture::new(width, 1);
        for (k, pixel) in row.pixels.iter_mut().enumerate() {
            // A gradient, flat stretches longer than a run, and noise longer than a literal.
            *pixel = match k {
                0..200 => Vec3::new(1e-4 * k as f32, 0.5, 1e3),
                200..400 => Vec3::splat(0.25),
                _ => Vec3::splat(((k * 7919) % 251) as f32),
            };
        }
        let bytes = encode(&row);
        let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 700\n";
        assert!(bytes.starts_with(header));
        for (found, exact) in decode_row(&bytes[header.len()..], width)
            .iter()
            .zip(&row.pixels)
        {
            let bound = exact.max_element() / 128.0;
            assert!(
                (*found - *exact).abs().max_element() <= bound,
                "{found} for {exact}"
            );
        }
    }

    #[test]
    fn numbers_out_of_range_become_the_nearest_that_the_format_has() {
        assert_eq!(rgbe(Vec3::new(-1.0, f32::NAN, 0.0)), [0; 4]);
        assert_eq!(rgbe(Vec3::new(1.0, 0.5, f32::NAN)), [128, 64, 0, 129]);
        assert_eq!(rgbe(Vec3::splat(f32::INFINITY)), [128, 128, 128, 255]);
        let narrow = encode(&Picture::new(2, 2));
        assert!(narrow.ends_with(&[0; 16]));
    }
}
