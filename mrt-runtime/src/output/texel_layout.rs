//! Where frames keep the texels of a level: blocks of one shape one after another, each texel in a **slot**, channels apart.

use crate::level::block_index::BlockIndex;
use glam::Vec3;
use mrt_core::simd::Aligned;
use std::ops::Range;

/// A block by its position in a [`TexelLayout`], which is how frames count blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockRank(u32);

impl BlockRank {
    /// The block at this position of a layout, of which levels have fewer than `u32::MAX`.
    pub const fn new(position: usize) -> Self {
        Self(position as u32)
    }

    /// Its position in the layout.
    pub const fn get(self) -> usize {
        self.0 as usize
    }
}

/// The order in which frames keep blocks, and the slots of their texels.
///
/// Blocks of one shape stand one after another, so that a shape's operators stay in the cache from block to block.
#[derive(Clone, Debug, PartialEq)]
pub struct TexelLayout {
    /// By rank: the block of the level.
    pub order: Vec<BlockIndex>,
    /// By block of the level: its rank.
    pub rank: Vec<BlockRank>,
    /// By rank: the block's slots.
    pub slots: Vec<Range<usize>>,
    /// By rank: index of the block's shape in the lists of the scene, and in those below.
    pub shapes: Vec<u32>,
    /// By shape: the first slot of each texel, within the block.
    pub slot_of_texel: Vec<Vec<u32>>,
    /// By shape: the texel in each slot of the block; `u32::MAX` where there is none. A texel that lies on a mirror of the
    /// shape has several slots.
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

    /// Most slots of a block.
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

    /// Slots from the first block's to the last one's, ends included.
    pub(crate) fn slots_of_span(&self, span: &Range<usize>) -> Range<usize> {
        self.slots[span.start].start..self.slots[span.end - 1].end
    }

    /// The slot of a texel of a block, counted over all blocks; `None` if there is no such block or texel.
    pub fn slot(&self, block: BlockIndex, texel: usize) -> Option<usize> {
        let &rank = self.rank.get(block.get())?;
        let slot = *self.slot_of_texel[self.shape(rank)].get(texel)?;
        Some(self.slots[rank.get()].start + slot as usize)
    }

    /// A signal by slot in the level's order: block by block, in a block channel by channel, in a channel texel by texel.
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

/// Where the texels of a level are, by slot. Slots without a texel stand in the middle of their block and have no normal.
#[derive(Clone, Debug)]
pub struct TexelGeometry {
    /// World positions, metres.
    pub positions: Planes,
    /// Unit normals into the blocks; zero in slots without a texel.
    pub normals: Planes,
}

/// Three numbers a slot, channels apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    values: Aligned<f32>,
    slots: usize,
}

impl Planes {
    /// Zeros.
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

    /// All three channels.
    pub(crate) fn channels(&self) -> [&[f32]; 3] {
        self.block(0..self.slots)
    }

    /// The three channels of a block.
    pub fn block(&self, slots: Range<usize>) -> [&[f32]; 3] {
        std::array::from_fn(|c| &self.values[c * self.slots..(c + 1) * self.slots][slots.clone()])
    }

    /// Zeros everywhere.
    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// All three channels, to write.
    pub(crate) fn channels_mut(&mut self) -> [&mut [f32]; 3] {
        let (first, rest) = self.values.split_at_mut(self.slots);
        let (second, third) = rest.split_at_mut(self.slots);
        [first, second, third]
    }

    pub(crate) fn block_mut(&mut self, slots: Range<usize>) -> [&mut [f32]; 3] {
        self.channels_mut()
            .map(|channel| &mut channel[slots.clone()])
    }

    pub(crate) fn get(&self, slot: usize) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|c| self.values[c * self.slots + slot]))
    }

    /// The value of all slots that have a texel, if they have the same.
    pub(crate) fn uniform(&self, slots: Range<usize>, texel_of_slot: &[u32]) -> Option<Vec3> {
        let texels = slots
            .zip(texel_of_slot)
            .filter(|&(_, &texel)| texel != u32::MAX);
        let mut values = texels.map(|(slot, _)| self.get(slot));
        let first = values.next()?;
        values.all(|value| value == first).then_some(first)
    }

    pub(crate) fn set(&mut self, slot: usize, value: Vec3) {
        for (c, x) in value.to_array().into_iter().enumerate() {
            self.values[c * self.slots + slot] = x;
        }
    }
}
