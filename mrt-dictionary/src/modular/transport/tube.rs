//! The modes of one tube, chosen for the light on its own wall and on that of the tubes beyond its openings, as
//! [`crate::modular::transport::cube`] does for cubes. Everything counts by area ([`AreaWeights`]).

use crate::config::BakeConfig;
use crate::modular::light_prior::cube::{ScaledBasis, enriched_weighted_prior, light_prior};
use crate::modular::light_prior::tube::{AreaWeights, tube_direct_samples};
use crate::modular::one_bounce::tube::{
    Parts, TubeTexel, tube_bounce, tube_parity_classes, tube_texels,
};
use crate::modular::paths::response::stack;
use crate::modular::transport::modes::{
    BlockTransport, block_transport, fold_bounce, multiply_sparse,
};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Texels along a chart of the tube beyond, at most: it only says which modes matter there.
const BEYOND_RESOLUTION: usize = 12;

/// Everything about one tube alone, in terms of plain texel values.
///
/// # Errors
/// [`Cancelled`].
pub fn tube_transport(
    form: TubeForm,
    config: &BakeConfig,
    progress: &Progress,
) -> Result<BlockTransport, Cancelled> {
    let resolution = config.resolution;
    let classes = tube_parity_classes(form, resolution);
    let weights = AreaWeights::new(form, resolution);
    let bounce = tube_bounce(form, resolution, Parts::STANDARD, progress)?;
    let folded = fold_bounce(&weights.weigh_operator(&bounce), &classes);
    progress.check()?;
    let beyond = beyond_opening(form, resolution, config.coupling.beyond_weight, &weights);
    let outputs: Vec<Matrix<f64>> = (0..classes.class_count())
        .into_par_iter()
        .map(|class| stack(&folded[class], &of_class(&beyond, &classes, class)))
        .collect();
    let prior = &config.prior;
    let samples = tube_direct_samples(form, resolution, prior.lights_per_axis, prior.light_radius);
    let prior = light_prior(&weights.weigh(&samples), &classes, config.prior.k_d);
    progress.check()?;
    let transport =
        |basis: &ScaledBasis| block_transport(&outputs, &folded, basis, &classes, config.modes);
    let plain = transport(&prior.basis);
    let weighted = match &config.enrichment {
        None => plain,
        Some(enrichment) => {
            let enriched = enriched_weighted_prior(
                &prior,
                &plain.indirect_basis,
                form.charts().len(),
                &weights.roots,
                &classes,
                enrichment,
            );
            transport(&enriched.basis)
        }
    };
    Ok(weights.unweigh_transport(weighted))
}

/// Light on the wall of a straight tube behind the first opening, rows x texels, weighted by area on both sides.
///
/// The other opening is its mirror image, and in the coordinates of a parity class their products are the same: so
/// the rows of one stand for both, with twice the weight.
fn beyond_opening(
    form: TubeForm,
    resolution: usize,
    weight: f64,
    weights: &AreaWeights,
) -> Matrix<f64> {
    let opening = form.openings()[0];
    let sources = tube_texels(form, resolution);
    let mean = form.wall_area() / sources.len() as f64;
    let receivers = tube_texels(TubeForm::Straight, resolution.min(BEYOND_RESOLUTION));
    let rows: Vec<Vec<f64>> = receivers
        .par_iter()
        .map(|receiver| {
            let (point, normal) = beyond(opening, receiver);
            let scale = weight * (2.0 * receiver.area / mean).sqrt();
            sources
                .iter()
                .zip(&weights.roots)
                .map(|(source, root)| scale * kernel(form, opening, point, normal, source) / root)
                .collect()
        })
        .collect();
    Matrix::from_fn(rows.len(), sources.len(), |i, j| rows[i][j])
}

/// Position and normal of a straight tube's texel, the tube attached at a side opening.
fn beyond(opening: Face, texel: &TubeTexel) -> (DVec3, DVec3) {
    let turn = |v: DVec3| match opening.axis() {
        0 => v,
        _ => DVec3::new(v.z, v.y, v.x),
    };
    let step = opening.outward();
    (
        turn(texel.center.position) + step,
        turn(texel.center.normal),
    )
}

/// Irradiance at a point beyond the opening from unit radiosity of a texel, taken at its centre.
fn kernel(form: TubeForm, opening: Face, point: DVec3, normal: DVec3, source: &TubeTexel) -> f64 {
    let from = source.center.position;
    let offset = from - point;
    let (here, there) = (normal.dot(offset), -source.center.normal.dot(offset));
    if here <= 0.0 || there <= 0.0 {
        return 0.0;
    }
    let (axis, middle) = (opening.axis(), opening.point(0.5, 0.5));
    let crossing = point + offset * ((middle[axis] - point[axis]) / offset[axis]);
    if crossing.distance(middle) > TUBE_RADIUS || !form.segment_is_free(from, crossing) {
        return 0.0;
    }
    let squared = offset.length_squared();
    here * there / (squared * squared) * source.area / PI
}

/// An operator on texels, in the coordinates of a class of its columns.
fn of_class(operator: &Matrix<f64>, classes: &ParityClasses, class: usize) -> Matrix<f64> {
    let columns: Vec<Vec<f64>> = (0..classes.dimension(class))
        .map(|k| {
            let mut unit = vec![0.0; classes.dimension(class)];
            unit[k] = 1.0;
            multiply_sparse(operator, &classes.unfold(class, &unit))
        })
        .collect();
    Matrix::from_columns(operator.rows(), &columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_beyond_falls_off_as_between_rings() {
        let resolution = 12;
        let weights = AreaWeights::new(TubeForm::Straight, resolution);
        let operator = beyond_opening(TubeForm::Straight, resolution, 1.0, &weights);
        let uniform = Matrix::from_fn(operator.columns(), 1, |_, _| 1.0);
        let light = mrt_core::linalg::matrix::multiply(operator.view(), uniform.view());
        // Form factor from a point of the wall to all rings up to a distance x on one side, by the known density of
        // a ring's, with s = x / 2R.
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
        for (receiver, found) in tube_texels(TubeForm::Straight, resolution)
            .iter()
            .zip(light.data())
        {
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
}
