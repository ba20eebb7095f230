//! Lightfields at the round openings of tubes, and the operators on them (Loos et al. 2011, sections 5.1
//! and 6.1): what a tube sends out, and how lightfields pass through tubes. [`crate::modular::lightfield::tube_response`] says
//! what they do to the walls.
//!
//! The canonical interface is that of the cubes, the face z = 0 crossed towards +z with v up, and so is its
//! grid of samples ([`LightfieldGrid`]). Only the positions differ: the grid's unit square is carried to the
//! disc of radius [`TUBE_RADIUS`] by the concentric map of Shirley and Chiu. All samples then lie in the
//! opening, with equal areas, and interpolation never mixes light with the dark beside the opening, as it
//! would where a square grid is masked. The map has every mirror and quarter turn of the grid.

use crate::config::LightfieldConfig;
use crate::modular::light_prior::cube::root_sum_of_squares;
use crate::modular::lightfield::grid::{LightfieldGrid, Tap, frame_of_heading};
use crate::modular::lightfield::interface::{lightfield_basis, lightfield_coefficients};
use crate::modular::one_bounce::tube::tube_texel_at;
use crate::progress::{Cancelled, Progress};
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use mrt_core::lighting::sampling::{disk_from_square, square_from_disk, square_from_unit};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::ParityBasis;
use std::f64::consts::PI;

/// Through which openings light enters and leaves a tube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passage {
    /// The tube.
    pub form: TubeForm,
    /// Where light enters.
    pub entry: Face,
    /// Where it leaves.
    pub exit: Face,
}

impl Passage {
    /// Straight on.
    pub const STRAIGHT: Passage = Passage {
        form: TubeForm::Straight,
        entry: Face::NegX,
        exit: Face::PosX,
    };
    /// Through a bend, to the left of the heading with +y up.
    pub const LEFT: Passage = Passage {
        form: TubeForm::Bend,
        entry: Face::PosX,
        exit: Face::PosZ,
    };
    /// To the right: the same bend from its other end.
    pub const RIGHT: Passage = Passage {
        form: TubeForm::Bend,
        entry: Face::PosZ,
        exit: Face::PosX,
    };

    /// The ray through (u, v) of the exit in a direction of the exit's frame, taken back to the entry: its
    /// (u, v) and direction there, or `None` if it comes from the wall.
    pub fn trace_back(self, uv: DVec2, direction: DVec3) -> Option<(DVec2, DVec3)> {
        let (point, direction) = leaving_ray(self.exit, uv, direction);
        let hit = self.form.first_hit(point, -direction);
        if hit.opening != Some(self.entry) {
            return None;
        }
        let frame = frame_of_heading(self.entry.opposite()).inverse();
        let uv = uv_of_point(frame.point(hit.point).truncate());
        Some((uv, frame.direction(direction)))
    }
}

/// The ray of an opening's frame that leaves through (u, v), in the tube's coordinates.
pub(crate) fn leaving_ray(opening: Face, uv: DVec2, direction: DVec3) -> (DVec3, DVec3) {
    let frame = frame_of_heading(opening);
    let point = frame.point(point_of_uv(uv).extend(1.0));
    (point, frame.direction(direction))
}

/// The point (x, y) of the canonical disc for (u, v) in [0, 1]².
pub(crate) fn point_of_uv(uv: DVec2) -> DVec2 {
    disk_from_square(square_from_unit(uv)) * TUBE_RADIUS + 0.5
}

/// Inverse of [`point_of_uv`]; points beyond the rim by rounding count as on it.
pub(crate) fn uv_of_point(point: DVec2) -> DVec2 {
    let square = square_from_disk((point - 0.5) / TUBE_RADIUS);
    (0.5 * square + 0.5).clamp(DVec2::ZERO, DVec2::ONE)
}

/// Root of a sample's weight: as on the square interface, with the disc's share of the area.
pub(crate) fn root_weight(grid: &LightfieldGrid, sample: usize) -> f64 {
    grid.root_weight(sample) * (PI * TUBE_RADIUS * TUBE_RADIUS).sqrt()
}

/// Radiance that leaves a tube through one of its openings when its walls emit the columns of `radiosity`
/// (texels x modes): flux-weighted samples x modes.
pub fn tube_emitted_lightfield(
    grid: &LightfieldGrid,
    form: TubeForm,
    opening: Face,
    radiosity: &Matrix<f64>,
    resolution: usize,
) -> Matrix<f64> {
    let by_texel = radiosity.transposed();
    grid.tabulate(radiosity.columns(), |position, direction, out| {
        let supers = grid.super_directions(direction);
        for &toward in supers {
            let (point, toward) = leaving_ray(opening, grid.position(position), toward);
            let hit = form.first_hit(point, -toward);
            if hit.opening.is_none() {
                let texel = tube_texel_at(form, resolution, hit.point);
                accumulate(&by_texel, &[(texel, 1.0)], 1.0, out);
            }
        }
        let scale = root_weight(grid, direction) / (PI * supers.len() as f64);
        out.iter_mut().for_each(|value| *value *= scale);
    })
}

