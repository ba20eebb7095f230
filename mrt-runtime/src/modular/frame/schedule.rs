//! Which blocks a frame works on. Every step goes over a list of the blocks that matter to it; none looks at all blocks
//! unless at least an eighth of them must be computed.

use crate::modular::kernels::indirect::Arrived;
use crate::modular::kernels::scratch::Flux;
use crate::output::texel_layout::BlockRank;
use std::collections::VecDeque;

/// What a frame knows about the blocks of its scene, by rank, and its lists of blocks.
#[derive(Debug)]
pub(super) struct Schedule {
    pub state: Vec<BlockState>,
    /// By rank: whether the block has a coefficient b that is not zero.
    pub has_coefficients: Vec<bool>,
    /// Number of blocks that sent light out.
    pub lit: usize,
    /// Blocks with light of any kind, ascending.
    pub alive: Vec<BlockRank>,
    /// Blocks whose coefficients b are to be computed in this pass, ascending.
    pub sources: Vec<BlockRank>,
    /// Blocks whose indirect light is to be computed in this pass, ascending.
    pub targets: Vec<BlockRank>,
    /// Blocks whose indirect light is not up to date, oldest first.
    pub waiting: VecDeque<BlockRank>,
    /// The most flux that left all walls in one pass since no block waited.
    pub most_sent: Flux,
    /// Blocks whose indirect light was written since the last outputs.
    pub changed: Vec<BlockRank>,
    pub doors_moved: bool,
    /// Whether nothing of the previous pass can be kept: all blocks with light are computed again.
    pub all_stale: bool,
    pub kept: Kept,
}

/// What a frame knows about one block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BlockState {
    pub has_direct: bool,
    pub emits: bool,
    pub has_indirect: bool,
    /// Whether a coefficient was not zero when light was last sent out.
    pub had_coefficients: bool,
    /// Largest change of irradiance, W/m², that may have happened since its coefficients were computed.
    pub stale: f32,
    /// Flux that left its walls when its coefficients were computed.
    pub sent: Flux,
    /// The part of `sent` that is reflected direct light, and emission.
    pub fresh: Flux,
    /// Indirect flux that arrived at its walls.
    pub arrived: Flux,
    /// Largest indirect irradiance, W/m².
    pub peak: f32,
    /// Largest difference, W/m², between its light and the light of its present joint coefficients.
    pub lag: f32,
    /// Whether the present pass keeps its old joint coefficients.
    pub is_kept: bool,
    /// Light that arrives in the present pass.
    pub arrives: Arrived,
    pub is_alive: bool,
    pub is_waiting: bool,
    pub is_changed: bool,
}

impl BlockState {
    /// True if the block has direct light or emits.
    pub(super) fn has_fresh(&self) -> bool {
        self.has_direct || self.emits
    }
}

/// What a frame can keep of the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum Kept {
    /// Nothing.
    #[default]
    Nothing,
    /// Light of one bounce.
    Once,
    /// Light of many bounces, one more in each frame.
    Feedback,
}

impl Schedule {
    /// All blocks are dark. Blocks with `emits` send light out in the first frame.
    pub(super) fn new(emits: &[bool]) -> Self {
        let count = emits.len();
        let mut schedule = Self {
            state: vec![BlockState::default(); count],
            has_coefficients: vec![false; count],
            lit: 0,
            alive: Vec::with_capacity(count),
            sources: Vec::with_capacity(count),
            targets: Vec::with_capacity(count),
            waiting: VecDeque::with_capacity(count),
            most_sent: [0.0; 3],
            changed: Vec::with_capacity(count),
            doors_moved: true,
            all_stale: true,
            kept: Kept::Nothing,
        };
        for (rank, _) in emits.iter().enumerate().filter(|&(_, &emits)| emits) {
            let block = BlockRank::new(rank);
            schedule.state[rank].emits = true;
            schedule.touch(block, f32::INFINITY);
        }
        schedule
    }

    /// Notes that a block's irradiance changed by at most `change`, W/m².
    pub(super) fn touch(&mut self, block: BlockRank, change: f32) {
        let state = &mut self.state[block.get()];
        state.stale += change;
        if !state.is_alive {
            state.is_alive = true;
            self.alive.push(block);
        }
    }

