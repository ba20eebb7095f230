//! Operators between openings (Loos et al. 2011, section 5.1): what a block sends out, how lightfields
//! pass through a cube, and what they do to its walls.
//!
//! Coefficients are of the orthonormal basis `Q` of the flux-weighted lightfields, where the paper scales
//! it by singular values: a norm of a propagation operator is then a gain of flux, and must not exceed one.

use crate::config::LightfieldConfig;
use crate::modular::light_prior::cube::root_sum_of_squares;
use crate::modular::lightfield::grid::{LightfieldGrid, frame_of_heading};
use crate::modular::outputs::cube::{
    PROBE_WEIGHT, ProbeSamples, SH9, probe_points, sh_of_unit_radiosity,
};
use crate::modular::paths::response::{ResponseBasis, stack};
use crate::modular::paths::transport::{EMITTER, RECEIVER};
use crate::parallel_products::parallel_transpose_multiply;
use crate::progress::{Cancelled, Progress};
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::geometry::polygon_moments::polygon_moments;
use mrt_core::linalg::matrix::{Matrix, transpose_multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{
    GramModes, ModeChoice, ParityBasis, ParityMode, combined_columns, gram_of_columns,
};
use mrt_runtime::low_level::level::shape::Hole;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Operators of the canonical interface.
#[derive(Clone, Debug)]
pub struct InterfaceOperators {
    /// Lightfield modes x emission modes: what leaves a shape.
    pub from_emission: Matrix<f64>,
    /// Through a cube, straight on: modes x modes.
    pub straight: Matrix<f64>,
    /// Out through the side at u = 1 (left of the heading when v is up).
    pub left: Matrix<f64>,
    /// With u and v exchanged: modes x modes, or no rows.
    pub exchange: Matrix<f64>,
    /// What passes each hole: modes x modes.
    pub holes: Vec<Matrix<f64>>,
    /// `T_rlf->r`, response modes x lightfield modes.
    pub response_from_lightfield: Matrix<f64>,
}

/// Radiance that leaves the canonical emitter when its walls emit the columns of `radiosity` (texels x modes):
/// flux-weighted samples x modes.
pub fn emitted_lightfield(
    grid: &LightfieldGrid,
    radiosity: &Matrix<f64>,
    resolution: usize,
) -> Matrix<f64> {
    let by_texel = radiosity.transposed();
    grid.tabulate(radiosity.columns(), |position, direction, out| {
        let uv = grid.position(position);
        let leaving = DVec3::new(uv.x, uv.y, 1.0);
        let supers = grid.super_directions(direction);
        for &toward in supers {
            let (face, hit) = wall_behind(leaving, toward);
            let Some(offset) = EMITTER.wall_offset(face, resolution) else {
                continue;
            };
            let texel = offset + face.texel_index(hit, resolution);
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
) -> Result<ParityBasis, Cancelled> {
    let mut parts: Vec<(Matrix<f64>, GramModes)> = Vec::with_capacity(classes.class_count());
    for class in 0..classes.class_count() {
        progress.check()?;
        let folded: Vec<Vec<f64>> = columns
            .par_iter()
            .flat_map(|part| (0..part.columns()).into_par_iter().map(move |j| (part, j)))
            .map(|(part, j)| classes.fold(class, part.column(j)))
            .collect();
        let folded = Matrix::from_columns(classes.dimension(class), &folded);
        let modes = GramModes::of(&gram_of_columns(&folded));
        parts.push((folded, modes));
    }
    let values = parts.iter().map(|(_, part)| &part.singular_values[..]);
    let choice = ModeChoice::largest(values, modes);
    Ok(choice.basis(classes, |ParityMode { class, position }| {
        let (folded, part) = &parts[class];
        let scale = part.singular_values[position];
        let weights = part.vectors.column(position).iter().map(|w| w / scale);
        combined_columns(folded, &weights.collect::<Vec<f64>>())
    }))
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
    basis: &ParityBasis,
    config: &LightfieldConfig,
    has_exchanges: bool,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
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
    let mut columns = vec![scaled, rescale(straight), rescale(left), rescale(right)];
    if has_exchanges {
        let sideways = [exchanged(grid, &columns[2]), exchanged(grid, &columns[3])];
        columns.extend(sideways);
    }
    lightfield_basis(classes, &columns, config.lightfield_modes, progress)
}

/// Every column mirrored in u.
fn mirrored_columns(classes: &ParityClasses, columns: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(columns.rows(), columns.columns(), |i, j| {
        columns[(classes.image(1, i as u32) as usize, j)]
    })
}

/// Computes emission, propagation and response of the canonical interface in the reduced basis.
///
/// # Errors
/// [`Cancelled`].
pub fn interface_operators(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    emitted: &Matrix<f64>,
    response: &ResponseBasis,
    setup: &InterfaceSetup,
    progress: &Progress,
) -> Result<InterfaceOperators, Cancelled> {
    let project = |m: &Matrix<f64>| lightfield_coefficients(basis, m);
    let straight = project(&propagated(grid, &basis.vectors, Exit::Straight));
    progress.check()?;
    let left = project(&propagated(grid, &basis.vectors, Exit::Left));
    progress.check()?;
    let exchange = if setup.has_exchanges {
        project(&exchanged(grid, &basis.vectors))
    } else {
        Matrix::zeros(0, basis.vectors.columns())
    };
    let holes = setup
        .holes
        .iter()
        .map(|&hole| project(&masked(grid, &basis.vectors, hole)))
        .collect();
    progress.check()?;
    let light = response_of_modes(grid, basis, setup.resolution, setup.probes);
    Ok(InterfaceOperators {
        from_emission: project(emitted),
        straight,
        left,
        exchange,
        holes,
        response_from_lightfield: transpose_multiply(response.basis.view(), light.view()),
    })
}

/// What [`interface_operators`] is asked for.
#[derive(Clone, Debug)]
pub struct InterfaceSetup {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Probes along an edge of a block.
    pub probes: usize,
    /// True in sets with vertical openings.
    pub has_exchanges: bool,
    /// Holes of the set.
    pub holes: Vec<Hole>,
}

/// Lightfields with u and v exchanged.
pub fn exchanged(grid: &LightfieldGrid, fields: &Matrix<f64>) -> Matrix<f64> {
    let (p, d) = (grid.positions, grid.directions);
    let source = |sample: usize| {
        let (x, rest) = (sample % d, sample / d);
        let (y, rest) = (rest % d, rest / d);
        let (i, j) = (rest % p, rest / p);
        ((i * p + j) * d + x) * d + y
    };
    Matrix::from_fn(fields.rows(), fields.columns(), |s, k| {
        fields[(source(s), k)]
    })
}

/// What a hole lets through: each position counts with the fraction of its cell in the hole.
fn masked(grid: &LightfieldGrid, fields: &Matrix<f64>, hole: Hole) -> Matrix<f64> {
    let [u, v] = hole.rectangle();
    let half = 0.5 / grid.positions as f64;
    let overlap = |x: f64, [low, high]: [f64; 2]| {
        ((high.min(x + half) - low.max(x - half)) / (2.0 * half)).max(0.0)
    };
    let fraction = |sample: usize| {
        let uv = grid.position(sample / grid.direction_count());
        overlap(uv.x, u) * overlap(uv.y, v)
    };
    Matrix::from_fn(fields.rows(), fields.columns(), |s, k| {
        fraction(s) * fields[(s, k)]
    })
}

/// Coefficients of lightfields (flux-weighted, samples x signals) in the basis.
pub fn lightfield_coefficients(basis: &ParityBasis, fields: &Matrix<f64>) -> Matrix<f64> {
    parallel_transpose_multiply(&basis.vectors, fields)
}

/// Cells along each axis into which the interface is cut to light the walls.
const RESPONSE_CELLS: usize = 24;
/// Cells nearer to the texel than this many of their widths are cut once more.
const NEAR_CELLS: f64 = 4.0;
/// Parts along each axis of a near cell.
const NEAR_PARTS: usize = 4;

/// `F_rlf`: irradiance on the receiver's texels and weighted samples of its probes, from each mode.
///
/// Each cell of the interface counts with its exact form factor, or its exact moments at a probe, and the radiance
/// that the lightfield has from the cell's centre towards the receiver.
fn response_of_modes(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    resolution: usize,
    probes: usize,
) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, &basis.vectors);
    let texels: Vec<(Face, DVec3)> = RECEIVER.texels(resolution).collect();
    let modes = basis.vectors.columns();
    let walls: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|&(face, point)| {
            let mut row = vec![0.0; modes];
            for_each_cell(point, |cell| {
                let factor = point_to_polygon(point, -face.outward(), &cell.corners);
                let taps = grid.taps(cell.center, cell.direction);
                accumulate(&by_sample, &taps, PI * factor, &mut row);
            });
            row
        })
        .collect();
    let points: Vec<DVec3> = probe_points(probes).collect();
    let volume: Vec<Vec<f64>> = points
        .par_iter()
        .map(|&point| {
            let mut rows = vec![0.0; SH9 * modes];
            for_each_cell(point, |cell| {
                let sh = sh_of_unit_radiosity(&polygon_moments(point, &cell.corners));
                let taps = grid.taps(cell.center, cell.direction);
                for (row, weight) in rows.chunks_exact_mut(modes).zip(sh) {
                    accumulate(&by_sample, &taps, PI * weight, row);
                }
            });
            rows
        })
        .collect();
    let walls = Matrix::from_fn(texels.len(), modes, |i, j| walls[i][j]);
    let volume = Matrix::from_fn(SH9 * points.len(), modes, |i, j| {
        volume[i / SH9][i % SH9 * modes + j]
    });
    stack(
        &walls,
        &ProbeSamples::default().from_sh(&volume, PROBE_WEIGHT),
    )
}

/// A square part of the interface as a point behind it sees it.
struct Cell {
    corners: [DVec3; 4],
    center: DVec2,
    /// From its centre to the point.
    direction: DVec3,
}

/// Cuts the interface into cells, finer near a point behind it.
fn for_each_cell(point: DVec3, mut visit: impl FnMut(&Cell)) {
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
            let width = cell / parts as f64;
            for k in 0..parts * parts {
                let step = DVec2::new((k % parts) as f64, (k / parts) as f64);
                let low = low + step * width;
                let center = low + 0.5 * width;
                visit(&Cell {
                    corners: Face::NegZ.rectangle([low.x, low.x + width], [low.y, low.y + width]),
                    center,
                    direction: (point - center.extend(0.0)).normalize(),
                });
            }
        }
    }
}
