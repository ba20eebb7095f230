//! Pictures of linear light, and PNG files.

use mrt_runtime::Lightmap;
use mrt_runtime::glam::{Vec3, vec2};
use std::error::Error;
use std::path::Path;

/// Linear RGB radiance, row by row from the top.
#[derive(Clone)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<Vec3>,
}

impl Picture {
    /// Fills a picture, given the light at the centre of each pixel.
    pub fn new(width: usize, height: usize, light: impl Fn(f32, f32) -> Vec3) -> Self {
        let pixel = |k: usize| light((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
        Self {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
        }
    }

    /// The whole lightmap, enlarged by a bilinear filter such as a GPU's.
    pub fn of_lightmap(lightmap: &Lightmap, scale: usize) -> Self {
        let (width, height) = (lightmap.width() * scale, lightmap.height() * scale);
        Self::new(width, height, |x, y| {
            Vec3::from(lightmap.sample(vec2(x / width as f32, y / height as f32)))
        })
    }

    /// Pictures of one size side by side, row by row, with gaps between them.
    pub fn sheet(pictures: &[Picture], columns: usize) -> Self {
        const GAP: usize = 6;
        let (width, height) = (pictures[0].width + GAP, pictures[0].height + GAP);
        let rows = pictures.len().div_ceil(columns);
        Self::new(columns * width - GAP, rows * height - GAP, |x, y| {
            let (x, y) = (x as usize, y as usize);
            let (column, row) = (x / width, y / height);
            let Some(picture) = pictures.get(row * columns + column) else {
                return Vec3::ONE;
            };
            let (x, y) = (x % width, y % height);
            if x < picture.width && y < picture.height {
                picture.pixels[y * picture.width + x]
            } else {
                Vec3::ONE
            }
        })
    }

    /// Writes a PNG file: bright light is compressed, so that none is clipped, and encoded as sRGB.
    pub fn write(&self, folder: &Path, name: &str, exposure: f32) -> Result<(), Box<dyn Error>> {
        let encode = |x: f32| {
            let shown = 1.0 - (-x * exposure).exp();
            let encoded = if shown < 0.003_130_8 {
                12.92 * shown
            } else {
                1.055 * shown.powf(1.0 / 2.4) - 0.055
            };
            (255.0 * encoded + 0.5) as u8
        };
        let bytes = self.pixels.iter().flat_map(|p| p.to_array().map(encode));
        let (width, height) = (self.width as u32, self.height as u32);
        let image = image::RgbImage::from_raw(width, height, bytes.collect());
        std::fs::create_dir_all(folder)?;
        let path = folder.join(name);
        image.ok_or("a picture of another size")?.save(&path)?;
        println!("wrote {}", path.display());
        Ok(())
    }
}
