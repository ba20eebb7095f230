//! The one-bounce operator F of the tubes (Loos et al. 2011, equation 1 and section 6.1).
//!
//! The paper traces rays. On a smooth wall the kernel cos θ cos θ' / (π d²) is bounded, by the square of the
//! wall's curvature: so a midpoint rule over parts of each source texel converges like any smooth
//! integral, near texels and the receiver's own included, and costs less than rays of the same accuracy.
//! Two points of a bend see one another or not by [`TubeForm::segment_is_free`]; in the straight tube all
//! do. [`ray_traced_tube_bounce`] is the second implementation.

use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{SurfacePoint, TubeForm};
use mrt_core::lighting::sampling::{cosine_hemisphere_from_square, sobol_point, square_from_unit};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use rayon::prelude::*;
use std::f64::consts::PI;

/// A texel of a tube's wall.
#[derive(Clone, Copy, Debug)]
pub struct TubeTexel {
    /// Its chart.
    pub chart: Face,
    /// Row (v) and column (u) in the chart.
    pub row_column: [usize; 2],
    /// The wall at its centre.
    pub center: SurfacePoint,
    /// Its area, exactly.
    pub area: f64,
}

/// Texels in storage order: chart by chart as [`TubeForm::charts`] lists them, row by row, column by column.
pub fn tube_texels(form: TubeForm, resolution: usize) -> Vec<TubeTexel> {
    let mut texels = Vec::with_capacity(4 * resolution * resolution);
    for chart in form.charts() {
        for j in 0..resolution {
            let area = form.texel_area(chart, resolution, j);
            texels.extend((0..resolution).map(|i| TubeTexel {
                chart,
                row_column: [j, i],
                center: form.texel_center(chart, resolution, j, i),
                area,
            }));
        }
    }
    texels
}

/// Index in storage order of the texel that holds a point of the wall.
pub fn tube_texel_at(form: TubeForm, resolution: usize, point: DVec3) -> usize {
    let (chart, u, v) = form.chart_of(point);
    let along = |x: f64| ((x * resolution as f64) as usize).min(resolution - 1);
    (chart_position(form, chart) * resolution + along(v)) * resolution + along(u)
}

fn chart_position(form: TubeForm, chart: Face) -> usize {
    form.charts()
        .iter()
        .position(|&face| face == chart)
        .unwrap_or(0)
}

/// Parity classes under the mirrors that also keep each opening where it is: those of y and z for the straight
/// tube (four), that of y for the bend (two).
pub fn tube_entry_parity_classes(form: TubeForm, resolution: usize) -> ParityClasses {
    let across = |axis| across_mirror(form, resolution, axis);
    let mirrors = match form {
        TubeForm::Straight => vec![across(1), across(2)],
        TubeForm::Bend => vec![across(1)],
    };
    ParityClasses::new(4 * resolution * resolution, &mirrors)
}

/// Parity classes of the texels: under the mirrors of x, y and z for the straight tube (eight), under that of
/// y and the exchange of x and z for the bend (four).
pub fn tube_parity_classes(form: TubeForm, resolution: usize) -> ParityClasses {
    let across = |axis| across_mirror(form, resolution, axis);
    let last = resolution - 1;
    // Mirror of x, or the bend's exchange of x and z: along the tube.
    let ends = texel_permutation(form, resolution, |chart, j, i| (chart, j, last - i));
    let mirrors = match form {
        TubeForm::Straight => vec![ends, across(1), across(2)],
        TubeForm::Bend => vec![across(1), ends],
    };
    ParityClasses::new(4 * resolution * resolution, &mirrors)
}

/// A mirror across the tube exchanges the charts on its axis and reverses the others.
fn across_mirror(form: TubeForm, resolution: usize, axis: usize) -> Vec<u32> {
    texel_permutation(form, resolution, |chart, j, i| {
        if chart.axis() == axis {
            (chart.opposite(), j, i)
        } else {
            (chart, resolution - 1 - j, i)
        }
    })
}

/// Where (chart, row, column) of each texel goes, as indices.
fn texel_permutation(
    form: TubeForm,
    resolution: usize,
    image: impl Fn(Face, usize, usize) -> (Face, usize, usize),
) -> Vec<u32> {
    tube_texels(form, resolution)
        .iter()
        .map(|texel| {
            let [j, i] = texel.row_column;
            let (chart, j, i) = image(texel.chart, j, i);
            ((chart_position(form, chart) * resolution + j) * resolution + i) as u32
        })
        .collect()
}

/// Parts, along each axis, into which source texels are cut.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    /// Of a texel far from the receiver.
    pub far: usize,
    /// Of one nearer than [`NEAR_WIDTHS`] of its own.
    pub near: usize,
}

