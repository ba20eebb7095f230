//! Blocks of a level by their position.

use std::fmt;

/// A block by its position in [`Level::blocks`](crate::level::block::Level::blocks).
///
/// Frames keep blocks in another order, that of [`BlockRank`](crate::output::texel_layout::BlockRank).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockIndex(u32);

impl BlockIndex {
    /// The block at this position; positions beyond `u32::MAX` stand for no block of any level.
    pub const fn new(position: usize) -> Self {
        if position < u32::MAX as usize {
            Self(position as u32)
        } else {
            Self(u32::MAX)
        }
    }

    /// Its position in the level.
    pub const fn get(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for BlockIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
