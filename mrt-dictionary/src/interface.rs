//! Operators between openings (Loos et al. 2011, section 5.1): what a block sends out, how lightfields
//! pass through a cube, and what they do to its walls.
//!
//! Coefficients are of the orthonormal basis `Q` of the flux-weighted lightfields, where the paper scales
//! it by singular values: a norm of a propagation operator is then a gain of flux, and must not exceed one.

use crate::config::LightfieldConfig;
use crate::lightfield::{LightfieldGrid, frame_of_heading};
use crate::prior::root_sum_of_squares;
use crate::progress::{Cancelled, Progress};
use crate::symmetry::texel_parity_classes;
use crate::transport::whole_multiplets;
use glam::{DVec2, DVec3};
use mrt_core::cube::Face;
use mrt_core::form_factor::point_to_polygon;
use mrt_core::matrix::{Matrix, dot, transpose_multiply};
use mrt_core::parity::ParityClasses;
use mrt_core::svd::{dropped_energy_beyond_first, largest_entry_sign, svd, symmetric_eigen};
use mrt_runtime::shape::Shape;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The reduced lightfield basis `H_rlf`.
#[derive(Clone, Debug)]
pub struct LightfieldBasis {
    /// Orthonormal flux-weighted vectors, samples x modes; each has a parity under both mirrors.
    pub vectors: Matrix<f64>,
    /// Singular value of each vector.
    pub scales: Vec<f64>,
    /// Parity class of each vector: bit 0 set if odd in u, bit 1 if odd in v.
    pub classes: Vec<usize>,
    /// Fraction that the modes left out hold of the lightfields' energy beyond their first mode.
    pub dropped_energy: f64,
}

/// Operators of the canonical interface.
#[derive(Clone, Debug)]
pub struct InterfaceOperators {
    /// Through a cube, straight on: modes x modes.
    pub straight: Matrix<f64>,
    /// Out through the side at u = 1 (left of the heading when v is up).
    pub left: Matrix<f64>,
    /// Out through the side at u = 0.
    pub right: Matrix<f64>,
    /// `T_rlf->r`, response modes x lightfield modes.
    pub response_from_lightfield: Matrix<f64>,
    /// `U_r`, texels of the cube open at -z only x response modes, orthonormal columns.
    pub response_basis: Matrix<f64>,
    /// Singular values of the response.
    pub response_singular_values: Vec<f64>,
    /// Fraction that the modes left out hold of the response's energy beyond its first mode.
    pub dropped_energy: f64,
}

/// The cube behind the canonical interface.
pub static RECEIVER: Shape = Shape {
    name: "receiver",
    openings: &[Face::NegZ],
};

/// Radiance that leaves a shape through one of its openings when its walls emit the columns of
/// `radiosity` (texels x modes): flux-weighted samples x modes.
pub fn emitted_lightfield(
    grid: &LightfieldGrid,
    shape: &Shape,
    opening: Face,
    radiosity: &Matrix<f64>,
    resolution: usize,
) -> Matrix<f64> {
    let by_texel = radiosity.transposed();
    let frame = frame_of_heading(opening);
    grid.tabulate(radiosity.columns(), |position, direction, out| {
        let uv = grid.position(position);
        // In the canonical frame the light leaves at z = 1 towards +z.
        let leaving = DVec3::new(uv.x, uv.y, 1.0);
        let supers = grid.super_directions(direction);
        for &toward in supers {
            let (face, hit) = wall_behind(leaving, toward);
            let Some(offset) = shape.wall_offset(frame.face(face), resolution) else {
                continue;
            };
            let hit = frame.point(hit);
            let texel = offset + frame.face(face).texel_index(hit, resolution);
            for (value, &radiosity) in out.iter_mut().zip(by_texel.column(texel)) {
                *value += radiosity;
            }
        }
        let scale = grid.root_weight(direction) / (PI * supers.len() as f64);
        for value in out {
            *value *= scale;
        }
    })
}

