//! The light prior of a warped block: the canonical lights taken along by the warp (Loos et al. 2011, section 8:
//! "a prior that uses the aspect ratio of the scene's bounding box").

use crate::modular::light_prior::cube::lattice_lights;
use crate::modular::surface::walls::warped::WarpedWalls;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::linalg::matrix::Matrix;

/// How much further apart lights may stand along the longest edge than along the second longest before more of them are
/// placed there. With the same number along all edges a box 1:1:20 errs by 38 % instead of 10; denser lights gain
/// nothing.
const LIGHT_SPACING: f64 = 2.0;

/// Centres of the prior's lights in the unit cube's coordinates: the lattice of
/// [`crate::modular::light_prior::cube::prior_lights`], in the cube and in the cell beyond each opening. `per_axis` lights
/// stand along an edge, and up to the walls' `resolution` along the longest edge of a stretched block.
pub fn warped_prior_lights(walls: &WarpedWalls, openings: &[Face], per_axis: usize) -> Vec<DVec3> {
    let jacobian = walls.warp.jacobian(DVec3::splat(0.5));
    let lengths = [0, 1, 2].map(|axis| jacobian.col(axis).length());
    let counts = [0, 1, 2].map(|axis| {
        let second = lengths[(axis + 1) % 3].max(lengths[(axis + 2) % 3]);
        let wanted = (per_axis as f64 * lengths[axis] / (second * LIGHT_SPACING)).round();
        (wanted as usize).min(walls.resolution).max(per_axis)
    });
    lattice_lights(counts, openings)
}

/// Radius of the prior's lights on a warped block, world units: `radius` times the smallest distance between
/// opposite faces, at the block's centre. Halving or doubling it moves errors by less than 1 %.
pub fn warped_light_radius(walls: &WarpedWalls, radius: f64) -> f64 {
    let gradients = walls.warp.jacobian(DVec3::splat(0.5)).inverse().transpose();
    // Across a distance d a unit coordinate grows by one, so its gradient is 1 / d.
    let steepest = (0..3)
        .map(|axis| gradients.col(axis).length())
        .fold(0.0, f64::max);
    radius / steepest
}

/// Direct irradiance `L_d` on warped walls, texels x lights, from sphere lights of unit intensity.
///
/// `lights` are in the unit cube's coordinates and go through the warp, those beyond openings too; `radius` is
/// in world units. Every texel sees every light above its horizon: where an opening is smaller than its face, the
/// caller masks what the rest of the face hides.
pub fn warped_direct_samples(walls: &WarpedWalls, lights: &[DVec3], radius: f64) -> Matrix<f64> {
    let lights: Vec<DVec3> = lights.iter().map(|&p| walls.warp.point(p)).collect();
    Matrix::from_fn(walls.texel_count(), lights.len(), |texel, light| {
        let offset = lights[light] - walls.centers[texel];
        sphere_light_irradiance(offset, walls.normals[texel], radius)
    })
}
