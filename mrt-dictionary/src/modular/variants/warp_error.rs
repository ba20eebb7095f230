//! What a block's warp costs, for a designer to see before choosing between reuse, re-gather and rebuild.
//!
//! [`warp_error`] measures: it lights the warped block with a few lights and compares the first bounce of reuse and
//! re-gather with F of the warped walls, on a scattered part of the texels. It assumes nothing about the warp,
//! so it holds for any. [`strain`] is a number from the corners alone, for a first guess while
//! a corner is dragged.

use crate::modular::light_prior::warped::{warped_direct_samples, warped_light_radius};
use crate::modular::one_bounce::warped::warped_bounce_rows;
use crate::modular::surface::walls::warped::WarpedWalls;
use glam::DVec3;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::linalg::matrix::{Matrix, dot, multiply, transpose_multiply};
use mrt_core::linalg::svd::symmetric_eigen;

/// Canonical operators of a shape, as far as they concern the block itself.
#[derive(Clone, Copy, Debug)]
pub struct CanonicalOperators<'a> {
    /// `T_d->b`, modes x texels.
    pub coefficients_from_direct: &'a Matrix<f64>,
    /// `U_b`, texels x modes.
    pub indirect_basis: &'a Matrix<f64>,
    /// `L_imp`, texels x modes.
    pub implicit_lighting: &'a Matrix<f64>,
}

/// Expected errors of the first bounce in a warped block. Relative: 0.1 is 10 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpError {
    /// L2 by area with unchanged canonical operators.
    pub reused: f64,
    /// L2 by area with `U` gathered anew.
    pub regathered: f64,
    /// Mean irradiance with unchanged canonical operators, less the true mean, divided by the true mean.
    pub reused_level: f64,
    /// The same with `U` gathered anew.
    pub regathered_level: f64,
}

/// Number of lights whose errors an estimate is the median of. More lights change the median by less than matters.
pub const SAMPLE_LIGHTS: usize = 32;
/// Smallest distance of a sample light from a wall, in the unit cube. Nearer lights would measure the texel grid.
const LIGHT_MARGIN: f64 = 0.1;
/// Radius of the sample lights, as [`warped_light_radius`] takes it.
const LIGHT_RADIUS: f64 = 0.1;

/// Measures the errors, on every `stride`-th texel: 1 for all texels, and else best a number without a factor in common
/// with the resolution.
///
/// Medians over [`SAMPLE_LIGHTS`] lights inside the block. Cost: `1/stride` of [`warped_bounce_rows`] for all
/// texels: at 16² and a stride of 7 about 0.03 s on two cores.
pub fn warp_error(walls: &WarpedWalls, canonical: &CanonicalOperators, stride: usize) -> WarpError {
    let receivers: Vec<usize> = (0..walls.texel_count()).step_by(stride.max(1)).collect();
    let rows = warped_bounce_rows(walls, &receivers);
    // Texels x receivers, so that a receiver's factors are contiguous.
    let factors = Matrix::from_columns(walls.texel_count(), &rows);
    let radius = warped_light_radius(walls, LIGHT_RADIUS);
    let direct = warped_direct_samples(walls, &sample_lights(), radius);
    let truth = transpose_multiply(factors.view(), direct.view());
    let coefficients = multiply(canonical.coefficients_from_direct.view(), direct.view());
    let gathered = transpose_multiply(factors.view(), canonical.implicit_lighting.view());
    let regathered = multiply(gathered.view(), coefficients.view());
    let kept = canonical.indirect_basis.selected_rows(&receivers);
    let reused = multiply(kept.view(), coefficients.view());
    let areas: Vec<f64> = receivers.iter().map(|&texel| walls.areas[texel]).collect();
    let median_of = |found: &Matrix<f64>, error: Measure| {
        let each = (0..truth.columns()).map(|j| error(found.column(j), truth.column(j), &areas));
        median(each.collect())
    };
    WarpError {
        reused: median_of(&reused, rel_l2_by_area),
        regathered: median_of(&regathered, rel_l2_by_area),
        reused_level: median_of(&reused, level_error),
        regathered_level: median_of(&regathered, level_error),
    }
}

