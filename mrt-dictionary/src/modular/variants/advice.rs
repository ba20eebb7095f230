//! Which transport each block of a level needs: the measured error of its warp against the error that is accepted.

use crate::modular::surface::walls::warped::WarpedWalls;
use crate::modular::variants::build::VariantError;
use crate::modular::variants::warp_error::{CanonicalOperators, WarpError, warp_error};
use crate::progress::Progress;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::{Shape, WarpTransport};
use mrt_runtime::low_level::level::warp_form::{WarpForm, form_of, same_form, warp_of};
use mrt_runtime::{Dictionary, Level};

/// Expected errors of a block's light: the first bounce within the block, relative L2 (0.1 is 10 %).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockEstimate {
    /// The error with each of [`WarpTransport::ALL`]. A rebuilt block is assumed to err by as much as its shape does as a
    /// cube; the table of docs/WARPS.md has measured errors.
    pub expected: [f64; 3],
    /// Relative error of the mean irradiance with the first two transports.
    pub expected_level: [f64; 2],
    /// Longest over shortest edge.
    pub stretch: f64,
}

/// Errors that a warp may add before a block gets better operators. Squares of errors add up: the shape's own and the
/// warp's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Canonical operators that err by more than this are re-gathered.
    pub regather: f64,
    /// Where re-gathered operators err by more than this, they are rebuilt.
    pub rebuild: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            regather: 0.08,
            rebuild: 0.15,
        }
    }
}

impl BlockEstimate {
    /// The error that the warp adds to the shape's own.
    pub fn added(&self, transport: WarpTransport) -> f64 {
        let own = self.expected[WarpTransport::Rebuilt as usize];
        let found = self.expected[transport as usize];
        (found * found - own * own).max(0.0).sqrt()
    }

    /// The cheapest transport within the thresholds.
    pub fn advice(&self, thresholds: &Thresholds) -> WarpTransport {
        if self.added(WarpTransport::Canonical) <= thresholds.regather {
            WarpTransport::Canonical
        } else if self.added(WarpTransport::Regathered) <= thresholds.rebuild {
            WarpTransport::Regathered
        } else {
            WarpTransport::Rebuilt
        }
    }
}

/// Every seventh texel is measured: a prime, which shares no factor with the resolutions of the presets.
const STRIDE: usize = 7;

/// Estimates every block of a level; blocks of one form are measured once.
///
/// Cost: [`warp_error`] for each form, 0.03 s at 16² on two cores.
///
/// # Errors
/// [`VariantError`].
pub fn estimate_blocks(
    level: &Level,
    dictionary: &Dictionary,
    progress: &Progress,
) -> Result<Vec<BlockEstimate>, VariantError> {
    let mut known: Vec<Known> = Vec::new();
    // Errors of shapes that are not warped.
    let mut cubes: Vec<(&Shape, f64)> = Vec::new();
    let mut estimates = Vec::with_capacity(level.blocks.len());
    for (index, block) in level.blocks.iter().enumerate() {
        let shape = block.shape;
        let form = form_of(block);
        let is_same = |other: &&Known| other.shape == shape && same_form(&other.form, &form);
        if let Some(known) = known.iter().find(is_same) {
            estimates.push(known.estimate);
            continue;
        }
        progress.step("measuring blocks", index, level.blocks.len())?;
        let measure = |warp: &Hexahedron| measure(dictionary, index, shape, warp);
        let own = match cubes.iter().find(|(other, _)| *other == shape) {
            Some(&(_, own)) => own,
            None => {
                let own = measure(&Hexahedron::cell(DVec3::ZERO))?.reused;
                cubes.push((shape, own));
                own
            }
        };
        let found = measure(&warp_of(&form))?;
        let estimate = BlockEstimate {
            expected: [found.reused, found.regathered, own],
            expected_level: [found.reused_level, found.regathered_level],
            stretch: stretch(&block.warp),
        };
        known.push(Known {
            shape,
            form,
            estimate,
        });
        estimates.push(estimate);
    }
    Ok(estimates)
}

/// The estimate of a shape and form that was measured already.
struct Known {
    shape: &'static Shape,
    form: WarpForm,
    estimate: BlockEstimate,
}

/// The error of a block's shape under a warp.
fn measure(
    dictionary: &Dictionary,
    block: usize,
    shape: &'static Shape,
    warp: &Hexahedron,
) -> Result<WarpError, VariantError> {
    let position = dictionary
        .shape_index(shape)
        .ok_or(VariantError::MissingShape {
            block,
            shape: shape.name,
        })?;
    let entry = &dictionary.shapes[position];
    // Round tubes have canonical operators only, so there is nothing to choose.
    if shape.wall_count() == 0 || shape.tube().is_some() {
        return Ok(WarpError {
            reused: 0.0,
            regathered: 0.0,
            reused_level: 0.0,
            regathered_level: 0.0,
        });
    }
    if entry.implicit_lighting.rows() != shape.texel_count(dictionary.resolution) {
        return Err(VariantError::NoSources {
            found: "implicit lighting",
        });
    }
    let faces: Vec<Face> = shape.walls().collect();
    let walls = WarpedWalls::new(&faces, dictionary.resolution, warp);
    let coefficients: Matrix<f64> = entry.coefficients_from_direct.cast();
    let indirect: Matrix<f64> = entry.joint_basis.leading_columns(entry.modes()).cast();
    let implicit: Matrix<f64> = entry.implicit_lighting.cast();
    let canonical = CanonicalOperators {
        coefficients_from_direct: &coefficients,
        indirect_basis: &indirect,
        implicit_lighting: &implicit,
    };
    Ok(warp_error(&walls, &canonical, STRIDE))
}

/// Longest over shortest of a block's three mean edges.
pub fn stretch(warp: &Hexahedron) -> f64 {
    let jacobian = warp.jacobian(DVec3::splat(0.5));
    let lengths = [0, 1, 2].map(|axis| jacobian.col(axis).length());
    let longest = lengths.iter().fold(0.0f64, |m, &x| m.max(x));
    longest / lengths.iter().fold(f64::MAX, |m, &x| m.min(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_is_the_cheapest_within_the_thresholds() {
        let estimate = |canonical: f64, regathered: f64| BlockEstimate {
            expected: [canonical, regathered, 0.05],
            expected_level: [0.0; 2],
            stretch: 1.0,
        };
        let advice = |a, b| estimate(a, b).advice(&Thresholds::default());
        assert_eq!(advice(0.05, 0.05), WarpTransport::Canonical);
        // 0.09² = 0.05² + 0.0748²
        assert_eq!(advice(0.09, 0.06), WarpTransport::Canonical);
        assert_eq!(advice(0.3, 0.1), WarpTransport::Regathered);
        assert_eq!(advice(0.5, 0.2), WarpTransport::Rebuilt);
        // Rounding may make a cube err by less than itself.
        assert_eq!(advice(0.049, 0.05), WarpTransport::Canonical);
    }
}
