//! Direct light in canonical cubes: the lights of the prior, and the samples of direct light from them (Loos et al. 2011,
//! section 4).

use crate::config::{Enrichment, PriorConfig};
use crate::modular::light_prior::basis::{self, LightPrior, WeightedTexels};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use mrt_runtime::blocks::Shape;

/// Centres of the sphere lights of a shape: `per_axis`³ in the cube, and as many in the cell beyond each opening, from
/// where they shine in.
pub fn prior_lights(shape: &Shape, per_axis: usize) -> Vec<DVec3> {
    let openings: Vec<Face> = shape.openings.iter().map(|o| o.face).collect();
    lattice_lights([per_axis; 3], &openings)
}

/// A lattice of points at (i + 1) / (n + 1), n of them along each axis, inside the unit cube and then in the cell beyond
/// each of the openings. x runs fastest.
pub(crate) fn lattice_lights(counts: [usize; 3], openings: &[Face]) -> Vec<DVec3> {
    let place = |k: usize, axis: usize| (k + 1) as f64 * (1.0 / (counts[axis] + 1) as f64);
    let lattice: Vec<DVec3> = (0..counts[0] * counts[1] * counts[2])
        .map(|k| {
            let (x, rest) = (k % counts[0], k / counts[0]);
            let (y, z) = (rest % counts[1], rest / counts[1]);
            DVec3::new(place(x, 0), place(y, 1), place(z, 2))
        })
        .collect();
    std::iter::once(DVec3::ZERO)
        .chain(openings.iter().map(|face| face.outward()))
        .flat_map(|cell| lattice.iter().map(move |&p| p + cell))
        .collect()
}

/// The samples `L_d`: direct irradiance, texels x lights, from lights of unit intensity.
///
/// Every texel sees every light in the cube, which is convex. It sees a light in the cell beyond an opening through
/// that opening only. Texels in holes stay dark.
pub fn direct_samples(shape: &Shape, resolution: usize, config: &PriorConfig) -> Matrix<f64> {
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    let lights = prior_lights(shape, config.lights_per_axis);
    Matrix::from_fn(texels.len(), lights.len(), |texel, light| {
        let (face, point) = texels[texel];
        if shape.is_in_hole(face, point) || !is_seen(shape, point, lights[light]) {
            return 0.0;
        }
        sphere_light_irradiance(lights[light] - point, -face.outward(), config.light_radius)
    })
}

/// True if no wall is between a texel and a light in the shape or in the cell beyond an opening.
fn is_seen(shape: &Shape, point: DVec3, light: DVec3) -> bool {
    let outside = |face: Face| {
        let along = light[face.axis()];
        if face.is_positive() {
            along > 1.0
        } else {
            along < 0.0
        }
    };
    let Some(face) = Face::ALL.into_iter().find(|&face| outside(face)) else {
        return true;
    };
    let plane = if face.is_positive() { 1.0 } else { 0.0 };
    let t = (plane - point[face.axis()]) / (light[face.axis()] - point[face.axis()]);
    let crossing = point + (light - point) * t;
    shape.is_open(face) || shape.is_in_hole(face, crossing)
}

/// Appendix A for a shape ([`basis::enriched_prior`]), whose texels all have one size.
pub fn enriched_prior(
    prior: &LightPrior,
    indirect_basis: &Matrix<f64>,
    shape: &Shape,
    classes: &ParityClasses,
    config: &Enrichment,
) -> LightPrior {
    let texels = WeightedTexels {
        classes,
        roots: &vec![1.0; classes.point_count()],
        wall_count: shape.wall_count(),
    };
    basis::enriched_prior(prior, indirect_basis, &texels, config)
}