    /// Makes a block wait for its indirect light to be computed.
    pub(super) fn await_light(&mut self, block: BlockRank) {
        let state = &mut self.state[block.get()];
        if !state.is_waiting {
            state.is_waiting = true;
            self.waiting.push_back(block);
        }
    }

    /// Makes the `count` blocks that wait longest the targets.
    pub(super) fn take_targets(&mut self, count: usize) {
        self.targets.clear();
        // Unless few blocks wait, looking at all flags takes less time than sorting.
        if count == self.waiting.len() && count * 8 >= self.state.len() {
            self.waiting.clear();
            for (rank, state) in self.state.iter_mut().enumerate() {
                if std::mem::take(&mut state.is_waiting) {
                    self.targets.push(BlockRank::new(rank));
                }
            }
            return;
        }
        for block in self.waiting.drain(..count) {
            self.state[block.get()].is_waiting = false;
            self.targets.push(block);
        }
        self.targets.sort_unstable();
    }

    /// Notes that a block's indirect light was written.
    pub(super) fn mark_changed(&mut self, block: BlockRank) {
        let state = &mut self.state[block.get()];
        if !state.is_changed {
            state.is_changed = true;
            self.changed.push(block);
        }
    }

    /// Empties the list of changed blocks.
    pub(super) fn clear_changed(&mut self) {
        for block in self.changed.drain(..) {
            self.state[block.get()].is_changed = false;
        }
    }

    /// Lists the blocks whose coefficients b must be computed: all blocks with light if `all`, otherwise those whose
    /// irradiance may have changed by more than `tolerance`, W/m².
    pub(super) fn take_sources(&mut self, all: bool, tolerance: f32) {
        self.alive.sort_unstable();
        self.sources.clear();
        for &block in &self.alive {
            if all || self.state[block.get()].stale > tolerance {
                self.sources.push(block);
            }
        }
    }

    /// Notes that a block's coefficients were computed. True if the block sends light out, or sent light out before.
    pub(super) fn note_sent(&mut self, block: BlockRank) -> bool {
        let state = &mut self.state[block.get()];
        state.stale = 0.0;
        let has = self.has_coefficients[block.get()];
        let had = std::mem::replace(&mut state.had_coefficients, has);
        self.lit += usize::from(has);
        self.lit -= usize::from(had);
        had || has
    }

    /// Removes the blocks from the targets that keep their old joint coefficients. Returns how many there were.
    pub(super) fn drop_kept_targets(&mut self) -> usize {
        let state = &self.state;
        let before = self.targets.len();
        self.targets.retain(|&block| !state[block.get()].is_kept);
        before - self.targets.len()
    }

    /// Notes the light that arrived at the targets. Returns the largest change of irradiance, W/m².
    pub(super) fn note_arrivals(&mut self) -> f32 {
        let mut change = 0.0f32;
        for k in 0..self.targets.len() {
            let block = self.targets[k];
            let state = &mut self.state[block.get()];
            let arrived = state.arrives;
            state.arrived = arrived.flux;
            state.peak = arrived.peak;
            state.has_indirect = arrived.peak > 0.0;
            change = change.max(arrived.change);
            // With one bounce, indirect light is not sent out again.
            let resent = if self.kept == Kept::Once {
                0.0
            } else {
                arrived.change
            };
            self.touch(block, resent);
            self.mark_changed(block);
        }
        change
    }

    /// The largest indirect irradiance of all blocks, W/m².
    pub(super) fn peak(&self) -> f32 {
        let peaks = self.alive.iter().map(|block| self.state[block.get()].peak);
        peaks.fold(0.0, f32::max)
    }

    /// Removes blocks without any light from `alive`.
    pub(super) fn forget_dark(&mut self) {
        let state = &mut self.state;
        self.alive.retain(|&block| {
            let block = &mut state[block.get()];
            block.is_alive = block.has_fresh() || block.has_indirect || block.stale > 0.0;
            block.is_alive
        });
    }
}
