//! Images of materials in linear light, filtered for areas of any size.

use super::limits::{MAX_DECODED_BYTES, MAX_IMAGE_SIDE};
use super::raw_mesh::Wrap;
use glam::{Vec2, Vec3};
use image::{DynamicImage, ImageReader, Limits};
use rayon::prelude::*;
use std::io::Cursor;

/// Texels of all textures of a scene together, at most; larger images are halved until all of them fit.
const MOST_TEXELS: usize = 64 << 20;

/// Longest side of a texture: a wall of a few metres fills a picture with fewer.
const LONGEST_SIDE: usize = 1024;

/// Texels whose mean is needed are told apart only down to this side, however many images there are.
const SHORTEST_SIDE: usize = 16;

/// Largest value of a stored channel; the steps are finer than those of 8-bit sRGB everywhere.
const WHITE: f32 = u16::MAX as f32;

/// An image and its halves, quarters and so on down to one texel, each of which is the mean of the area that it covers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Texture {
    levels: Vec<Level>,
}

/// One size of an image.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    width: usize,
    height: usize,
    /// Linear RGB over [`WHITE`], row by row from the top.
    texels: Vec<[u16; 3]>,
}

/// Longest side of each of `count` textures, so that all of them stay within [`MOST_TEXELS`].
pub(super) fn longest_side(count: usize) -> usize {
    let each = MOST_TEXELS / count.max(1);
    let mut side = LONGEST_SIDE;
    while side > SHORTEST_SIDE && side * side > each {
        side /= 2;
    }
    side
}

impl Texture {
    /// Reads a PNG, JPEG or WebP of sRGB colours. Alpha plays no part: materials without a mask ignore it, and cut-outs keep
    /// the colour that they are painted with. Images with a side over `longest` are halved until none is.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub(super) fn decode(bytes: &[u8], longest: usize) -> Result<Self, String> {
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| error.to_string())?;
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_IMAGE_SIDE);
        limits.max_image_height = Some(MAX_IMAGE_SIDE);
        limits.max_alloc = Some(MAX_DECODED_BYTES);
        reader.limits(limits);
        let image = reader.decode().map_err(|error| error.to_string())?;
        let (width, height) = (image.width() as usize, image.height() as usize);
        if width == 0 || height == 0 {
            return Err("it has no texels".to_owned());
        }
        Ok(Self::new(width, height, &samples(image), longest))
    }

    /// From samples of sRGB; a texel has as many as divide them evenly.
    fn new(width: usize, height: usize, samples: &[u8], longest: usize) -> Self {
        let linear: Vec<f32> = (0..=u8::MAX).map(linear_from_srgb).collect();
        let channels = samples.len() / (width * height);
        // One or two channels are grey with or without alpha.
        let offsets = if channels < 3 { [0; 3] } else { [0, 1, 2] };
        let texel = |x: usize, y: usize| {
            let first = (y * width + x) * channels;
            offsets.map(|offset| linear[samples[first + offset] as usize])
        };
        let mut level = if width.max(height) > longest {
            Level::halved(width, height, texel)
        } else {
            Level::new(width, height, texel)
        };
        while level.width.max(level.height) > longest {
            level = level.half();
        }
        let mut levels = vec![level];
        while let Some(last) = levels.last()
            && last.texels.len() > 1
        {
            levels.push(last.half());
        }
        Self { levels }
    }

    /// Mean linear RGB around a place. `area` is that over which the mean is taken, as a share of the whole image.
    pub(super) fn sample(&self, at: Vec2, wrap: [Wrap; 2], area: f32) -> Vec3 {
        let texels = area * self.levels[0].texels.len() as f32;
        let last = self.levels.len() - 1;
        if !at.is_finite() || !texels.is_finite() {
            return self.levels[last].bilinear(Vec2::ZERO, wrap);
        }
        // Each level has a quarter of the texels of the one before.
        let level = (0.5 * texels.max(1.0).log2()).min(last as f32);
        let (finer, share) = (level as usize, level.fract());
        let fine = self.levels[finer].bilinear(at, wrap);
        if share == 0.0 {
            return fine;
        }
        fine.lerp(self.levels[(finer + 1).min(last)].bilinear(at, wrap), share)
    }
}

