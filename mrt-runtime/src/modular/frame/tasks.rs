//! The stages of a pass over lists of blocks. A kernel is called once for each task, not for each block: a small block
//! takes little more time than the call of a kernel.

use crate::modular::frame::schedule::BlockState;
use crate::modular::frame::surface::Surface;
use crate::modular::kernels::coefficients::{CoefficientsOf, Sent};
use crate::modular::kernels::indirect::IndirectOf;
use crate::modular::kernels::responses::{ChangeOf, ResponsesOf};
use crate::modular::kernels::scratch::Scratch;
use crate::modular::scene::SceneData;
use crate::output::texel_layout::{BlockRank, Planes};
use mrt_core::simd::{Kernel, Lanes};

/// Computes coefficients b of a list of blocks. Mutable slices hold all blocks from the first of the list to the last.
pub(super) struct Senders<'a> {
    pub scene: &'a SceneData,
    pub surface: &'a Surface,
    pub list: &'a [BlockRank],
    pub first: usize,
    pub direct: &'a Planes,
    /// `None` if indirect light is not reflected.
    pub indirect: Option<&'a Planes>,
    pub coefficients: &'a mut [f32],
    pub flags: &'a mut [bool],
    pub state: &'a mut [BlockState],
    pub scratch: &'a mut Scratch,
}

impl Kernel for Senders<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let layout = &self.scene.layout;
        let surface = self.surface;
        let size = self.scene.rows.per_block();
        for &block in self.list {
            let place = block.get();
            let at = place - self.first;
            let coefficients = &mut self.coefficients[at * size..(at + 1) * size];
            let state = &mut self.state[at];
            let indirect = self.indirect.filter(|_| state.has_indirect);
            if !state.has_fresh() && indirect.is_none() {
                coefficients.fill(0.0);
                self.flags[at] = false;
                (state.sent, state.fresh) = ([0.0; 3], [0.0; 3]);
                continue;
            }
            let slots = &layout.slots[place];
            let emits = state.emits;
            let kernel = CoefficientsOf {
                shape: &self.scene.shapes[layout.shape(block)],
                direct: self.direct.block(slots.clone()),
                indirect: indirect.map(|indirect| indirect.block(slots.clone())),
                albedo: surface.albedo.block(slots.clone()),
                uniform: surface.uniform[place],
                emission: emits.then(|| surface.emission.block(slots.clone())),
                scratch: self.scratch,
                coefficients,
            };
            let Sent { all, fresh } = kernel.run(l);
            (state.sent, state.fresh) = (all, fresh);
            self.flags[at] = coefficients.iter().any(|&b| b != 0.0);
        }
    }
}

/// Computes joint coefficients of a list of blocks. Mutable slices hold all blocks from the first of the list to the
/// last.
pub(super) struct Receivers<'a> {
    pub scene: &'a SceneData,
    pub list: &'a [BlockRank],
    pub first: usize,
    pub coefficients: &'a [f32],
    pub has_coefficients: &'a [bool],
    pub all_lit: bool,
    pub gate_values: &'a [f32],
    pub keep_within: Option<f32>,
    pub joint: &'a mut [f32],
    pub state: &'a mut [BlockState],
    pub scratch: &'a mut Scratch,
}

impl Kernel for Receivers<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let layout = &self.scene.layout;
        let size = self.scene.rows.per_block();
        for &block in self.list {
            let place = block.get();
            let at = place - self.first;
            let shape = &self.scene.shapes[layout.shape(block)];
            let kept = &mut self.joint[at * size..(at + 1) * size];
            let state = &mut self.state[at];
            let to = match self.keep_within {
                Some(_) => &mut self.scratch.joint[..],
                None => &mut *kept,
            };
            let kernel = ResponsesOf {
                block,
                shape,
                transport: &self.scene.transport,
                coefficients: self.coefficients,
                has_coefficients: self.has_coefficients,
                all_lit: self.all_lit,
                gate_values: self.gate_values,
                joint: to,
            };
            kernel.run(l);
            (state.is_kept, state.lag) = (false, 0.0);
            let Some(most) = self.keep_within else {
                continue;
            };
            let now = &self.scratch.joint[..];
            let before = &*kept;
            let change = ChangeOf { shape, before, now }.run(l);
            // Always store a block that becomes fully dark, even within tolerance. Rows beyond those of the shape still
            // hold numbers of another block.
            let is_dark = |row: &[f32]| row[..shape.rows].iter().all(|&r| r == 0.0);
            let goes_dark = change > 0.0 && now.chunks_exact(self.scene.rows.count).all(is_dark);
            if change <= most && !goes_dark {
                (state.is_kept, state.lag) = (true, change);
            } else {
                kept.copy_from_slice(now);
            }
        }
    }
}

/// Computes indirect light of a list of blocks. Mutable slices hold all blocks from the first of the list to the last.
pub(super) struct Unfolding<'a> {
    pub scene: &'a SceneData,
    pub list: &'a [BlockRank],
    pub first: usize,
    pub first_slot: usize,
    /// Joint coefficients of all blocks.
    pub joint: &'a [f32],
    pub compare: bool,
    pub state: &'a mut [BlockState],
    pub planes: [&'a mut [f32]; 3],
    pub scratch: &'a mut Scratch,
}

impl Kernel for Unfolding<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) {
        let layout = &self.scene.layout;
        let size = self.scene.rows.per_block();
        for &block in self.list {
            let place = block.get();
            let slots = &layout.slots[place];
            let slots = slots.start - self.first_slot..slots.end - self.first_slot;
            let [red, green, blue] = &mut self.planes;
            let kernel = IndirectOf {
                shape: &self.scene.shapes[layout.shape(block)],
                joint: &self.joint[place * size..(place + 1) * size],
                scratch: self.scratch,
                compare: self.compare,
                indirect: [
                    &mut red[slots.clone()],
                    &mut green[slots.clone()],
                    &mut blue[slots],
                ],
            };
            self.state[place - self.first].arrives = kernel.run(l);
        }
    }
}