impl Parts {
    /// What bakes use. Against 4 to 8 times finer parts one bounce of smooth light errs by 7e-5 at 8² texels a
    /// chart, 2e-5 at 16² and 6e-6 at 32², the worst texel by twice that; more near parts cost time
    /// and change nothing. Even numbers keep the receiver off the points of its own texel.
    pub const STANDARD: Parts = Parts { far: 4, near: 8 };
}

/// Texels whose centre is nearer to the receiver than this many of their longer sides are near.
pub const NEAR_WIDTHS: f64 = 4.0;

/// F of a tube at `resolution`² texels a chart, texels x texels, constant texels, receivers at texel
/// centres.
///
/// Cost: 16 resolution⁴ pairs of texels, an eighth or a quarter of that by symmetry, 16 kernel evaluations
/// each: 0.6 s (straight) and 1.4 s (bend) at 32² on two cores.
///
/// # Errors
/// [`Cancelled`], when the caller's progress says so.
pub fn tube_bounce(
    form: TubeForm,
    resolution: usize,
    parts: Parts,
    progress: &Progress,
) -> Result<Matrix<f64>, Cancelled> {
    let texels = tube_texels(form, resolution);
    let classes = tube_parity_classes(form, resolution);
    let far_points: Vec<WallPoint> = texels
        .iter()
        .flat_map(|texel| wall_points(form, resolution, texel, parts.far))
        .collect();
    let orbits: Vec<&[(u32, u32)]> = classes.orbits().collect();
    let rows: Vec<Vec<f64>> = orbits
        .par_iter()
        .map(|orbit| {
            progress.check()?;
            let receiver = &texels[orbit[0].0 as usize].center;
            let row = texels
                .iter()
                .zip(far_points.chunks_exact(parts.far * parts.far));
            Ok(row
                .map(|(source, far)| {
                    if is_near(form, resolution, receiver, source) {
                        let near = wall_points(form, resolution, source, parts.near);
                        near.map(|point| kernel(form, receiver, &point)).sum()
                    } else {
                        far.iter().map(|point| kernel(form, receiver, point)).sum()
                    }
                })
                .collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut bounce = Matrix::zeros(texels.len(), texels.len());
    for (orbit, row) in orbits.iter().zip(&rows) {
        for &(receiver, element) in *orbit {
            for (source, &factor) in row.iter().enumerate() {
                let image = classes.image(element, source as u32);
                bounce[(receiver as usize, image as usize)] = factor;
            }
        }
    }
    Ok(bounce)
}

/// A point that stands for a part of the wall.
struct WallPoint {
    position: DVec3,
    normal: DVec3,
    area_over_pi: f64,
}

/// The middles of `parts`² parts of a texel.
fn wall_points(
    form: TubeForm,
    resolution: usize,
    texel: &TubeTexel,
    parts: usize,
) -> impl Iterator<Item = WallPoint> {
    let [row, column] = texel.row_column.map(|k| k * parts);
    let chart = texel.chart;
    let fine = resolution * parts;
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

fn is_near(form: TubeForm, resolution: usize, receiver: &SurfacePoint, source: &TubeTexel) -> bool {
    // Around the tube all texels are as wide as in the straight one.
    let around = TubeForm::Straight.texel_area(Face::PosY, resolution, 0) * resolution as f64;
    let longer = match form {
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

/// Estimates F with `rays` cosine-weighted rays from each texel centre, as [`crate::modular::one_bounce::rays`] does for
/// cubes. The standard error of an element f is at most sqrt(f / rays).
pub fn ray_traced_tube_bounce(form: TubeForm, resolution: usize, rays: u32) -> Matrix<f64> {
    let texels = tube_texels(form, resolution);
    let rows: Vec<Vec<f64>> = texels
        .par_iter()
        .enumerate()
        .map(|(index, texel)| {
            let mut row = vec![0.0; texels.len()];
            let center = &texel.center;
            for ray in 0..rays {
                let square = square_from_unit(sobol_point(ray, index as u32));
                let local = cosine_hemisphere_from_square(square);
                let direction = center.tangents[0] * local.x
                    + center.tangents[1] * local.y
                    + center.normal * local.z;
                let hit = form.first_hit(center.position, direction);
                if hit.opening.is_none() {
                    row[tube_texel_at(form, resolution, hit.point)] += 1.0;
                }
            }
            row.iter_mut().for_each(|count| *count /= f64::from(rays));
            row
        })
        .collect();
    Matrix::from_fn(texels.len(), texels.len(), |i, j| rows[i][j])
}

#[cfg(test)]
mod tests;