/// Where a ray that reaches `point` on the unit cube travelling along `toward` comes from.
fn wall_behind(point: DVec3, toward: DVec3) -> (Face, DVec3) {
    let mut nearest = (f64::MAX, Face::NegZ);
    for axis in 0..3 {
        if toward[axis] == 0.0 {
            continue;
        }
        let positive = toward[axis] < 0.0;
        let wall = if positive { 1.0 } else { 0.0 };
        let distance = (point[axis] - wall) / toward[axis];
        if distance < nearest.0 {
            nearest = (distance, Face::from_axis(axis, positive));
        }
    }
    let (distance, face) = nearest;
    (face, point - toward * distance)
}

/// Decomposes flux-weighted lightfields (samples x columns), class by class, keeping the largest
/// `modes`.
///
/// The columns are few and long, so this is done on the columns' scalar products (method of
/// snapshots); modes below 1e-6 of the largest would be rounding and are left out.
pub fn lightfield_basis(
    classes: &ParityClasses,
    columns: &[Matrix<f64>],
    modes: usize,
    progress: &Progress,
) -> Result<LightfieldBasis, Cancelled> {
    /// What a class was decomposed into: its columns, and the weights of them in each mode.
    struct Part {
        folded: Vec<Vec<f64>>,
        weights: Matrix<f64>,
    }
    let mut parts = Vec::with_capacity(classes.class_count());
    // (singular value, class, position in the class) of every mode that rounding leaves standing.
    let mut found: Vec<(f64, usize, usize)> = Vec::new();
    for class in 0..classes.class_count() {
        progress.check()?;
        let folded: Vec<Vec<f64>> = columns
            .par_iter()
            .flat_map(|part| (0..part.columns()).into_par_iter().map(move |j| (part, j)))
            .map(|(part, j)| classes.fold(class, part.column(j)))
            .collect();
        let count = folded.len();
        let lower: Vec<Vec<f64>> = (0..count)
            .into_par_iter()
            .map(|j| (j..count).map(|i| dot(&folded[i], &folded[j])).collect())
            .collect();
        let gram = Matrix::from_fn(count, count, |i, j| lower[i.min(j)][i.max(j) - i.min(j)]);
        let (values, weights) = symmetric_eigen(gram.view());
        let floor = 1e-12 * values.first().copied().unwrap_or(0.0);
        let standing = values.iter().take_while(|&&v| v > floor && v > 0.0);
        found.extend(standing.enumerate().map(|(k, v)| (v.sqrt(), class, k)));
        parts.push(Part { folded, weights });
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let all: Vec<f64> = found.iter().map(|mode| mode.0).collect();
    let kept = whole_multiplets(&all, modes);
    let vectors: Vec<Vec<f64>> = found[..kept]
        .par_iter()
        .map(|&(scale, class, k)| {
            let part = &parts[class];
            let mut vector = vec![0.0; classes.dimension(class)];
            for (column, &weight) in part.folded.iter().zip(part.weights.column(k)) {
                let weight = weight / scale;
                for (v, &x) in vector.iter_mut().zip(column) {
                    *v += weight * x;
                }
            }
            let sign = largest_entry_sign(&vector);
            vector.iter_mut().for_each(|v| *v *= sign);
            classes.unfold(class, &vector)
        })
        .collect();
    Ok(LightfieldBasis {
        vectors: Matrix::from_columns(classes.point_count(), &vectors),
        scales: all[..kept].to_vec(),
        classes: found[..kept].iter().map(|mode| mode.1).collect(),
        dropped_energy: dropped_energy_beyond_first(&all, kept),
    })
}

/// Which way lightfields leave the cube that they entered at z = 0 heading for +z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
    /// At z = 1.
    Straight,
    /// At x = 1, that is u = 1: left of the heading when v is up.
    Left,
}

impl Exit {
    /// The ray through (u, v) of the exit in a direction of its frame, taken back to the entrance: its
    /// (u, v) and direction there, or `None` if it comes from a wall.
    fn trace_back(self, uv: DVec2, direction: DVec3) -> Option<(DVec2, DVec3)> {
        let (point, direction) = match self {
            Exit::Straight => (uv.extend(1.0), direction),
            Exit::Left => {
                let frame = frame_of_heading(Face::PosX);
                let point = frame.point(uv.extend(1.0));
                (point, frame.direction(direction))
            }
        };
        if direction.z <= 0.0 {
            return None;
        }
        let entrance = point - direction * (point.z / direction.z);
        let uv = entrance.truncate();
        let inside = uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all();
        inside.then_some((uv, direction))
    }
}

