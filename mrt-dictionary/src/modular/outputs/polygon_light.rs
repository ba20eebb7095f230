//! What a polygon of radiosity one sends to a probe and to a texel, from its exact moments.

use glam::DVec3;
use mrt_core::geometry::polygon_moments::Moments;
use mrt_core::lighting::hemisphere_sh::ohlsh_from_moments;
use std::f64::consts::PI;

/// Spherical harmonics of a probe: three bands.
pub const SH9: usize = 9;

/// SH coefficients of incident radiance.
pub fn sh_of_unit_radiosity(moments: &Moments) -> [f64; SH9] {
    moments.sh9().map(|x| x / PI)
}

/// Vector irradiance in a texel's axes (along u, along v, along the normal): the coefficients of 1, v, normal and u of
/// [`mrt_core::lighting::hemisphere_sh`].
pub fn vector_of_unit_radiosity(moments: &Moments, axes: &[DVec3; 3]) -> [f64; 4] {
    ohlsh_from_moments(&moments.in_frame(axes)).map(|x| x / PI)
}

/// `rows[k] += weights[k] * signals`. The rows stand one after the other.
pub(crate) fn add_weighted(rows: &mut [f64], weights: &[f64], signals: &[f64]) {
    for (row, weight) in rows.chunks_exact_mut(signals.len().max(1)).zip(weights) {
        for (sum, x) in row.iter_mut().zip(signals) {
            *sum += weight * x;
        }
    }
}
