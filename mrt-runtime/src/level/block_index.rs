//! The index of a block in its level.

use std::fmt;

/// A block by its position in [`Level::blocks`](crate::level::block::Level::blocks).
///
/// Frames store blocks in another order, which [`BlockRank`](crate::output::texel_layout::BlockRank) counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockIndex(u32);

impl BlockIndex {
    /// The block at `position`. Positions from `u32::MAX` on become `u32::MAX`, which no level has a block at.
    pub const fn new(position: usize) -> Self {
        if position < u32::MAX as usize {
            Self(position as u32)
        } else {
            Self(u32::MAX)
        }
    }

    /// Position of the block in its level.
    pub const fn get(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for BlockIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
