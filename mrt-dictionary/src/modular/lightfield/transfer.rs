//! Lightfields from what emits them and from lightfields further back, by tracing each sample's rays backwards.
//!
//! Lightfields are flux-weighted matrices, samples x modes: radiance times [`LightfieldGrid::root_weight`].

use crate::modular::lightfield::grid::{LightfieldGrid, Tap};
use glam::{DVec2, DVec3};
use mrt_core::linalg::matrix::Matrix;
use std::f64::consts::PI;

/// The lightfields at an opening of a block whose walls emit the columns of `radiosity` (texels x modes).
///
/// `texel_behind(uv, direction)` is the texel that the ray through (u, v) of the opening in a direction of its frame comes
/// from; `None` if it comes from another opening.
pub fn emitted(
    grid: &LightfieldGrid,
    radiosity: &Matrix<f64>,
    texel_behind: impl Fn(DVec2, DVec3) -> Option<usize> + Sync,
) -> Matrix<f64> {
    let by_texel = radiosity.transposed();
    grid.tabulate(radiosity.columns(), |position, direction, out| {
        let uv = grid.position(position);
        let supers = grid.super_directions(direction);
        for &toward in supers {
            if let Some(texel) = texel_behind(uv, toward) {
                for (value, &radiosity) in out.iter_mut().zip(by_texel.column(texel)) {
                    *value += radiosity;
                }
            }
        }
        let scale = grid.root_weight(direction) / (PI * supers.len() as f64);
        out.iter_mut().for_each(|value| *value *= scale);
    })
}

/// The lightfields at the exit of a block from those at its entrance.
///
/// `trace_back(uv, direction)` takes the ray through (u, v) of the exit in a direction of its frame back to the entrance,
/// to (u, v) and a direction there; `None` if the ray comes from a wall.
pub fn propagated(
    grid: &LightfieldGrid,
    entering: &Matrix<f64>,
    trace_back: impl Fn(DVec2, DVec3) -> Option<(DVec2, DVec3)> + Sync,
) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, entering);
    grid.tabulate(entering.columns(), |position, direction, out| {
        let uv = grid.position(position);
        let supers = grid.super_directions(direction);
        for &toward in supers {
            if let Some((uv, toward)) = trace_back(uv, toward) {
                add_interpolated(&by_sample, &grid.taps(uv, toward), 1.0, out);
            }
        }
        let scale = grid.root_weight(direction) / supers.len() as f64;
        out.iter_mut().for_each(|value| *value *= scale);
    })
}

/// Radiance of lightfields, modes x samples: contiguous at each sample, and without the flux weight.
pub(crate) fn radiance_by_sample(grid: &LightfieldGrid, weighted: &Matrix<f64>) -> Matrix<f64> {
    let scales: Vec<f64> = (0..grid.sample_count())
        .map(|sample| 1.0 / grid.root_weight(sample))
        .collect();
    weighted.transposed().scaled_columns(&scales)
}

/// Adds `scale` times the radiance of each mode between the samples of an interpolation.
pub(crate) fn add_interpolated(by_sample: &Matrix<f64>, taps: &[Tap], scale: f64, out: &mut [f64]) {
    for &(sample, weight) in taps {
        let weight = weight * scale;
        for (value, &radiance) in out.iter_mut().zip(by_sample.column(sample)) {
            *value += weight * radiance;
        }
    }
}