impl Level {
    fn new(width: usize, height: usize, texel: impl Fn(usize, usize) -> [f32; 3] + Sync) -> Self {
        let row = |y: usize| (0..width).map(move |x| (x, y)).collect::<Vec<_>>();
        let texels = (0..height)
            .into_par_iter()
            .flat_map_iter(row)
            .map(|(x, y)| texel(x, y).map(|channel| (channel * WHITE).round() as u16))
            .collect();
        Self {
            width,
            height,
            texels,
        }
    }

    /// The half of an image of this size.
    fn halved(
        width: usize,
        height: usize,
        texel: impl Fn(usize, usize) -> [f32; 3] + Sync,
    ) -> Self {
        Self::new(width.div_ceil(2), height.div_ceil(2), |x, y| {
            let mut mean = Vec3::ZERO;
            for (y, down) in parts(height, y) {
                for (x, across) in parts(width, x) {
                    mean += Vec3::from_array(texel(x, y)) * (down * across);
                }
            }
            mean.to_array()
        })
    }

    fn half(&self) -> Self {
        Self::halved(self.width, self.height, |x, y| self.texel(x, y).to_array())
    }

    fn texel(&self, x: usize, y: usize) -> Vec3 {
        let texel = self.texels[y * self.width + x];
        Vec3::from_array(texel.map(f32::from)) / WHITE
    }

    fn bilinear(&self, at: Vec2, wrap: [Wrap; 2]) -> Vec3 {
        let [(left, right, across), (upper, lower, down)] = [
            neighbours(at.x, self.width, wrap[0]),
            neighbours(at.y, self.height, wrap[1]),
        ];
        let row = |y: usize| self.texel(left, y).lerp(self.texel(right, y), across);
        row(upper).lerp(row(lower), down)
    }
}

/// The texels between which a coordinate lies, and how far it is on its way from one to the other.
fn neighbours(at: f32, count: usize, wrap: Wrap) -> (usize, usize, f32) {
    let at = match wrap {
        Wrap::Repeat => at - at.floor(),
        Wrap::Mirror => at.rem_euclid(2.0),
        Wrap::Clamp => at.clamp(0.0, 1.0),
    };
    let position = at * count as f32 - 0.5;
    let count = count as i64;
    let index = |texel: i64| {
        let inside = match wrap {
            Wrap::Repeat => texel.rem_euclid(count),
            Wrap::Mirror => {
                let there_and_back = texel.rem_euclid(2 * count);
                there_and_back.min(2 * count - 1 - there_and_back)
            }
            Wrap::Clamp => texel.clamp(0, count - 1),
        };
        inside as usize
    };
    let first = position.floor();
    (
        index(first as i64),
        index(first as i64 + 1),
        position - first,
    )
}

/// The texels along an axis of `count` that the half's texel `k` covers, and the share of it that each takes. With an odd
/// count the half's texels are a little less than two wide, and share those at their borders.
fn parts(count: usize, k: usize) -> impl Iterator<Item = (usize, f32)> {
    let half = count.div_ceil(2);
    let width = count as f32 / half as f32;
    let (start, end) = (k as f32 * width, (k + 1) as f32 * width);
    (2 * k - k.min(count % 2)..(2 * k + 2).min(count)).filter_map(move |texel| {
        let covered = end.min((texel + 1) as f32) - start.max(texel as f32);
        (covered > 1e-6).then_some((texel, covered / width))
    })
}

/// All samples as 8 bits, row by row.
fn samples(image: DynamicImage) -> Vec<u8> {
    let upper = |samples: Vec<u16>| samples.iter().map(|sample| (sample >> 8) as u8).collect();
    match image {
        DynamicImage::ImageLuma8(image) => image.into_raw(),
        DynamicImage::ImageLumaA8(image) => image.into_raw(),
        DynamicImage::ImageRgb8(image) => image.into_raw(),
        DynamicImage::ImageRgba8(image) => image.into_raw(),
        DynamicImage::ImageLuma16(image) => upper(image.into_raw()),
        DynamicImage::ImageLumaA16(image) => upper(image.into_raw()),
        DynamicImage::ImageRgb16(image) => upper(image.into_raw()),
        DynamicImage::ImageRgba16(image) => upper(image.into_raw()),
        other => other.into_rgb8().into_raw(),
    }
}

