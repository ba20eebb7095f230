//! What assembly refuses.

use crate::level::error::LevelError;
use crate::modular::assemble::config::MAX_DEPTH;
use mrt_core::geometry::cube::Face;

/// Why a level and a dictionary do not make a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AssembleError {
    /// The level itself is at fault.
    #[error(transparent)]
    Level(#[from] LevelError),
    /// The dictionary was packed without a shape that the level uses.
    #[error("block {block}: the dictionary has no shape `{shape}`; it has {expected}")]
    MissingShape {
        /// Which block.
        block: usize,
        /// The shape that it uses.
        shape: &'static str,
        /// Shapes in the dictionary.
        expected: String,
    },
    /// The dictionary was packed for levels without such a path.
    #[error(
        "block {block}: light that leaves through face {face} goes the way `{word}`, for which the dictionary has \
         no operator; expected a dictionary that was packed for this level"
    )]
    MissingPath {
        /// Where it comes from.
        block: usize,
        /// The first face that it crosses, after orientation.
        face: Face,
        /// The path, as [`Word::name`](crate::modular::path::Word::name) writes it.
        word: String,
    },
    /// The dictionary was packed without lightfields, or has neither these nor a path table.
    #[error(
        "the level joins blocks by lightfields; found none in the dictionary, expected a dictionary with lightfields"
    )]
    MissingLightfields,
    /// A block wants operators for its warp that nobody has made.
    #[error(
        "block {block}: the dictionary has no {transport} operators for its shape `{shape}` in this form; expected \
         a dictionary adapted to this level, or the transport \"canonical\""
    )]
    MissingVariant {
        /// Which block.
        block: usize,
        /// Its shape.
        shape: &'static str,
        /// [`WarpTransport::name`](crate::level::warp_transport::WarpTransport::name) of what it wants.
        transport: &'static str,
    },
    /// More openings than paths are followed through.
    #[error("light may cross {found} openings; expected at most {MAX_DEPTH}")]
    Depth {
        /// The depth given.
        found: usize,
    },
    /// A share of light to be left out that is not in [0, 1).
    #[error(
        "a share of {found} of light may be left out; expected one from 0 to below 1 (AssembleConfig::negligible)"
    )]
    Negligible {
        /// The share given.
        found: f32,
    },
    /// The operators would not fit.
    #[error(
        "the scene needs over {found} bytes; expected at most {expected} (AssembleConfig::max_bytes)"
    )]
    TooLarge {
        /// [`AssembleConfig::max_bytes`](crate::modular::assemble::config::AssembleConfig::max_bytes).
        expected: usize,
        /// What it takes at least.
        found: usize,
    },
    /// Two openings meet with their up directions turned or mirrored against each other.
    #[error(
        "face {face} of block {block} meets face {other_face} of block {other} with its up direction \
         towards {found}; expected +y, or -y where neither is a hole (turn one block, or use a dictionary with \
         vertical openings, such as the set cubes-3d)"
    )]
    RolledInterface {
        /// One block.
        block: usize,
        /// Its face, after orientation.
        face: Face,
        /// The other block.
        other: usize,
        /// Its face, after orientation.
        other_face: Face,
        /// Where the other block's +y points in this block's canonical cube.
        found: String,
    },
}