/// An error from the found values, the true values and the areas that weight them; all three have one length.
type Measure = fn(&[f64], &[f64], &[f64]) -> f64;

/// Scattered positions in the unit cube, the same every time: Kronecker's sequence with the roots of
/// x⁴ = x + 1, which fills a cube evenly whatever the count.
fn sample_lights() -> Vec<DVec3> {
    let step = 1.0 / 1.220_744_084_605_759_5;
    let along = DVec3::new(step, step * step, step * step * step);
    (0..SAMPLE_LIGHTS)
        .map(|k| {
            let unit = (along * (k + 1) as f64 + 0.5).fract();
            unit * (1.0 - 2.0 * LIGHT_MARGIN) + LIGHT_MARGIN
        })
        .collect()
}

/// Relative L2 error with squares weighted by area.
fn rel_l2_by_area(found: &[f64], truth: &[f64], areas: &[f64]) -> f64 {
    let (mut miss, mut size) = (0.0, 0.0);
    for ((f, t), area) in found.iter().zip(truth).zip(areas) {
        miss += (f - t) * (f - t) * area;
        size += t * t * area;
    }
    (miss / size).sqrt()
}

/// Relative error of the mean over the area.
fn level_error(found: &[f64], truth: &[f64], areas: &[f64]) -> f64 {
    dot(found, areas) / dot(truth, areas) - 1.0
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[half],
        _ => 0.5 * (values[half - 1] + values[half]),
    }
}

/// How far a warp is from a turned and evenly scaled cube: root mean square, over the eight corners and
/// the centre, of the logarithms of the stretches along the principal directions, less their mean (Hencky's
/// strain). 0 for cubes of any size; a box 1:1:a has `sqrt(2/3) ln a`.
pub fn strain(warp: &Hexahedron) -> f64 {
    let points = (0..8)
        .map(Hexahedron::unit_corner)
        .chain([DVec3::splat(0.5)]);
    let squares: Vec<f64> = points
        .map(|unit| {
            let jacobian = warp.jacobian(unit);
            let square = jacobian.transpose() * jacobian;
            let square = Matrix::from_fn(3, 3, |i, j| square.col(j)[i]);
            let (values, _) = symmetric_eigen(square.view());
            let logs = [0, 1, 2].map(|k| 0.5 * libm::log(values[k]));
            let mean = (logs[0] + logs[1] + logs[2]) / 3.0;
            logs.map(|log| (log - mean) * (log - mean)).iter().sum()
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// First guess at the relative L2 error of unchanged canonical operators, from the corners alone:
/// `tanh(strain / 2)`, which the warp adds to the operators' own error.
///
/// Fitted by eye to the closed blocks of `tests/tests/modular/warped/transport.rs`: within a quarter of the error
/// measured there for boxes of all proportions and for shears, and up to twice too high for towers that taper
/// or twist. The guess ignores openings. A block that is stretched so that they take more or less of
/// the light than in the cube errs by up to twice as much.
pub fn guessed_error(warp: &Hexahedron) -> f64 {
    libm::tanh(0.5 * strain(warp))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strain_ignores_place_size_and_heading() {
        let turn = glam::DQuat::from_rotation_y(0.7) * 3.0;
        let turned = |size: DVec3| Hexahedron {
            corners: std::array::from_fn(|k| {
                turn * (Hexahedron::unit_corner(k) * size) + DVec3::new(1.0, 2.0, 3.0)
            }),
        };
        // Roots of differences of logarithms that cancel.
        assert!(strain(&turned(DVec3::ONE)) < 1e-7);
        let expected = (2.0f64 / 3.0).sqrt() * 4f64.ln();
        let found = strain(&turned(DVec3::new(1.0, 4.0, 1.0)));
        assert!((found - expected).abs() < 1e-12, "{found}");
    }

    #[test]
    fn sample_lights_keep_their_distance() {
        for light in sample_lights() {
            assert!(light.cmpge(DVec3::splat(LIGHT_MARGIN)).all());
            assert!(light.cmple(DVec3::splat(1.0 - LIGHT_MARGIN)).all());
        }
    }
}
