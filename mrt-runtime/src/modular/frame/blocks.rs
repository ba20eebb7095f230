//! What a frame knows about each block, and lists of those that count: no step looks at all blocks unless an eighth of them
//! is to be computed.

use super::kernels::{Arrived, Flux};
use super::pass::Kept;
use std::collections::VecDeque;

/// What is known about the blocks of a scene, by place.
#[derive(Debug)]
pub(super) struct Blocks {
    pub state: Vec<BlockState>,
    /// Whether a block's coefficients b are not all zero.
    pub has_coefficients: Vec<bool>,
    /// Number of those that light was sent out from.
    pub lit: usize,
    /// Blocks with light of any kind, ascending.
    pub alive: Vec<u32>,
    /// Blocks whose coefficients b are to be computed in this pass, ascending.
    pub sources: Vec<u32>,
    /// Blocks whose indirect light is to be computed in this pass, ascending.
    pub targets: Vec<u32>,
    /// Blocks whose indirect light is not up to date, oldest first.
    pub waiting: VecDeque<u32>,
    /// The most flux that left all walls in a pass since none waited.
    pub most_sent: Flux,
    /// Blocks whose indirect light was written since outputs were.
    pub changed: Vec<u32>,
    /// Tiles of the lightmap that show them.
    pub tiles: Vec<u32>,
    pub doors_moved: bool,
    /// The frame before cannot be gone on from: all blocks with light are computed anew.
    pub all_stale: bool,
    pub kept: Kept,
}

/// What is known about one block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BlockState {
    /// Has direct light, or emits.
    pub has_fresh: bool,
    pub has_indirect: bool,
    /// Whether its coefficients were not all zero when light was last sent out.
    pub had_coefficients: bool,
    /// Irradiance, W/m², by which its light may have changed since its coefficients were computed.
    pub stale: f32,
    /// Flux that left its walls when its coefficients were computed.
    pub sent: Flux,
    /// The part of it that is direct light and emission.
    pub fresh: Flux,
    /// Indirect flux that arrived.
    pub arrived: Flux,
    /// Largest indirect irradiance.
    pub peak: f32,
    /// Its light may differ by so much, W/m², from what joint coefficients now are.
    pub lag: f32,
    /// The joint coefficients of the pass under way are kept as they were.
    pub is_kept: bool,
    /// What the pass under way found.
    pub arrives: Arrived,
    pub is_alive: bool,
    pub is_waiting: bool,
    pub is_changed: bool,
}

impl Blocks {
    pub(super) fn new(count: usize, tiles: usize) -> Self {
        Self {
            state: vec![BlockState::default(); count],
            has_coefficients: vec![false; count],
            lit: 0,
            alive: Vec::with_capacity(count),
            sources: Vec::with_capacity(count),
            targets: Vec::with_capacity(count),
            waiting: VecDeque::with_capacity(count),
            most_sent: [0.0; 3],
            changed: Vec::with_capacity(count),
            tiles: Vec::with_capacity(tiles),
            doors_moved: true,
            all_stale: true,
            kept: Kept::Nothing,
        }
    }

    /// All dark, but for those that emit.
    pub(super) fn restart(&mut self, emitting: &[u32]) {
        self.state.fill(BlockState::default());
        self.has_coefficients.fill(false);
        self.lit = 0;
        self.alive.clear();
        self.waiting.clear();
        self.most_sent = [0.0; 3];
        self.changed.clear();
        self.doors_moved = true;
        self.all_stale = true;
        for &block in emitting {
            self.state[block as usize].has_fresh = true;
            self.touch(block, f32::INFINITY);
        }
    }

    /// A block's light changed by up to so much.
    pub(super) fn touch(&mut self, block: u32, change: f32) {
        let state = &mut self.state[block as usize];
        state.stale += change;
        if !state.is_alive {
            state.is_alive = true;
            self.alive.push(block);
        }
    }

    /// A block's indirect light is to be computed.
    pub(super) fn await_light(&mut self, block: u32) {
        let state = &mut self.state[block as usize];
        if !state.is_waiting {
            state.is_waiting = true;
            self.waiting.push_back(block);
        }
    }

    /// Makes the first so many waiting blocks the targets.
    pub(super) fn take_targets(&mut self, count: usize) {
        self.targets.clear();
        // Looking at all flags takes less than sorting, unless few are set.
        if count == self.waiting.len() && count * 8 >= self.state.len() {
            self.waiting.clear();
            for (block, state) in (0..).zip(&mut self.state) {
                if std::mem::take(&mut state.is_waiting) {
                    self.targets.push(block);
                }
            }
            return;
        }
        for block in self.waiting.drain(..count) {
            self.state[block as usize].is_waiting = false;
            self.targets.push(block);
        }
        self.targets.sort_unstable();
    }

    /// A block's indirect light was written.
    pub(super) fn mark_changed(&mut self, block: u32) {
        let state = &mut self.state[block as usize];
        if !state.is_changed {
            state.is_changed = true;
            self.changed.push(block);
        }
    }

    pub(super) fn clear_changed(&mut self) {
        for block in self.changed.drain(..) {
            self.state[block as usize].is_changed = false;
        }
    }

    /// Drops blocks without any light from the list of those that have some.
    pub(super) fn forget_dark(&mut self) {
        let state = &mut self.state;
        self.alive.retain(|&block| {
            let block = &mut state[block as usize];
            block.is_alive = block.has_fresh || block.has_indirect || block.stale > 0.0;
            block.is_alive
        });
    }
}
