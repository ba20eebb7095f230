//! Operators between the round openings of tubes (Loos et al. 2011, sections 5.1
//! and 6.1): what a tube sends out, and how lightfields pass through tubes.
//!
//! The canonical interface is the same as for cubes, the face z = 0 crossed towards +z with v up. Its grid of samples
//! differs only in its positions ([`LightfieldGrid::on_discs`]).

use crate::config::LightfieldConfig;
use crate::matrix_parts::{root_sum_of_squares, scaled};
use crate::modular::lightfield::basis::{lightfield_basis, lightfield_coefficients};
use crate::modular::lightfield::grid::{LightfieldGrid, turn_to_heading};
use crate::modular::lightfield::symmetries::rolled;
use crate::modular::lightfield::transfer::{emitted, propagated};
use crate::modular::surface::walls::tube::TubeWall;
use crate::progress::{Cancelled, Progress};
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use mrt_core::lighting::sampling::{disk_from_square, square_from_disk, square_from_unit};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity_modes::ParityBasis;

/// A way through a tube, from one of its openings to the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TubePassage {
    /// The tube.
    pub form: TubeForm,
    /// Where light enters.
    pub entry: Face,
    /// Where it leaves.
    pub exit: Face,
}

impl TubePassage {
    /// Straight on.
    pub const STRAIGHT: TubePassage = TubePassage {
        form: TubeForm::Straight,
        entry: Face::NegX,
        exit: Face::PosX,
    };
    /// Through a bend, to the left of the heading with +y up.
    pub const LEFT: TubePassage = TubePassage {
        form: TubeForm::Bend,
        entry: Face::PosX,
        exit: Face::PosZ,
    };
    /// To the right: the same bend from its other end.
    pub const RIGHT: TubePassage = TubePassage {
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
        let frame = turn_to_heading(self.entry.opposite()).inverse();
        let uv = uv_of_point(frame.point(hit.point).truncate());
        Some((uv, frame.direction(direction)))
    }
}

/// The ray of an opening's frame that leaves through (u, v), in the tube's coordinates.
pub(crate) fn leaving_ray(opening: Face, uv: DVec2, direction: DVec3) -> (DVec3, DVec3) {
    let frame = turn_to_heading(opening);
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

/// Radiance that leaves a tube through one of its openings when its walls emit the columns of `radiosity`
/// (texels x modes): flux-weighted samples x modes.
pub fn tube_emitted_lightfield(
    grid: &LightfieldGrid,
    wall: &TubeWall,
    opening: Face,
    radiosity: &Matrix<f64>,
) -> Matrix<f64> {
    emitted(grid, radiosity, |uv, toward| {
        let (point, toward) = leaving_ray(opening, uv, toward);
        let hit = wall.form.first_hit(point, -toward);
        match hit.opening {
            None => Some(wall.texel_at(hit.point)),
            Some(_) => None,
        }
    })
}

/// Lightfields (flux-weighted, samples x modes) at the exit of a tube, from those at its entry.
pub fn tube_propagated(
    grid: &LightfieldGrid,
    entering: &Matrix<f64>,
    passage: TubePassage,
) -> Matrix<f64> {
    propagated(grid, entering, |uv, toward| passage.trace_back(uv, toward))
}

/// Appendix A for the tubes' interfaces: the basis learns what its own modes become on their way straight
/// on, left and right, and all of that turned by a quarter.
///
/// What was sent joins with `config.enrichment_weight` of the modes' norm.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn tube_enriched_basis(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    config: &LightfieldConfig,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let own = basis.vectors.scaled_columns(&basis.scales);
    let mut sent = Vec::with_capacity(2);
    // What goes right is the mirror image of what goes left, and in each parity the same up to its sign. So the one
    // stands for both.
    for (passage, share) in [
        (TubePassage::STRAIGHT, 1.0),
        (TubePassage::LEFT, 2f64.sqrt()),
    ] {
        sent.push(scaled(&tube_propagated(grid, &own, passage), share));
        progress.check()?;
    }
    let norm = root_sum_of_squares(sent.iter().map(Matrix::frobenius_norm));
    let weight = config.enrichment_weight * own.frobenius_norm() / norm;
    let mut columns: Vec<Matrix<f64>> = sent.iter().map(|m| scaled(m, weight)).collect();
    columns.push(own);
    // Whatever arrives may arrive rolled.
    let turned: Vec<Matrix<f64>> = columns.iter().map(|m| rolled(grid, m)).collect();
    columns.extend(turned);
    lightfield_basis(grid, &columns, config.lightfield_modes, progress)
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
/// [`Cancelled`], if the caller has asked to stop.
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
    let straight = through(TubePassage::STRAIGHT)?;
    let left = through(TubePassage::LEFT)?;
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
