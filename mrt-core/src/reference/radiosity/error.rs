//! Why a level cannot be solved exactly.

use crate::geometry::cube::Face;
use crate::geometry::hexahedron::HexahedronError;

/// Why a level cannot be solved exactly.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExactError {
    /// There is not one set of sides for each block.
    #[error("there are {found} sets of sides; expected {expected}, one for each block")]
    SideCount {
        /// Number of blocks.
        expected: usize,
        /// Number of sets of sides.
        found: usize,
    },
    /// The level has no texel, or too many.
    #[error("the level has {found} texels; expected 1 to {expected}")]
    TexelCount {
        /// Largest number that is accepted.
        expected: usize,
        /// Resolution squared times the number of walls.
        found: usize,
    },
    /// The corners of a block are not the image of a cube.
    #[error("block {block}: {source}")]
    Warp {
        /// Index of the block.
        block: usize,
        /// What is wrong with the block.
        source: HexahedronError,
    },
    /// A cell is listed twice.
    #[error("cell {cell:?} is listed twice; expected each cell once")]
    DuplicateCell {
        /// Its coordinates.
        cell: [i32; 3],
    },
    /// An opening leads to a block that does not exist, or whose face does not open back.
    #[error(
        "block {block} opens at {face} to face {other_face} of block {other}; expected that face to \
         open back to it"
    )]
    OneWayOpening {
        /// Index of the block.
        block: usize,
        /// Its face.
        face: Face,
        /// The block it names.
        other: usize,
        /// The face it names.
        other_face: Face,
    },
    /// Two joined faces are not the same quadrilateral.
    #[error(
        "block {block} at {face} and block {other} miss each other by {found:.3e}; expected the same \
         four corners"
    )]
    CornersApart {
        /// Index of the block.
        block: usize,
        /// Its face.
        face: Face,
        /// The block behind the opening.
        other: usize,
        /// Largest distance from a corner to the nearest corner of the other face.
        found: f64,
    },
    /// An input vector has the wrong length.
    #[error("{what} has {found} values; expected {expected}")]
    Length {
        /// Which input.
        what: &'static str,
        /// Number of values needed.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// An albedo is NaN, negative or above 1, or not below 1 where all bounces are asked for.
    #[error("the albedo of {at} is {found}; expected at least 0 and {bound}")]
    Albedo {
        /// Which surface, as in "texel 17".
        at: String,
        /// "at most 1" or "below 1 for all bounces".
        bound: &'static str,
        /// The albedo given.
        found: f64,
    },
    /// The solution for all bounces did not reach its tolerance.
    #[error("all bounces converged to {found:.1e} in {steps} steps; expected {expected:.1e}")]
    NotConverged {
        /// Relative residual asked for.
        expected: f64,
        /// Relative residual reached.
        found: f64,
        /// Number of products with the operator.
        steps: usize,
    },
}

/// Refuses an input vector of the wrong length.
pub(super) fn check_length(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), ExactError> {
    if expected == found {
        Ok(())
    } else {
        Err(ExactError::Length {
            what,
            expected,
            found,
        })
    }
}