/// Lightfields (flux-weighted, samples x modes) at an exit, from those at the entrance.
fn propagated(grid: &LightfieldGrid, entering: &Matrix<f64>, exit: Exit) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, entering);
    grid.tabulate(entering.columns(), |position, direction, out| {
        let uv = grid.position(position);
        let supers = grid.super_directions(direction);
        for &toward in supers {
            let Some((uv, toward)) = exit.trace_back(uv, toward) else {
                continue;
            };
            accumulate(&by_sample, &grid.taps(uv, toward), 1.0, out);
        }
        let scale = grid.root_weight(direction) / supers.len() as f64;
        for value in out {
            *value *= scale;
        }
    })
}

/// Modes x samples, without the flux weight: radiance, contiguous at each sample.
fn radiance_by_sample(grid: &LightfieldGrid, weighted: &Matrix<f64>) -> Matrix<f64> {
    let samples = grid.sample_count();
    let modes = weighted.columns();
    let mut data = vec![0.0; samples * modes];
    if modes > 0 {
        data.par_chunks_exact_mut(modes)
            .enumerate()
            .for_each(|(sample, out)| {
                let scale = 1.0 / grid.root_weight(sample);
                for (mode, value) in out.iter_mut().enumerate() {
                    *value = weighted[(sample, mode)] * scale;
                }
            });
    }
    Matrix::from_column_major(modes, samples, data)
}

fn accumulate(by_sample: &Matrix<f64>, taps: &[(usize, f64)], scale: f64, out: &mut [f64]) {
    for &(sample, weight) in taps {
        let weight = weight * scale;
        for (value, &radiance) in out.iter_mut().zip(by_sample.column(sample)) {
            *value += weight * radiance;
        }
    }
}

/// Appendix A for interfaces: lets the basis learn what its own modes become on their way through a
/// cube.
///
/// The modes, scaled by their singular values, are sent straight on and to both sides; the results join
/// the modes with `config.enrichment_weight` of their Frobenius norm.
pub fn enriched_basis(
    grid: &LightfieldGrid,
    classes: &ParityClasses,
    basis: &LightfieldBasis,
    config: &LightfieldConfig,
    progress: &Progress,
) -> Result<LightfieldBasis, Cancelled> {
    let scaled = basis.vectors.scaled_columns(&basis.scales);
    let straight = propagated(grid, &scaled, Exit::Straight);
    progress.check()?;
    let left = propagated(grid, &scaled, Exit::Left);
    progress.check()?;
    let right = mirrored_columns(classes, &left);
    let own = scaled.frobenius_norm();
    let sent = [&straight, &left, &right]
        .into_iter()
        .map(Matrix::frobenius_norm);
    let weight = config.enrichment_weight * own / root_sum_of_squares(sent);
    let rescale = |m: Matrix<f64>| {
        let scales = vec![weight; m.columns()];
        m.scaled_columns(&scales)
    };
    let columns = [scaled, rescale(straight), rescale(left), rescale(right)];
    lightfield_basis(classes, &columns, config.lightfield_modes, progress)
}

/// Every column mirrored in u.
fn mirrored_columns(classes: &ParityClasses, columns: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(columns.rows(), columns.columns(), |i, j| {
        columns[(classes.image(1, i as u32) as usize, j)]
    })
}

