//! Divides lists and buffers among tasks that run in parallel.

use crate::executor::{Executor, task_count};
use crate::output::texel_layout::{BlockRank, Planes};
use std::ops::Range;

/// A slice that is given away from the front, a range of blocks at a time.
pub(super) struct Cut<'a, T> {
    rest: &'a mut [T],
    /// Number of blocks that are no longer in `rest`.
    given: usize,
    /// Elements of each block.
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

    /// The elements of a range of blocks. Ranges must ascend: elements before them are no longer available.
    pub(super) fn take(&mut self, blocks: Range<usize>) -> &'a mut [T] {
        let rest = std::mem::take(&mut self.rest);
        let (_, rest) = rest.split_at_mut((blocks.start - self.given) * self.size);
        let (taken, rest) = rest.split_at_mut(blocks.len() * self.size);
        self.rest = rest;
        self.given = blocks.end;
        taken
    }
}

/// [`Planes`] that are given away from the front, a range of slots at a time.
pub(super) struct CutPlanes<'a>([Cut<'a, f32>; 3]);

impl<'a> CutPlanes<'a> {
    pub(super) fn new(planes: &'a mut Planes) -> Self {
        Self(planes.channels_mut().map(|channel| Cut::new(channel, 1)))
    }

    pub(super) fn take(&mut self, slots: Range<usize>) -> [&'a mut [f32]; 3] {
        let [red, green, blue] = &mut self.0;
        [
            red.take(slots.clone()),
            green.take(slots.clone()),
            blue.take(slots),
        ]
    }
}

/// The work of one task.
pub(super) struct Part<'a, S> {
    /// The blocks, ascending; at least one.
    pub list: &'a [BlockRank],
    /// All ranks from the first block of the list to the last.
    pub span: Range<usize>,
    /// Memory of the task.
    pub scratch: &'a mut S,
}

/// Divides an ascending list into parts of about the same length, at most one for each element of `scratch`.
pub(super) fn parts_of<'a, S>(
    list: &'a [BlockRank],
    executor: &dyn Executor,
    scratch: &'a mut [S],
) -> impl Iterator<Item = Part<'a, S>> {
    let tasks = task_count(executor, list.len()).min(scratch.len());
    let lists =
        (0..tasks).map(move |k| &list[k * list.len() / tasks..(k + 1) * list.len() / tasks]);
    lists.zip(scratch).filter_map(|(list, scratch)| {
        let (first, last) = (list.first()?, list.last()?);
        Some(Part {
            list,
            span: first.get()..last.get() + 1,
            scratch,
        })
    })
}
