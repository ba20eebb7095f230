//! Pictures: a pinhole camera, one colour for every ray, tone mapping, files.

pub mod camera;
pub mod ktx2;
pub mod file;
pub mod lamp;
pub mod level_view;
pub mod lit;
pub mod picture;
pub mod placement;
pub mod tone;

use camera::Camera;
use glam::Vec3;
use picture::Picture;
use rayon::prelude::*;

/// Pixels that differ from a neighbour by more than this share are rendered again with more rays.
const EDGE_CONTRAST: f32 = 0.04;

/// Renders `N` pictures of one view. `colours` gives the colours of all pictures along a ray, from its origin and unit
/// direction. Every pixel gets one ray, and pixels at edges the mean over `samples`² rays.
///
/// Cost: one call of `colours` a ray, spread over the threads; the result does not depend on their number.
pub fn render<const N: usize>(
    camera: &Camera,
    [width, height]: [usize; 2],
    samples: usize,
    colours: impl Fn(Vec3, Vec3) -> [Vec3; N] + Sync,
) -> [Picture; N] {
    let mean = |pixel: usize, samples: usize| {
        let (column, row) = (pixel % width, pixel / width);
        let mut sum = [Vec3::ZERO; N];
        for k in 0..samples * samples {
            let along =
                |position: usize, k: usize| position as f32 + (k as f32 + 0.5) / samples as f32;
            let x = along(column, k % samples) / width as f32;
            let y = along(row, k / samples) / height as f32;
            for (sum, colour) in sum
                .iter_mut()
                .zip(colours(camera.position, camera.direction(x, y)))
            {
                *sum += colour;
            }
        }
        sum.map(|sum| sum / (samples * samples) as f32)
    };
    let all = |shade: &(dyn Fn(usize) -> [Vec3; N] + Sync)| {
        let pixels = (0..width * height).into_par_iter().with_min_len(256);
        pixels.map(shade).collect::<Vec<_>>()
    };
    let first = all(&|pixel| mean(pixel, 1));
    let pixels = if samples < 2 {
        first
    } else {
        all(&|pixel| {
            if is_edge(&first, width, pixel) {
                mean(pixel, samples)
            } else {
                first[pixel]
            }
        })
    };
    std::array::from_fn(|k| Picture {
        width,
        height,
        pixels: pixels.iter().map(|colours| colours[k]).collect(),
    })
}

/// True where any picture changes from this pixel to one beside, above or below it.
fn is_edge<const N: usize>(pixels: &[[Vec3; N]], width: usize, pixel: usize) -> bool {
    let (column, here) = (pixel % width, &pixels[pixel]);
    let differs = |other: usize| {
        here.iter().zip(&pixels[other]).any(|(a, b)| {
            let change = (a - b).abs().max_element();
            change > EDGE_CONTRAST * a.abs().max(b.abs()).max_element()
        })
    };
    (column > 0 && differs(pixel - 1))
        || (column + 1 < width && differs(pixel + 1))
        || (pixel >= width && differs(pixel - width))
        || (pixel + width < pixels.len() && differs(pixel + width))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_edges_are_smoothed() {
        let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, 1.0, 1.0).expect("looks");
        let half = |_: Vec3, direction: Vec3| {
            let is_lit = direction.x + 0.3 * direction.y > 0.01;
            [if is_lit { Vec3::ONE } else { Vec3::ZERO }]
        };
        let [picture] = render(&camera, [32, 32], 4, half);
        let is_between = |colour: &&Vec3| colour.x > 0.0 && colour.x < 1.0;
        let between = picture.pixels.iter().filter(is_between).count();
        assert!((20..100).contains(&between), "{between}");
        assert_eq!(picture.pixels[0], Vec3::ZERO);
        assert_eq!(picture.pixels[31], Vec3::ONE);
    }
}
