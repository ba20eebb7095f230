//! The layout of texels in a frame's memory. Blocks of one shape follow each other, and each texel has a **slot** in
//! its block. The three colour channels are stored apart.

use crate::level::block_index::BlockIndex;
use glam::Vec3;
use mrt_core::simd::Aligned;
use std::ops::Range;

/// A block by its position in a [`TexelLayout`]: the order in which frames store blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockRank(u32);

impl BlockRank {
    /// The block at `position`, which must be below `u32::MAX`, as it is in every level.
    pub const fn new(position: usize) -> Self {
        Self(position as u32)
    }

    /// Position of the block in the layout.
    pub const fn get(self) -> usize {
        self.0 as usize
    }
}

/// The order in which frames store blocks, and the slots of their texels.
///
/// Blocks of one shape follow each other, so that the operators of the shape stay in the cache from block to block.
#[derive(Clone, Debug, PartialEq)]
pub struct TexelLayout {
    /// By rank: the index of the block in the level.
    pub order: Vec<BlockIndex>,
    /// By index in the level: the rank of the block.
    pub rank: Vec<BlockRank>,
    /// By rank: the block's slots.
    pub slots: Vec<Range<usize>>,
    /// By rank: the index of the block's shape in the lists of the scene and in the two lists below.
    pub shapes: Vec<u32>,
    /// By shape: for each texel, its first slot within the block.
    pub slot_of_texel: Vec<Vec<u32>>,
    /// By shape: for each slot of the block, its texel; `u32::MAX` for a slot without a texel. A texel on the plane of
    /// a mirror of the shape has several slots.
    pub texel_of_slot: Vec<Vec<u32>>,
}

impl TexelLayout {
    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.order.len()
    }

    /// Ranks of all blocks, ascending.
    pub fn ranks(&self) -> impl Iterator<Item = BlockRank> + use<> {
        (0..self.order.len()).map(BlockRank::new)
    }

    /// Number of slots.
    pub fn slot_count(&self) -> usize {
        self.slots.last().map_or(0, |range| range.end)
    }

    /// Number of slots of the block that has the most.
    pub fn most_slots(&self) -> usize {
        self.slots.iter().map(Range::len).max().unwrap_or(0)
    }

    /// Number of texels.
    pub fn texel_count(&self) -> usize {
        let texels = |&shape: &u32| self.slot_of_texel[shape as usize].len();
        self.shapes.iter().map(texels).sum()
    }

    /// Index of a block's shape in the lists of the scene.
    pub fn shape(&self, rank: BlockRank) -> usize {
        self.shapes[rank.get()] as usize
    }

    /// The slots of a block.
    pub fn slots(&self, rank: BlockRank) -> Range<usize> {
        self.slots[rank.get()].clone()
    }

    /// Slots of all blocks whose ranks are in `span`, which must not be empty.
    pub(crate) fn slots_of_span(&self, span: &Range<usize>) -> Range<usize> {
        self.slots[span.start].start..self.slots[span.end - 1].end
    }

    /// The slot of a texel of a block, counted over all blocks; `None` if there is no such block or texel.
    pub fn slot(&self, block: BlockIndex, texel: usize) -> Option<usize> {
        let &rank = self.rank.get(block.get())?;
        let slot = *self.slot_of_texel[self.shape(rank)].get(texel)?;
        Some(self.slots[rank.get()].start + slot as usize)
    }

    /// Replaces `out` by a signal in the level's order: block by block, in a block channel by channel, in a channel
    /// texel by texel.
    pub(crate) fn copy_by_texel(&self, signal: &Planes, out: &mut Vec<f32>) {
        out.clear();
        for &rank in &self.rank {
            let map = &self.slot_of_texel[self.shape(rank)];
            for channel in signal.block(self.slots(rank)) {
                out.extend(map.iter().map(|&slot| channel[slot as usize]));
            }
        }
    }
}

/// Positions and normals of the texels of a level, by slot. A slot without a texel has the middle of its block as its
/// position, and the normal 0.
#[derive(Clone, Debug)]
pub struct TexelGeometry {
    /// World positions, metres.
    pub positions: Planes,
    /// Unit normals into the blocks; zero in slots without a texel.
    pub normals: Planes,
}

/// Three numbers for each slot, stored as three channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    values: Aligned<f32>,
    slots: usize,
}

impl Planes {
    /// Zeros in `slots` slots.
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            values: Aligned::zeroed(3 * slots),
            slots,
        }
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// The three channels of all slots.
    pub(crate) fn channels(&self) -> [&[f32]; 3] {
        self.block(0..self.slots)
    }

    /// The three channels of a range of slots.
    pub fn block(&self, slots: Range<usize>) -> [&[f32]; 3] {
        std::array::from_fn(|c| &self.values[c * self.slots..(c + 1) * self.slots][slots.clone()])
    }

    /// Sets all numbers to 0.
    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// The three channels of all slots, to write.
    pub(crate) fn channels_mut(&mut self) -> [&mut [f32]; 3] {
        let (first, rest) = self.values.split_at_mut(self.slots);
        let (second, third) = rest.split_at_mut(self.slots);
        [first, second, third]
    }

    /// The three channels of a range of slots, to write.
    pub(crate) fn block_mut(&mut self, slots: Range<usize>) -> [&mut [f32]; 3] {
        self.channels_mut()
            .map(|channel| &mut channel[slots.clone()])
    }

    /// The three numbers of a slot.
    pub(crate) fn get(&self, slot: usize) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|c| self.values[c * self.slots + slot]))
    }

    /// The common value of all slots with a texel; `None` if they differ.
    pub(crate) fn uniform(&self, slots: Range<usize>, texel_of_slot: &[u32]) -> Option<Vec3> {
        let texels = slots
            .zip(texel_of_slot)
            .filter(|&(_, &texel)| texel != u32::MAX);
        let mut values = texels.map(|(slot, _)| self.get(slot));
        let first = values.next()?;
        values.all(|value| value == first).then_some(first)
    }

    /// Sets the three numbers of a slot.
    pub(crate) fn set(&mut self, slot: usize, value: Vec3) {
        for (c, x) in value.to_array().into_iter().enumerate() {
            self.values[c * self.slots + slot] = x;
        }
    }
}
