//! Operators between the openings of cubes (Loos et al. 2011, section 5.1): what the canonical emitter sends out, and how
//! lightfields pass through a cube.

use crate::config::LightfieldConfig;
use crate::matrix_parts::{root_sum_of_squares, scaled};
use crate::modular::lightfield::basis::{lightfield_basis, lightfield_coefficients};
use crate::modular::lightfield::grid::{LightfieldGrid, turn_to_heading};
use crate::modular::lightfield::symmetries::{exchanged, mirrored};
use crate::modular::lightfield::transfer::{emitted, propagated};
use crate::modular::paths::ends::EMITTER;
use crate::modular::shape_set::ShapeSet;
use crate::modular::surface::walls::cube::texel_at;
use crate::progress::{Cancelled, Progress};
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity_modes::ParityBasis;
use mrt_runtime::low_level::level::shape::Hole;

/// Operators of the canonical interface in the reduced basis, modes x modes.
#[derive(Clone, Debug)]
pub struct InterfaceOperators {
    /// Through a cube, straight on.
    pub straight: Matrix<f64>,
    /// Out through the side at u = 1 (left of the heading when v is up).
    pub left: Matrix<f64>,
    /// With u and v exchanged; no rows in sets that need no exchanges.
    pub exchange: Matrix<f64>,
    /// What passes each hole of the set.
    pub holes: Vec<Matrix<f64>>,
}

/// Radiance that leaves the canonical emitter when its walls emit the columns of `radiosity` (texels x modes):
/// flux-weighted samples x modes.
pub fn emitted_lightfield(
    grid: &LightfieldGrid,
    radiosity: &Matrix<f64>,
    resolution: usize,
) -> Matrix<f64> {
    emitted(grid, radiosity, |uv, toward| {
        let (face, point) = wall_behind(uv.extend(1.0), toward);
        texel_at(&EMITTER, face, point, resolution)
    })
}

/// The face and the point of the unit cube that a ray comes from which travels along `toward` and leaves the cube at
/// `point`.
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

/// Which way lightfields leave the cube that they entered at z = 0 heading for +z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
    /// At z = 1.
    Straight,
    /// At x = 1, that is u = 1: left of the heading when v is up.
    Left,
}

impl Exit {
    /// The ray through (u, v) of the exit in a direction of the exit's frame, taken back to the entrance: its
    /// (u, v) and direction there, or `None` if it comes from a wall.
    fn trace_back(self, uv: DVec2, direction: DVec3) -> Option<(DVec2, DVec3)> {
        let (point, direction) = match self {
            Exit::Straight => (uv.extend(1.0), direction),
            Exit::Left => {
                let frame = turn_to_heading(Face::PosX);
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

/// Appendix A for interfaces: lets the basis learn what its own modes become on their way through a
/// cube.
///
/// The modes, scaled by their singular values, are sent straight on and to both sides. The results join
/// the modes with `config.enrichment_weight` of their Frobenius norm. With `has_exchanges` the basis also learns what
/// arrives from the sides with u and v exchanged.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn enriched_basis(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    config: &LightfieldConfig,
    has_exchanges: bool,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let own = basis.vectors.scaled_columns(&basis.scales);
    let straight = through_cube(grid, &own, Exit::Straight);
    progress.check()?;
    let left = through_cube(grid, &own, Exit::Left);
    progress.check()?;
    let right = mirrored(grid, &left);
    let sent = [straight, left, right];
    let norm = root_sum_of_squares(sent.iter().map(Matrix::frobenius_norm));
    let weight = config.enrichment_weight * own.frobenius_norm() / norm;
    let [straight, left, right] = sent.map(|fields| scaled(&fields, weight));
    let mut columns = vec![own, straight, left, right];
    if has_exchanges {
        let sideways = [exchanged(grid, &columns[2]), exchanged(grid, &columns[3])];
        columns.extend(sideways);
    }
    lightfield_basis(grid, &columns, config.lightfield_modes, progress)
}

/// Computes the operators of the interface that a set of shapes needs.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn interface_operators(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    set: &ShapeSet,
    progress: &Progress,
) -> Result<InterfaceOperators, Cancelled> {
    let vectors = &basis.vectors;
    let reduced = |fields: Matrix<f64>| lightfield_coefficients(basis, &fields);
    let straight = reduced(through_cube(grid, vectors, Exit::Straight));
    progress.check()?;
    let left = reduced(through_cube(grid, vectors, Exit::Left));
    progress.check()?;
    let exchange = if set.has_exchanges {
        reduced(exchanged(grid, vectors))
    } else {
        Matrix::zeros(0, vectors.columns())
    };
    let holes = set.holes.iter();
    Ok(InterfaceOperators {
        straight,
        left,
        exchange,
        holes: holes
            .map(|&hole| reduced(masked(grid, vectors, hole)))
            .collect(),
    })
}

/// Lightfields at an exit of the cube, from those at the entrance.
fn through_cube(grid: &LightfieldGrid, entering: &Matrix<f64>, exit: Exit) -> Matrix<f64> {
    propagated(grid, entering, |uv, toward| exit.trace_back(uv, toward))
}

/// What a hole lets through: each position counts with the fraction of its cell that is in the hole.
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
