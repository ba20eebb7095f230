//! Cuts buffers into the parts of tasks that run at the same time.

use crate::output::texel_layout::{BlockRank, Planes};

/// A slice that is given away from the front, block by block.
pub(super) struct Cut<'a, T> {
    rest: &'a mut [T],
    /// Blocks that are gone.
    given: usize,
    /// Elements a block.
    size: usize,
}

impl<'a, T> Cut<'a, T> {
    pub(super) fn new(all: &'a mut [T], size: usize) -> Self {
        Self {
            rest: all,
            given: 0,
            size,
        }
    }

    /// The elements of these blocks; what was before them is lost.
    pub(super) fn take(&mut self, blocks: std::ops::Range<usize>) -> &'a mut [T] {
        let rest = std::mem::take(&mut self.rest);
        let (_, rest) = rest.split_at_mut((blocks.start - self.given) * self.size);
        let (taken, rest) = rest.split_at_mut(blocks.len() * self.size);
        self.rest = rest;
        self.given = blocks.end;
        taken
    }
}

/// [`Planes`], given away by ranges of slots.
pub(super) struct CutPlanes<'a>([Cut<'a, f32>; 3]);

impl<'a> CutPlanes<'a> {
    pub(super) fn new(planes: &'a mut Planes) -> Self {
        Self(planes.channels_mut().map(|channel| Cut::new(channel, 1)))
    }

    pub(super) fn take(&mut self, slots: std::ops::Range<usize>) -> [&'a mut [f32]; 3] {
        let [red, green, blue] = &mut self.0;
        [
            red.take(slots.clone()),
            green.take(slots.clone()),
            blue.take(slots),
        ]
    }
}

/// Part number `k` of `tasks` of an ascending list.
pub(super) fn part_of(list: &[BlockRank], tasks: usize, k: usize) -> Option<&[BlockRank]> {
    (k < tasks).then(|| &list[k * list.len() / tasks..(k + 1) * list.len() / tasks])
}

/// Blocks from the first of a list to its last.
pub(super) fn span(list: &[BlockRank]) -> std::ops::Range<usize> {
    match (list.first(), list.last()) {
        (Some(&first), Some(&last)) => first.get()..last.get() + 1,
        _ => 0..0,
    }
}