/// Computes propagation and response of the canonical interface in the reduced basis.
pub fn interface_operators(
    grid: &LightfieldGrid,
    basis: &LightfieldBasis,
    config: &LightfieldConfig,
    resolution: usize,
    progress: &Progress,
) -> Result<InterfaceOperators, Cancelled> {
    let project = |m: &Matrix<f64>| parallel_transpose_multiply(&basis.vectors, m);
    let straight = project(&propagated(grid, &basis.vectors, Exit::Straight));
    progress.check()?;
    let left = project(&propagated(grid, &basis.vectors, Exit::Left));
    progress.check()?;
    // The mirror of u changes the sign of odd modes and exchanges left and right.
    let sign = |mode: usize| {
        if basis.classes[mode] & 1 == 1 {
            -1.0
        } else {
            1.0
        }
    };
    let right = Matrix::from_fn(left.rows(), left.columns(), |i, j| {
        left[(i, j)] * sign(i) * sign(j)
    });
    let response = wall_response(grid, basis, resolution);
    progress.check()?;
    let scaled = response.scaled_columns(&basis.scales);
    let classes = texel_parity_classes(&RECEIVER, resolution);
    let mut parts: Vec<(f64, Vec<f64>)> = Vec::new();
    for class in 0..classes.class_count() {
        let part = svd(classes.fold_columns(class, &scaled).view());
        for (k, &s) in part.singular_values.iter().enumerate() {
            parts.push((s, classes.unfold(class, part.u.column(k))));
        }
    }
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let response_singular_values: Vec<f64> = parts.iter().map(|part| part.0).collect();
    let kept = whole_multiplets(&response_singular_values, config.response_modes);
    let columns: Vec<&[f64]> = parts[..kept].iter().map(|part| part.1.as_slice()).collect();
    let response_basis = Matrix::from_columns(response.rows(), &columns);
    Ok(InterfaceOperators {
        straight,
        left,
        right,
        response_from_lightfield: transpose_multiply(response_basis.view(), response.view()),
        response_basis,
        dropped_energy: dropped_energy_beyond_first(&response_singular_values, kept),
        response_singular_values,
    })
}

/// `R_b->rlf` for one opening: what a shape with the given implicit lighting sends out, in the basis.
pub fn lightfield_from_coefficients(basis: &LightfieldBasis, emitted: &Matrix<f64>) -> Matrix<f64> {
    parallel_transpose_multiply(&basis.vectors, emitted)
}

fn parallel_transpose_multiply(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    let columns: Vec<Matrix<f64>> = (0..b.columns())
        .into_par_iter()
        .map(|j| transpose_multiply(a.view(), b.columns_view(j..j + 1)))
        .collect();
    let columns: Vec<&[f64]> = columns.iter().map(|m| m.data()).collect();
    Matrix::from_columns(a.columns(), &columns)
}

/// Cells along each axis into which the interface is cut to light the walls.
const RESPONSE_CELLS: usize = 24;
/// Cells nearer to the texel than this many of their widths are cut once more.
const NEAR_CELLS: f64 = 4.0;
/// Parts along each axis of a near cell.
const NEAR_PARTS: usize = 4;

/// `F_rlf`: irradiance on the receiver's texels from each mode, texels x modes.
///
/// Each cell of the interface counts with its exact form factor and the radiance that the lightfield has
/// from the cell's centre towards the texel.
fn wall_response(grid: &LightfieldGrid, basis: &LightfieldBasis, resolution: usize) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, &basis.vectors);
    let texels: Vec<(Face, DVec3)> = RECEIVER.texels(resolution).collect();
    let modes = basis.vectors.columns();
    let rows: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|&(face, point)| {
            let mut row = vec![0.0; modes];
            let cell = 1.0 / RESPONSE_CELLS as f64;
            for j in 0..RESPONSE_CELLS {
                for i in 0..RESPONSE_CELLS {
                    let low = DVec2::new(i as f64, j as f64) * cell;
                    let center = (low + 0.5 * cell).extend(0.0);
                    let parts = if center.distance(point) < NEAR_CELLS * cell {
                        NEAR_PARTS
                    } else {
                        1
                    };
                    let part = cell / parts as f64;
                    for k in 0..parts * parts {
                        let step = DVec2::new((k % parts) as f64, (k / parts) as f64);
                        let low = low + step * part;
                        add_cell(grid, &by_sample, low, part, (face, point), &mut row);
                    }
                }
            }
            row
        })
        .collect();
    Matrix::from_fn(texels.len(), modes, |i, j| rows[i][j])
}

/// Adds the irradiance from one square cell of the interface.
fn add_cell(
    grid: &LightfieldGrid,
    by_sample: &Matrix<f64>,
    low: DVec2,
    width: f64,
    (face, point): (Face, DVec3),
    row: &mut [f64],
) {
    let rectangle = Face::NegZ.rectangle([low.x, low.x + width], [low.y, low.y + width]);
    let factor = point_to_polygon(point, -face.outward(), &rectangle);
    let center = low + 0.5 * width;
    let direction = (point - center.extend(0.0)).normalize();
    accumulate(by_sample, &grid.taps(center, direction), PI * factor, row);
}