/// Lightfields (flux-weighted, samples x modes) at the exit of a tube, from those at its entry.
pub fn tube_propagated(
    grid: &LightfieldGrid,
    entering: &Matrix<f64>,
    passage: Passage,
) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, entering);
    grid.tabulate(entering.columns(), |position, direction, out| {
        let supers = grid.super_directions(direction);
        for &toward in supers {
            if let Some((uv, toward)) = passage.trace_back(grid.position(position), toward) {
                accumulate(&by_sample, &grid.taps(uv, toward), 1.0, out);
            }
        }
        let scale = root_weight(grid, direction) / supers.len() as f64;
        out.iter_mut().for_each(|value| *value *= scale);
    })
}

/// Lightfields turned by a quarter about their heading, what was on the left (+u) going up (+v): exact.
///
/// Bends that lead up and down are the bend to the side between two rolls.
pub fn rolled(grid: &LightfieldGrid, lightfields: &Matrix<f64>) -> Matrix<f64> {
    // Value at a turned place is that at the place before: (row, column) came from (n - 1 - column, row).
    let before = |cell: usize, n: usize| (n - 1 - cell % n) * n + cell / n;
    let directions = grid.direction_count();
    let rows: Vec<usize> = (0..grid.sample_count())
        .map(|sample| {
            let (position, direction) = (sample / directions, sample % directions);
            before(position, grid.positions) * directions + before(direction, grid.directions)
        })
        .collect();
    lightfields.selected_rows(&rows)
}

/// Modes x samples, without the flux weight: radiance, contiguous at each sample.
pub(crate) fn radiance_by_sample(grid: &LightfieldGrid, weighted: &Matrix<f64>) -> Matrix<f64> {
    let scales: Vec<f64> = (0..grid.sample_count())
        .map(|sample| 1.0 / root_weight(grid, sample))
        .collect();
    weighted.transposed().scaled_columns(&scales)
}

pub(crate) fn accumulate(by_sample: &Matrix<f64>, taps: &[Tap], scale: f64, out: &mut [f64]) {
    for &(sample, weight) in taps {
        let weight = weight * scale;
        for (value, &radiance) in out.iter_mut().zip(by_sample.column(sample)) {
            *value += weight * radiance;
        }
    }
}

/// Appendix A for the tubes' interfaces: the basis learns what its own modes become on their way straight
/// on, left, right, and turned by a quarter, each group joining with `config.enrichment_weight` of its
/// norm, the turned modes as they are.
///
/// # Errors
/// [`Cancelled`].
pub fn tube_enriched_basis(
    grid: &LightfieldGrid,
    classes: &ParityClasses,
    basis: &ParityBasis,
    config: &LightfieldConfig,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let scaled = basis.vectors.scaled_columns(&basis.scales);
    let mut sent = Vec::with_capacity(2);
    // What goes right is the mirror image of what goes left and in each parity the same up to its sign, so the one
    // stands for both.
    for (passage, share) in [(Passage::STRAIGHT, 1.0), (Passage::LEFT, 2f64.sqrt())] {
        let propagated = tube_propagated(grid, &scaled, passage);
        sent.push(propagated.scaled_columns(&vec![share; scaled.columns()]));
        progress.check()?;
    }
    let norm = root_sum_of_squares(sent.iter().map(Matrix::frobenius_norm));
    let weight = config.enrichment_weight * scaled.frobenius_norm() / norm;
    let mut columns: Vec<Matrix<f64>> = sent
        .into_iter()
        .map(|m| m.scaled_columns(&vec![weight; scaled.columns()]))
        .collect();
    columns.push(scaled);
    // Whatever arrives may arrive rolled.
    let turned: Vec<Matrix<f64>> = columns.iter().map(|m| rolled(grid, m)).collect();
    columns.extend(turned);
    lightfield_basis(classes, &columns, config.lightfield_modes, progress)
}

/// Operators of the round interface in the reduced basis, modes x modes.
#[derive(Clone, Debug)]
pub struct TubeInterface {
    /// Through a straight tube.
    pub straight: Matrix<f64>,
    /// Through a bend to the left of the heading, with v up.
    pub left: Matrix<f64>,
    /// Through a bend to the right.
    pub right: Matrix<f64>,
    /// A quarter turn about the heading that takes left to up ([`rolled`]). Its transpose turns back.
    pub roll: Matrix<f64>,
}

/// Computes propagation and rolls in the reduced basis.
///
/// # Errors
/// [`Cancelled`].
pub fn tube_interface(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    progress: &Progress,
) -> Result<TubeInterface, Cancelled> {
    let through = |passage| {
        progress.check()?;
        let sent = tube_propagated(grid, &basis.vectors, passage);
        Ok(lightfield_coefficients(basis, &sent))
    };
    let straight = through(Passage::STRAIGHT)?;
    let left = through(Passage::LEFT)?;
    // The mirror of u changes the sign of odd modes and exchanges left and right.
    let sign = |mode: usize| {
        if basis.parity[mode] & 1 == 1 {
            -1.0
        } else {
            1.0
        }
    };
    let right = Matrix::from_fn(left.rows(), left.columns(), |i, j| {
        left[(i, j)] * sign(i) * sign(j)
    });
    Ok(TubeInterface {
        straight,
        left,
        right,
        roll: lightfield_coefficients(basis, &rolled(grid, &basis.vectors)),
    })
}

#[cfg(test)]
mod tests;