/// The electro-optical transfer function of sRGB (IEC 61966-2-1).
fn linear_from_srgb(code: u8) -> f32 {
    let value = f32::from(code) / 255.0;
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::{jpeg::JpegEncoder, png::PngEncoder, webp::WebPEncoder};
    use image::{ExtendedColorType, ImageEncoder};

    const REPEAT: [Wrap; 2] = [Wrap::Repeat; 2];

    fn mean(texture: &Texture) -> Vec3 {
        texture.sample(Vec2::splat(0.5), REPEAT, 1e6)
    }

    #[test]
    fn means_are_taken_in_linear_light_whatever_the_size() {
        // Black and white columns. The mean of their codes would stand for 0.22 of light.
        for (width, height) in [(1, 1), (2, 2), (3, 5), (7, 1), (64, 48), (129, 31)] {
            let code = |texel: usize| {
                if (texel % width).is_multiple_of(2) {
                    255
                } else {
                    0
                }
            };
            let samples: Vec<u8> = (0..width * height).map(code).collect();
            let share = width.div_ceil(2) as f32 / width as f32;
            for longest in [LONGEST_SIDE, 16] {
                let texture = Texture::new(width, height, &samples, longest);
                // Each of up to eight halvings rounds to 1 / 65535.
                assert!((mean(&texture) - share).abs().max_element() < 1e-4);
                assert!(texture.levels[0].width.max(texture.levels[0].height) <= longest.max(1));
            }
        }
    }

    #[test]
    fn small_areas_show_texels_and_wraps_continue_the_image() {
        let texture = Texture::new(4, 1, &[0, 0, 255, 255], LONGEST_SIDE);
        let at = |x: f32, wrap: Wrap| texture.sample(Vec2::new(x, 0.5), [wrap; 2], 0.0).x;
        for (wrap, expected) in [
            (Wrap::Repeat, [0.0, 1.0, 0.0]),
            (Wrap::Mirror, [1.0, 1.0, 0.0]),
            (Wrap::Clamp, [1.0, 1.0, 1.0]),
        ] {
            let found = [1.25, 0.75, 2.25].map(|x| at(x, wrap));
            assert_eq!(found, expected, "{wrap:?}");
        }
        assert_eq!(at(-0.25, Wrap::Clamp), 0.0);
        assert_eq!(at(-0.375, Wrap::Mirror), 0.0);
        // The mean, rounded to 1 / 65535.
        assert!((at(f32::NAN, Wrap::Repeat) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn png_jpeg_and_webp_are_read() {
        let colour = [188, 137, 99];
        let pixels = colour.repeat(16 * 8);
        let kind = ExtendedColorType::Rgb8;
        let encoded = |write: &dyn Fn(&mut Vec<u8>) -> image::ImageResult<()>| {
            let mut bytes = Vec::new();
            write(&mut bytes).expect("encodes");
            bytes
        };
        let png = encoded(&|out| PngEncoder::new(out).write_image(&pixels, 16, 8, kind));
        let jpeg = encoded(&|out| JpegEncoder::new(out).write_image(&pixels, 16, 8, kind));
        let webp = encoded(&|out| WebPEncoder::new_lossless(out).write_image(&pixels, 16, 8, kind));
        // A JPEG may move each sample by one or two steps of 0.004.
        for (bytes, tolerance) in [(&png, 1e-3), (&jpeg, 0.02), (&webp, 1e-3)] {
            let found = mean(&Texture::decode(bytes, LONGEST_SIDE).expect("decodes"));
            let expected = Vec3::new(0.503, 0.250, 0.125);
            assert!(
                (found - expected).abs().max_element() < tolerance,
                "{found}"
            );
        }
        for cut in [0, 7, 40, png.len() / 2] {
            assert!(Texture::decode(&png[..cut], LONGEST_SIDE).is_err());
        }
    }

    #[test]
    fn huge_images_are_refused_and_many_are_kept_small() {
        // The header of a PNG of 100,000 x 100,000 pixels, and the start of its content.
        let header = b"\0\0\0\rIHDR\0\x01\x86\xa0\0\x01\x86\xa0\x08\x02\0\0\0\x27\x30\x9c\x9f";
        let content = b"\0\0\0\x0bIDAT\x78\x9c\x63\x60\x80\x00\x00\x00\x08\x00\x01\xb7\x58\x73\x95";
        let png = [&b"\x89PNG\r\n\x1a\n"[..], header, content].concat();
        let error = Texture::decode(&png, LONGEST_SIDE).expect_err("refused");
        assert!(error.to_lowercase().contains("limit"), "{error}");
        assert_eq!(longest_side(1), LONGEST_SIDE);
        for count in [65, 1000, 100_000] {
            let side = longest_side(count);
            assert!(side * side * count <= MOST_TEXELS || side == SHORTEST_SIDE);
        }
    }
}
