//! The demo's pictures: direct light, indirect light and both, from above and from inside.

use crate::render::camera::Camera;
use crate::render::file::{Saves, WriteError, make_folder, write_png};
use crate::render::level_view::{LevelView, ViewError};
use crate::render::picture::Picture;
use crate::render::render;
use crate::render::tone::{auto_exposure, tone_map};
use glam::{DVec3, Vec3};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_runtime::low_level::level::placed::PlacedLevel;
use mrt_runtime::{Frame, Light};
use std::path::Path;

/// sRGB outside the level.
const BACKGROUND: [u8; 3] = [58, 62, 70];

/// Pixels across and down.
const SIZE: [usize; 2] = [960, 640];

/// Rays along each axis of a pixel at edges.
const SAMPLES: usize = 2;

/// Why there are no pictures.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Nothing can be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A picture cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Where a set of pictures is taken from.
struct Viewpoint {
    name: &'static str,
    from: Vec3,
    to: Vec3,
    /// Vertical.
    view_angle_rad: f32,
    with_ceilings: bool,
}

/// Writes all pictures of a solved frame into a folder; returns their paths.
pub(super) fn take_pictures(
    folder: &Path,
    frame: &Frame,
    lights: &[Light],
) -> Result<Vec<String>, PictureError> {
    make_folder(folder)?;
    let mut written = Vec::new();
    for viewpoint in viewpoints(&frame.scene().level) {
        let shown = LevelView::new(frame, lights, viewpoint.with_ceilings)?;
        let [width, height] = SIZE.map(|k| k as f32);
        let angle = viewpoint.view_angle_rad;
        let camera = Camera::look_at(viewpoint.from, viewpoint.to, angle, width / height);
        let Some(camera) = camera else {
            continue;
        };
        let [direct, indirect, both, coverage] = photograph(&camera, &shown);
        // One exposure for the three, so that they can be compared.
        let exposure = auto_exposure(&[&both]);
        for (picture, part) in [(direct, "direct"), (indirect, "indirect"), (both, "both")] {
            let path = folder.join(format!("{}-{part}.png", viewpoint.name));
            let mut srgb = tone_map(&picture, exposure);
            over_background(&mut srgb, &coverage);
            write_png(&path, SIZE, &srgb, Saves::Time)?;
            written.push(path.display().to_string());
        }
    }
    Ok(written)
}

/// From above with the ceilings off, and from inside the first block.
fn viewpoints(level: &PlacedLevel) -> [Viewpoint; 2] {
    let blocks = level.blocks.iter();
    let (min, max) = blocks
        .map(|block| block.warp.bounds())
        .fold((DVec3::MAX, DVec3::MIN), |(low, high), (a, b)| {
            (low.min(a), high.max(b))
        });
    let (min, max) = (min.as_vec3(), max.as_vec3());
    let (middle, extent) = (0.5 * (min + max), (max - min).max_element());
    let first = &level.blocks[0].warp;
    let in_first = |x, y, z| first.point(DVec3::new(x, y, z)).as_vec3();
    [
        Viewpoint {
            name: "above",
            from: middle + Vec3::new(0.0, 1.0 * extent, 0.6 * extent),
            to: middle - Vec3::Y * 0.1 * block_size(first),
            view_angle_rad: 0.75,
            with_ceilings: false,
        },
        Viewpoint {
            name: "inside",
            from: in_first(0.06, 0.5, 0.5),
            to: in_first(3.0, 0.42, 0.5),
            view_angle_rad: 1.25,
            with_ceilings: true,
        },
    ]
}

/// Edge of the cube with the block's diagonal, metres.
pub(super) fn block_size(warp: &Hexahedron) -> f32 {
    (warp.diagonal() / 3f64.sqrt()) as f32
}

/// Direct light, indirect light, both, and 1 where the level is.
fn photograph(camera: &Camera, shown: &LevelView<'_>) -> [Picture; 4] {
    render(camera, SIZE, SAMPLES, |origin, direction| {
        match shown.radiance(origin, direction) {
            Some((direct, indirect)) => [direct, indirect, direct + indirect, Vec3::ONE],
            None => [Vec3::ZERO; 4],
        }
    })
}

/// Shows the outside of the level as a plain grey, which no exposure changes.
fn over_background(srgb: &mut [u8], coverage: &Picture) {
    for (pixel, coverage) in srgb.as_chunks_mut::<3>().0.iter_mut().zip(&coverage.pixels) {
        for (value, background) in pixel.iter_mut().zip(BACKGROUND) {
            *value = value.saturating_add((f32::from(background) * (1.0 - coverage.x)) as u8);
        }
    }
}
