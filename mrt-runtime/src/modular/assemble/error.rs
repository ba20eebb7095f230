//! Why assembly fails.

use crate::level::error::LevelError;
use crate::modular::assemble::config::MAX_DEPTH;
use mrt_core::geometry::cube::Face;

/// Why a level and a dictionary do not make a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AssembleError {
    /// The level itself is refused.
    #[error(transparent)]
    Level(#[from] LevelError),
    /// The dictionary has no operators for a shape that the level uses.
    #[error("block {block}: the dictionary has no shape `{shape}`; it has {expected}")]
    MissingShape {
        /// Which block.
        block: usize,
        /// The shape of the block.
        shape: &'static str,
        /// Names of the shapes in the dictionary.
        expected: String,
    },
    /// The dictionary was packed for a level without a path that this level has.
    #[error(
        "block {block}: light that leaves through face {face} goes the way `{word}`, for which the dictionary has \
         no operator; expected a dictionary that was packed for this level"
    )]
    MissingPath {
        /// The block where the path starts.
        block: usize,
        /// The first face that the path crosses, after orientation.
        face: Face,
        /// [`Word::name`](crate::modular::path::Word::name) of the path.
        word: String,
    },
    /// The level needs lightfields, and the dictionary has none.
    #[error(
        "the level joins blocks by lightfields; found none in the dictionary, expected a dictionary with lightfields"
    )]
    MissingLightfields,
    /// A block asks for operators made for its warp, and the dictionary has none for its form.
    #[error(
        "block {block}: the dictionary has no {transport} operators for its shape `{shape}` in this form; expected \
         a dictionary adapted to this level, or the transport \"canonical\""
    )]
    MissingVariant {
        /// Which block.
        block: usize,
        /// Shape of the block.
        shape: &'static str,
        /// [`WarpTransport::name`](crate::level::warp_transport::WarpTransport::name) of the operators that it asks
        /// for.
        transport: &'static str,
    },
    /// [`AssembleConfig::max_depth`](crate::modular::assemble::config::AssembleConfig::max_depth) exceeds
    /// [`MAX_DEPTH`].
    #[error("light may cross {found} openings; expected at most {MAX_DEPTH}")]
    Depth {
        /// The depth given.
        found: usize,
    },
    /// [`AssembleConfig::negligible`](crate::modular::assemble::config::AssembleConfig::negligible) is not in [0, 1).
    #[error(
        "a share of {found} of light may be left out; expected one from 0 to below 1 (AssembleConfig::negligible)"
    )]
    Negligible {
        /// The share given.
        found: f32,
    },
    /// The scene would take more bytes than allowed.
    #[error(
        "the scene needs over {found} bytes; expected at most {expected} (AssembleConfig::max_bytes)"
    )]
    TooLarge {
        /// [`AssembleConfig::max_bytes`](crate::modular::assemble::config::AssembleConfig::max_bytes).
        expected: usize,
        /// Bytes that the scene takes at least.
        found: usize,
    },
    /// The up directions of two joined openings are turned or mirrored against each other in a way that the dictionary
    /// does not support.
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
        /// Direction of the other block's +y in this block's canonical cube.
        found: String,
    },
}
