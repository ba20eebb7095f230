//! What is wrong with a level, and the limits behind it.

use crate::light::limits::MAX_LIGHT_VALUE;
use glam::Vec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::HexahedronError;

/// Corners of joined faces must meet within this fraction of the block's diagonal.
pub const JOIN_TOLERANCE: f64 = 1e-3;

/// Coordinates may be at most this many diagonals of a block: texel positions in `f32` are then good to a
/// thousandth of it, a fortieth of a texel at 16².
pub const FAR_LIMIT: f64 = 1e4;

/// Blocks may enter each other by this fraction of their smaller diagonal before they overlap.
pub const OVERLAP_TOLERANCE: f64 = 1e-2;

/// What is wrong with a level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevelError {
    /// No block at all.
    #[error("the level has no block; expected at least one")]
    Empty,
    /// Above [`MAX_BLOCKS`].
    #[error("the level has {found} blocks; expected at most {expected}")]
    TooManyBlocks {
        /// [`MAX_BLOCKS`].
        expected: usize,
        /// Blocks in the level.
        found: usize,
    },
    /// The eight corners are not the image of a cube.
    #[error("block {block}: {source}")]
    Warp {
        /// Which block.
        block: usize,
        /// What is wrong with it.
        source: HexahedronError,
    },
    /// An albedo is NaN, negative or above one.
    #[error("block {block}, face {face}: albedo {found}; expected three values in [0, 1]")]
    Albedo {
        /// Which block.
        block: usize,
        /// Which face.
        face: Face,
        /// The albedo there.
        found: Vec3,
    },
    /// An emission is NaN, negative or absurd.
    #[error(
        "block {block}, face {face}: emission {found}; expected three values in [0, {MAX_LIGHT_VALUE:e}]"
    )]
    Emission {
        /// Which block.
        block: usize,
        /// Which face.
        face: Face,
        /// The emission there.
        found: Vec3,
    },
    /// A door is nowhere, or not a fraction.
    #[error(
        "door {door}: connection {connection}, value {found}; expected one of {count} connections, each with \
         one door at most, and a value in [0, 1]"
    )]
    Door {
        /// Which door.
        door: usize,
        /// The connection that it names.
        connection: usize,
        /// Number of connections.
        count: usize,
        /// Its value.
        found: f32,
    },
    /// Two openings meet whose outlines differ.
    #[error(
        "face {face} of block {block} has {found}, and face {other_face} of block {other} {expected}; expected \
         the same on both sides"
    )]
    OutlineMismatch {
        /// One block.
        block: usize,
        /// Its face.
        face: Face,
        /// The other block.
        other: usize,
        /// Its face.
        other_face: Face,
        /// What the other face has.
        expected: String,
        /// What the face has.
        found: String,
    },
    /// A connection names a block that is not there.
    #[error("connection {connection}: block {found}; expected an index below {expected}")]
    NoSuchBlock {
        /// Which connection.
        connection: usize,
        /// Number of blocks.
        expected: usize,
        /// The index given.
        found: usize,
    },
    /// A connection names a face that is a wall.
    #[error(
        "connection {connection}: face {face} of block {block} is a wall of shape `{shape}` in its \
         orientation; expected an opening"
    )]
    NotAnOpening {
        /// Which connection.
        connection: usize,
        /// Which block.
        block: usize,
        /// Which face of it.
        face: Face,
        /// Its shape.
        shape: &'static str,
    },
    /// An opening is connected more than once, or to itself.
    #[error("opening {face} of block {block} is in {found} connections; expected at most one")]
    ConnectedTwice {
        /// Which block.
        block: usize,
        /// Which face of it.
        face: Face,
        /// Connections that name it.
        found: usize,
    },
    /// The corners of two joined faces are in different places.
    #[error(
        "face {face} of block {block} and face {other_face} of block {other}: corners are up to \
         {found:.4} m apart; expected at most {expected:.4} m"
    )]
    InterfaceMismatch {
        /// One block.
        block: usize,
        /// Its face.
        face: Face,
        /// The other block.
        other: usize,
        /// Its face.
        other_face: Face,
        /// Largest distance accepted, metres.
        expected: f64,
        /// Largest distance between corners that should meet, metres.
        found: f64,
    },
    /// Blocks whose bounding boxes overlap one another by the hundred.
    #[error(
        "blocks are packed so that each bounding box meets over {expected} others; expected fewer"
    )]
    TooCrowded {
        /// Pairs a block that are tested.
        expected: usize,
    },
    /// Too far from the origin for positions in single precision.
    #[error(
        "block {block}: a corner is {found:.3e} m from the origin along an axis; expected at most \
         {expected:.3e} m, {FAR_LIMIT:.0e} of the block's diagonals"
    )]
    TooFar {
        /// Which block.
        block: usize,
        /// Largest coordinate accepted, metres.
        expected: f64,
        /// Largest coordinate, metres.
        found: f64,
    },
    /// Two blocks share a volume.
    #[error("blocks {a} and {b} overlap by {found:.4} m; expected at most {expected:.4} m")]
    Overlap {
        /// One block.
        a: usize,
        /// The other.
        b: usize,
        /// Largest depth accepted, metres.
        expected: f64,
        /// Depth along the direction that separates them best, metres.
        found: f64,
    },
}
