//! The modes of one tube, chosen for the light on its own wall and on the walls of the tubes beyond its openings, as
//! [`crate::modular::transport::cube`] does for cubes. Everything counts by area ([`AreaWeights`]).

use crate::config::BakeConfig;
use crate::matrix_parts::stack;
use crate::modular::light_prior::basis::{ScaledBasis, WeightedTexels, enriched_prior};
use crate::modular::light_prior::tube::tube_light_prior;
use crate::modular::one_bounce::tube::{Parts, tube_bounce};
use crate::modular::surface::area_weights::AreaWeights;
use crate::modular::surface::mirrors::tube::tube_parity_classes;
use crate::modular::surface::walls::tube::{TubeTexel, TubeWall};
use crate::modular::transport::modes::{
    BlockTransport, applied_to_class, block_transport, fold_bounce,
};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Texels along a chart of the tube beyond an opening, at most. That tube only decides which modes matter.
const BEYOND_RESOLUTION: usize = 12;

/// The reduced transport of one tube, in terms of plain texel values.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn tube_transport(
    wall: &TubeWall,
    config: &BakeConfig,
    progress: &Progress,
) -> Result<BlockTransport, Cancelled> {
    let classes = tube_parity_classes(wall);
    let weights = AreaWeights::of_tube(wall);
    let bounce = tube_bounce(wall, Parts::STANDARD, progress)?;
    let folded = fold_bounce(&weights.weigh_operator(&bounce), &classes);
    progress.check()?;
    let beyond = beyond_opening(wall, &weights, config.coupling.beyond_weight);
    let outputs: Vec<Matrix<f64>> = (0..classes.class_count())
        .into_par_iter()
        .map(|class| {
            let beyond = applied_to_class(&beyond, &classes, class, 1.0);
            stack(&[&folded[class], &beyond])
        })
        .collect();
    let prior = tube_light_prior(wall, &weights, &classes, &config.prior);
    progress.check()?;
    let transport =
        |basis: &ScaledBasis| block_transport(&outputs, &folded, basis, &classes, config.modes);
    let plain = transport(&prior.basis);
    let weighted = match &config.enrichment {
        None => plain,
        Some(enrichment) => {
            let texels = WeightedTexels {
                classes: &classes,
                roots: &weights.roots,
                wall_count: wall.form.charts().len(),
            };
            let enriched = enriched_prior(&prior, &plain.indirect_basis, &texels, enrichment);
            transport(&enriched.basis)
        }
    };
    Ok(unweighed(&weights, weighted))
}

/// The operators in terms of plain texel values, from operators between signals weighted by area.
fn unweighed(weights: &AreaWeights, weighted: BlockTransport) -> BlockTransport {
    let coefficients = &weighted.coefficients_from_direct;
    BlockTransport {
        indirect_basis: weights.unweigh(&weighted.indirect_basis),
        coefficients_from_direct: coefficients.scaled_columns(&weights.roots),
        implicit_lighting: weights.unweigh(&weighted.implicit_lighting),
        singular_values: weighted.singular_values,
        dropped_energy: weighted.dropped_energy,
    }
}

/// Light on the wall of a straight tube behind the first opening, rows x texels, weighted by area on both sides.
///
/// The other opening is the mirror image of the first, and in the coordinates of a parity class both have the same
/// scalar products. So the rows of one stand for both, with twice the weight.
fn beyond_opening(wall: &TubeWall, weights: &AreaWeights, weight: f64) -> Matrix<f64> {
    let opening = wall.form.openings()[0];
    let mean = wall.form.wall_area() / wall.texels.len() as f64;
    let resolution = wall.resolution.min(BEYOND_RESOLUTION);
    let receivers = TubeWall::new(TubeForm::Straight, resolution).texels;
    let rows: Vec<Vec<f64>> = receivers
        .par_iter()
        .map(|receiver| {
            let beyond = beyond(opening, receiver);
            let scale = weight * (2.0 * receiver.area / mean).sqrt();
            let sources = wall.texels.iter().zip(&weights.roots);
            let factors =
                sources.map(|(source, root)| scale * kernel(wall.form, &beyond, source) / root);
            factors.collect()
        })
        .collect();
    Matrix::from_fn(rows.len(), wall.texels.len(), |i, j| rows[i][j])
}

/// A point on the wall of a tube beyond an opening.
struct PointBeyond {
    opening: Face,
    position: DVec3,
    normal: DVec3,
}

/// The centre of a straight tube's texel, with the tube attached at a side opening.
fn beyond(opening: Face, texel: &TubeTexel) -> PointBeyond {
    let turn = |v: DVec3| match opening.axis() {
        0 => v,
        _ => DVec3::new(v.z, v.y, v.x),
    };
    PointBeyond {
        opening,
        position: turn(texel.center.position) + opening.outward(),
        normal: turn(texel.center.normal),
    }
}

