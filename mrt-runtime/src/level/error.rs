//! Why a level is refused, and the limits that it must keep.

use crate::light::limits::MAX_LIGHT_VALUE;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::HexahedronError;

/// Corners of joined faces may be this far apart, as a fraction of the smaller block's diagonal.
pub const JOIN_TOLERANCE: f64 = 1e-3;

/// Largest coordinate of a block, in diagonals of that block. Texel positions in `f32` are then good to a thousandth of
/// the diagonal, a fortieth of a texel at 16² texels a wall.
pub const FAR_LIMIT: f64 = 1e4;

/// Two blocks may enter each other by this fraction of the smaller one's diagonal before they count as overlapping.
pub const OVERLAP_TOLERANCE: f64 = 1e-2;

/// Why a level is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevelError {
    /// The level has no block.
    #[error("the level has no block; expected at least one")]
    Empty,
    /// The level has more blocks than [`MAX_BLOCKS`](crate::level::block::MAX_BLOCKS).
    #[error("the level has {found} blocks; expected at most {expected}")]
    TooManyBlocks {
        /// Most blocks accepted.
        expected: usize,
        /// Blocks in the level.
        found: usize,
    },
    /// The eight corners of a block do not make a warped cube.
    #[error("block {block}: {source}")]
    Warp {
        /// Which block.
        block: usize,
        /// What is wrong with the corners.
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
    /// An emission is NaN, negative or above [`MAX_LIGHT_VALUE`].
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
    /// The scale of the level's mesh is not a positive number.
    #[error("the level's mesh has {found} metres per unit; expected a positive number")]
    MeshScale {
        /// The scale there.
        found: f64,
    },
    /// The origin in the level's mesh is NaN or infinite.
    #[error("the level's mesh has its origin at {found} m; expected three finite numbers")]
    MeshOrigin {
        /// The origin there.
        found: DVec3,
    },
    /// A door names no connection or one that has a door already, or its value is not in [0, 1].
    #[error(
        "door {door}: connection {connection}, value {found}; expected one of {count} connections, each with \
         one door at most, and a value in [0, 1]"
    )]
    Door {
        /// Which door.
        door: usize,
        /// The connection that the door names.
        connection: usize,
        /// Number of connections.
        count: usize,
        /// Value of the door.
        found: f32,
    },
    /// Two joined openings have different outlines.
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
        /// Outline in the other face.
        expected: String,
        /// Outline in the face.
        found: String,
    },
    /// A connection names a block that does not exist.
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
        /// Shape of the block.
        shape: &'static str,
    },
    /// An opening is connected more than once, or to itself.
    #[error("opening {face} of block {block} is in {found} connections; expected at most one")]
    ConnectedTwice {
        /// Which block.
        block: usize,
        /// Which face of it.
        face: Face,
        /// Connections that name the opening.
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
    /// The bounding boxes of blocks overlap so many others that telling whether the blocks do would take too long.
    #[error(
        "blocks are packed so that telling whether they overlap takes over {expected} comparisons a block; \
         expected fewer"
    )]
    TooCrowded {
        /// Most comparisons made, for each block.
        expected: usize,
    },
    /// A block is too far from the origin for positions in single precision.
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
