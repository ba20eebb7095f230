//! Direct light with exact visibility: a walk from texel to light, block by block.

use super::quarters::Quarters;
use super::scene::{ExactScene, Side, winding};
use glam::DVec3;
use rayon::prelude::*;

/// An isotropic diffuse sphere, or a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// World position of the centre; a light outside all blocks lights nothing.
    pub position: DVec3,
    /// Radiant intensity, W/sr.
    pub intensity: f64,
    /// Metres; 0 for a point. Irradiance grows no further within this distance.
    pub radius: f64,
}

impl PointLight {
    /// A point light of intensity 1 W/sr.
    pub fn unit(position: DVec3) -> Self {
        Self {
            position,
            intensity: 1.0,
            radius: 0.0,
        }
    }
}

/// Direct irradiance at every texel centre, W/m²: I cos θ / max(d², r²) where the centre of the light
/// is visible.
pub fn direct(scene: &ExactScene, light: &PointLight) -> Vec<f64> {
    direct_on_grid(scene, light, 1, 1, |_| true)
}

/// Direct irradiance as the area mean over `samples`² points of every texel, W/m².
pub fn direct_mean(scene: &ExactScene, light: &PointLight, samples: usize) -> Vec<f64> {
    direct_on_grid(scene, light, 1, samples, |_| true)
}

/// Direct irradiance as the area means over `samples`² points of every quarter of a texel, W/m².
///
/// This is the source of indirect light: a texel sends out its mean, not the value at its centre, and
/// direct light varies most within a texel where it is strongest. Cost: one walk per point, about 0.1
/// microseconds.
pub fn direct_quarters(scene: &ExactScene, light: &PointLight, samples: usize) -> Vec<Quarters> {
    direct_quarters_in(scene, light, samples, |_| true)
}

/// [`direct_quarters`] in the blocks for which `is_wanted` is true, and zero elsewhere.
pub fn direct_quarters_in(
    scene: &ExactScene,
    light: &PointLight,
    samples: usize,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<Quarters> {
    let resolution = scene.resolution;
    let fine = direct_on_grid(scene, light, 2, samples, is_wanted);
    let quarters = |texel: usize| {
        let (row, column) = (texel / resolution, texel % resolution);
        let corner = 4 * row * resolution + 2 * column;
        [0, 1, 2 * resolution, 2 * resolution + 1].map(|offset| fine[corner + offset])
    };
    (0..scene.texel_count()).map(quarters).collect()
}

/// Means over `samples`² points of every cell of a grid that is `refinement` times finer than the
/// texels, in the blocks for which `is_wanted` is true, and zero elsewhere.
fn direct_on_grid(
    scene: &ExactScene,
    light: &PointLight,
    refinement: usize,
    samples: usize,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<f64> {
    let samples = samples.max(1);
    let resolution = scene.resolution * refinement;
    let step = 1.0 / (resolution * samples) as f64;
    let cell_mean = |cell: usize| {
        let wall = scene.walls[cell / (resolution * resolution)];
        if !is_wanted(wall.block) {
            return 0.0;
        }
        let block = &scene.blocks[wall.block];
        let (row, column) = (cell / resolution % resolution, cell % resolution);
        let (mut sum, mut area) = (0.0, 0.0);
        for j in row * samples..(row + 1) * samples {
            for i in column * samples..(column + 1) * samples {
                let unit = wall
                    .face
                    .point((i as f64 + 0.5) * step, (j as f64 + 0.5) * step);
                let jacobian = block.jacobian(unit);
                let (along_u, along_v) = (wall.face.u_axis(), wall.face.v_axis());
                let normal = jacobian.col(along_u).cross(jacobian.col(along_v));
                let weight = normal.length();
                let inward = normal * (winding(wall.face) / weight);
                sum += weight * direct_at(scene, wall.block, block.point(unit), inward, light);
                area += weight;
            }
        }
        sum / area
    };
    (0..scene.walls.len() * resolution * resolution)
        .into_par_iter()
        .map(cell_mean)
        .collect()
}

/// Direct irradiance at a point in or on `block`, W/m².
fn direct_at(
    scene: &ExactScene,
    block: usize,
    point: DVec3,
    normal: DVec3,
    light: &PointLight,
) -> f64 {
    let to_light = light.position - point;
    let squared = to_light.length_squared();
    let cosine = normal.dot(to_light) / squared.sqrt();
    // The cosine is NaN for a point light at the point itself; that gives no light either.
    if cosine.is_nan() || cosine <= 0.0 || !is_visible(scene, block, point, to_light) {
        return 0.0;
    }
    light.intensity * cosine / squared.max(light.radius * light.radius)
}

/// True if the segment from `point`, in or on `block`, to `point + to_light` meets only openings.
fn is_visible(scene: &ExactScene, mut block: usize, point: DVec3, to_light: DVec3) -> bool {
    // A segment through an edge meets several faces at once. Within this tolerance the opening wins.
    const TIE: f64 = 1e-12;
    // A segment crosses each block at most once.
    for _ in 0..scene.blocks.len() {
        let mut exit = (1.0, None);
        for (side, facets) in scene.sides[block].iter().zip(&scene.facets[block]) {
            for facet in facets {
                let speed = facet.plane.normal.dot(to_light);
                if speed >= 0.0 {
                    continue;
                }
                let t = -facet.plane.side(point) / speed;
                let tied = (t - exit.0).abs() <= TIE && matches!(side, Side::Opening(..));
                if t < exit.0 - TIE || (tied && exit.1.is_some()) {
                    exit = (t, Some(side));
                }
            }
        }
        match exit.1 {
            None => return true,
            Some(Side::Opening(next, _)) => block = *next,
            Some(Side::Wall | Side::Sky) => return false,
        }
    }
    false
}