/// Irradiance at a point beyond the opening from unit radiosity of a texel, taken at its centre.
fn kernel(form: TubeForm, at: &PointBeyond, source: &TubeTexel) -> f64 {
    let from = source.center.position;
    let offset = from - at.position;
    let (here, there) = (at.normal.dot(offset), -source.center.normal.dot(offset));
    if here <= 0.0 || there <= 0.0 {
        return 0.0;
    }
    let (axis, middle) = (at.opening.axis(), at.opening.point(0.5, 0.5));
    let crossing = at.position + offset * ((middle[axis] - at.position[axis]) / offset[axis]);
    if crossing.distance(middle) > TUBE_RADIUS || !form.segment_is_free(from, crossing) {
        return 0.0;
    }
    let squared = offset.length_squared();
    here * there / (squared * squared) * source.area / PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PriorConfig;
    use crate::matrix_parts::difference;
    use crate::modular::light_prior::tube::{tube_irradiance, tube_prior_lights};
    use mrt_core::linalg::matrix::{multiply, transpose_multiply};

    #[test]
    fn light_beyond_falls_off_as_between_rings() {
        let wall = TubeWall::new(TubeForm::Straight, 12);
        let weights = AreaWeights::of_tube(&wall);
        let operator = beyond_opening(&wall, &weights, 1.0);
        let uniform = Matrix::from_fn(operator.columns(), 1, |_, _| 1.0);
        let light = multiply(operator.view(), uniform.view());
        // Form factor from a point of the wall to all rings up to a distance x on one side, by the known density of
        // a ring's form factor, with s = x / 2R.
        let cumulated = |x: f64| {
            let steps = 2000;
            let density = |x: f64| {
                let s = x / (2.0 * TUBE_RADIUS);
                let q = (s * s + 1.0) * (s * s + 1.0).sqrt();
                (1.0 - s * (2.0 * s * s + 3.0) / (2.0 * q)) / (2.0 * TUBE_RADIUS)
            };
            let step = x / f64::from(steps);
            (0..steps)
                .map(|k| density((f64::from(k) + 0.5) * step) * step)
                .sum::<f64>()
        };
        for (receiver, found) in wall.texels.iter().zip(light.data()) {
            // The receiver's tube lies at x < 0, its texels mirrored.
            let x = 1.0 - receiver.center.position.x;
            let exact = cumulated(x + 1.0) - cumulated(x);
            // One point a texel of width 1/12 at a distance of 1/24 and more; the scale of rows is the
            // root of 2.
            assert!(
                (found / 2f64.sqrt() - exact).abs() < 0.01,
                "{x}: {found} {exact}"
            );
        }
    }

    /// All modes hold F on the prior's light exactly, and few of them nearly.
    #[test]
    fn reduced_transport_projects_by_area() {
        let wall = TubeWall::new(TubeForm::Bend, 8);
        let classes = tube_parity_classes(&wall);
        let weights = AreaWeights::of_tube(&wall);
        let bounce =
            tube_bounce(&wall, Parts::STANDARD, &Progress::silent()).expect("nobody cancels");
        let config = PriorConfig {
            lights_per_axis: 4,
            ..PriorConfig::default()
        };
        let prior = tube_light_prior(&wall, &weights, &classes, &config);
        let folded = fold_bounce(&weights.weigh_operator(&bounce), &classes);
        let transport = |modes| {
            let weighted = block_transport(&folded, &folded, &prior.basis, &classes, modes);
            unweighed(&weights, weighted)
        };
        let lights = tube_prior_lights(wall.form, config.lights_per_axis);
        let all = Matrix::from_fn(wall.texels.len(), lights.len(), |i, j| {
            tube_irradiance(wall.form, &wall.texels[i], &lights[j], config.light_radius)
        });
        let exact = multiply(bounce.view(), all.view());
        let norm = |m: &Matrix<f64>| weights.weigh(m).frobenius_norm();
        let error = |transport: &BlockTransport| {
            let b = multiply(transport.coefficients_from_direct.view(), all.view());
            let found = multiply(transport.indirect_basis.view(), b.view());
            norm(&difference(&found, &exact)) / norm(&exact)
        };
        assert!(error(&transport(usize::MAX)) < 1e-9);
        let reduced = transport(32);
        assert!(error(&reduced) < 0.02, "{}", error(&reduced));
        // U_b = F L_imp, and its columns are orthogonal by area.
        let made = multiply(bounce.view(), reduced.implicit_lighting.view());
        let weighted = weights.weigh(&reduced.indirect_basis);
        let gram = transpose_multiply(weighted.view(), weighted.view());
        for j in 0..gram.columns() {
            for i in 0..gram.rows() {
                let s = reduced.singular_values[j];
                let expected = if i == j { s * s } else { 0.0 };
                let scale = s * reduced.singular_values[i];
                assert!((gram[(i, j)] - expected).abs() < 1e-9 * scale);
            }
        }
        for (a, b) in made.data().iter().zip(reduced.indirect_basis.data()) {
            assert!((a - b).abs() < 1e-9 * reduced.singular_values[0]);
        }
    }
}
