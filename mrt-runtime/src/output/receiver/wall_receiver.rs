//! A point of a block's wall.

use crate::level::block_index::BlockIndex;
use glam::DVec3;
use mrt_core::geometry::cube::Face;

/// The point of a block's wall that a point of a mesh takes its indirect light from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallReceiver {
    /// Which block.
    pub block: BlockIndex,
    /// A wall of the block's canonical shape.
    pub face: Face,
    /// Along the face's u axis, in [0, 1].
    pub u: f64,
    /// Along the face's v axis, in [0, 1].
    pub v: f64,
}

impl WallReceiver {
    /// The point of a flat face that lies nearest to a point of the unit cube.
    pub(super) fn on_face(block: usize, face: Face, unit: DVec3) -> Self {
        Self {
            block: BlockIndex::new(block),
            face,
            u: unit[face.u_axis()],
            v: unit[face.v_axis()],
        }
    }
}
