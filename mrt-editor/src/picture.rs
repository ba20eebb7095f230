//! Pictures: a pinhole camera, one colour for every ray, tone mapping, files.

pub mod camera;
pub mod file;
pub mod lit;
pub mod placement;
pub mod tone;

use camera::Camera;
use glam::Vec3;
use rayon::prelude::*;

/// Linear RGB pixels, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Colours.
    pub pixels: Vec<Vec3>,
}

impl Picture {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: vec![Vec3::ZERO; width * height],
        }
    }
}

/// Renders `N` pictures of one view: `colours` gives all of them for a ray, and each pixel is the mean
/// over `samples`² rays.
///
/// Cost: one call of `colours` a ray, spread over the threads; the result does not depend on their
/// number.
pub fn render<const N: usize>(
    camera: &Camera,
    [width, height]: [usize; 2],
    samples: usize,
    colours: impl Fn(Vec3, Vec3) -> [Vec3; N] + Sync,
) -> [Picture; N] {
    let pixels: Vec<[Vec3; N]> = (0..width * height)
        .into_par_iter()
        .with_min_len(256)
        .map(|pixel| {
            let (column, row) = (pixel % width, pixel / width);
            let mut sum = [Vec3::ZERO; N];
            for k in 0..samples * samples {
                let along =
                    |position: usize, k: usize| position as f32 + (k as f32 + 0.5) / samples as f32;
                let x = along(column, k % samples) / width as f32;
                let y = along(row, k / samples) / height as f32;
                let direction = camera.direction(x, y);
                for (sum, colour) in sum.iter_mut().zip(colours(camera.position, direction)) {
                    *sum += colour;
                }
            }
            sum.map(|sum| sum / (samples * samples) as f32)
        })
        .collect();
    std::array::from_fn(|k| Picture {
        width,
        height,
        pixels: pixels.iter().map(|colours| colours[k]).collect(),
    })
}
