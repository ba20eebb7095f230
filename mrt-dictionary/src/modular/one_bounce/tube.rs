//! The one-bounce operator F of round tubes (Loos et al. 2011, equation 1 and section 6.1).
//!
//! The paper traces rays. On a smooth wall the kernel cos θ cos θ' / (π d²) is bounded by the square of the
//! wall's curvature. So a midpoint rule over parts of each source texel converges like any smooth
//! integral, near texels and the receiver's own included, and costs less than rays of the same accuracy.
//! [`TubeForm::segment_is_free`] tells which points of a bend see one another; in the straight tube all do.

use crate::modular::one_bounce::orbits::{from_orbit_rows, orbit_receivers};
use crate::modular::surface::mirrors::tube::tube_parity_classes;
use crate::modular::surface::walls::tube::{TubeTexel, TubeWall};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{SurfacePoint, TubeForm};
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Number of parts, along each axis, into which a source texel is cut.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    /// For texels far from the receiver.
    pub far: usize,
    /// For texels whose centre is nearer to the receiver than [`NEAR_WIDTHS`] of their longer sides.
    pub near: usize,
}

impl Parts {
    /// What bakes use. Against 4 to 8 times finer parts, one bounce of smooth light errs by 7e-5 at 8² texels a
    /// chart, by 2e-5 at 16² and by 6e-6 at 32², and the worst texel by twice that. More near parts cost time
    /// and change nothing. Even numbers keep the receiver off the points of its own texel.
    pub const STANDARD: Parts = Parts { far: 4, near: 8 };
}

/// A texel is near if its centre is nearer to the receiver than this number of the texel's longer sides.
pub const NEAR_WIDTHS: f64 = 4.0;

/// F of a tube, texels x texels: one value a texel, receivers at texel centres.
///
/// Cost: 16 resolution⁴ pairs of texels, an eighth or a quarter of them by symmetry, with 16 kernel evaluations
/// each: 0.6 s (straight) and 1.4 s (bend) at 32² texels a chart on two cores.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn tube_bounce(
    wall: &TubeWall,
    parts: Parts,
    progress: &Progress,
) -> Result<Matrix<f64>, Cancelled> {
    let classes = tube_parity_classes(wall);
    let far_points: Vec<WallPoint> = wall
        .texels
        .iter()
        .flat_map(|texel| wall_points(wall, texel, parts.far))
        .collect();
    let rows: Vec<Vec<f64>> = orbit_receivers(&classes)
        .into_par_iter()
        .map(|receiver| {
            progress.check()?;
            let receiver = &wall.texels[receiver].center;
            let far_points = far_points.chunks_exact(parts.far * parts.far);
            let factors = wall.texels.iter().zip(far_points).map(|(source, far)| {
                if is_near(wall, receiver, source) {
                    let near = wall_points(wall, source, parts.near);
                    near.map(|point| kernel(wall.form, receiver, &point)).sum()
                } else {
                    let far = far.iter();
                    far.map(|point| kernel(wall.form, receiver, point)).sum()
                }
            });
            Ok(factors.collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(from_orbit_rows(&classes, &rows))
}

/// A point that stands for a part of the wall.
struct WallPoint {
    position: DVec3,
    normal: DVec3,
    area_over_pi: f64,
}

/// The middles of `parts`² parts of a texel.
fn wall_points(
    wall: &TubeWall,
    texel: &TubeTexel,
    parts: usize,
) -> impl Iterator<Item = WallPoint> {
    let [row, column] = texel.row_column.map(|k| k * parts);
    let (form, chart) = (wall.form, texel.chart);
    let fine = wall.resolution * parts;
    (0..parts * parts).map(move |part| {
        let (j, i) = (row + part / parts, column + part % parts);
        let center = form.texel_center(chart, fine, j, i);
        WallPoint {
            position: center.position,
            normal: center.normal,
            area_over_pi: form.texel_area(chart, fine, j) / PI,
        }
    })
}

fn is_near(wall: &TubeWall, receiver: &SurfacePoint, source: &TubeTexel) -> bool {
    let resolution = wall.resolution;
    // Around the tube all texels are as wide as in the straight one.
    let around = TubeForm::Straight.texel_area(Face::PosY, resolution, 0) * resolution as f64;
    let longer = match wall.form {
        TubeForm::Straight => around.max(1.0 / resolution as f64),
        TubeForm::Bend => around.max(source.area / around),
    };
    receiver.position.distance(source.center.position) < NEAR_WIDTHS * longer
}

/// Irradiance at the receiver from unit radiosity of the part that a point stands for.
fn kernel(form: TubeForm, receiver: &SurfacePoint, source: &WallPoint) -> f64 {
    let offset = source.position - receiver.position;
    let (here, there) = (receiver.normal.dot(offset), -source.normal.dot(offset));
    if here <= 0.0 || there <= 0.0 || !form.segment_is_free(receiver.position, source.position) {
        return 0.0;
    }
    let squared = offset.length_squared();
    here * there / (squared * squared) * source.area_over_pi
}

#[cfg(test)]
mod tests;
