//! Bounces: which blocks take part, and the two stages of a pass over them.

use super::blocks::Blocks;
use super::limit::limit_flux;
use super::tasks::{Receivers, Senders, Unfolding};
use super::{Bounces, Frame, MAX_PASSES};
use crate::executor::{run_parts, task_count};
use crate::modular::scene::{Planes, Scene};
use std::time::Instant;

/// What the frame before left behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum Kept {
    /// Nothing to go on from.
    #[default]
    Nothing,
    /// Light of one bounce.
    Once,
    /// Light of many, one more each frame.
    Feedback,
}

impl Frame {
    pub(super) fn bounce(&mut self, scene: &Scene, bounces: Bounces) {
        self.update_gates(scene);
        self.passes = 0;
        let kept = match bounces {
            Bounces::Count(1) => Kept::Once,
            Bounces::Feedback => Kept::Feedback,
            _ => Kept::Nothing,
        };
        self.blocks.all_stale |= kept != self.blocks.kept || kept == Kept::Nothing;
        self.blocks.kept = kept;
        if kept != Kept::Nothing {
            self.pass(scene, kept == Kept::Feedback, true);
            self.passes = 1;
            return;
        }
        let (limit, tolerance) = match bounces {
            Bounces::Count(count) => (count, None),
            Bounces::Feedback => (1, None),
            Bounces::Converged { tolerance, limit } => (limit, Some(tolerance)),
        };
        if limit == 0 {
            self.darken();
        }
        while self.passes < limit.min(MAX_PASSES) {
            // The second pass is the first that reflects indirect light, wherever there is some.
            self.blocks.all_stale |= self.passes == 1;
            let change = self.pass(scene, self.passes > 0, false);
            self.passes += 1;
            if tolerance.is_some_and(|t| change <= t) {
                break;
            }
        }
    }

    /// Takes all indirect light away.
    fn darken(&mut self) {
        self.coefficients.fill(0.0);
        self.joint.fill(0.0);
        self.indirect.clear();
        self.blocks.has_coefficients.fill(false);
        self.blocks.lit = 0;
        // Where truncation leaves walls dark, probes may still hold a little light, and no list knows of it.
        self.vector.fill(0.0);
        if let Some(probes) = &mut self.probes {
            probes.darken();
        }
        for k in 0..self.blocks.alive.len() {
            let block = self.blocks.alive[k];
            self.blocks.mark_changed(block);
            let state = &mut self.blocks.state[block as usize];
            (state.has_indirect, state.had_coefficients) = (false, false);
            (state.arrived, state.peak) = ([0.0; 3], 0.0);
        }
    }

    /// Products of doors' values.
    fn update_gates(&mut self, scene: &Scene) {
        if !std::mem::take(&mut self.blocks.doors_moved) {
            return;
        }
        for (value, doors) in self.gate_values.iter_mut().zip(&scene.transport.gates) {
            let now = doors
                .iter()
                .map(|&door| self.doors[door as usize])
                .product();
            self.blocks.all_stale |= *value != now;
            *value = now;
        }
    }

    /// One bounce of what the walls reflect and emit. Returns the largest change of irradiance over the largest
    /// irradiance; in a pass that starts from darkness that is 1, or 0 without light.
    fn pass(&mut self, scene: &Scene, reflects_indirect: bool, goes_on: bool) -> f32 {
        let start = Instant::now();
        let all = std::mem::take(&mut self.blocks.all_stale);
        // What is no number tolerates nothing.
        let tolerance = if goes_on {
            self.config.tolerance.max(0.0)
        } else {
            0.0
        };
        let blocks = &mut self.blocks;
        blocks.alive.sort_unstable();
        blocks.sources.clear();
        for &block in &blocks.alive {
            if all || blocks.state[block as usize].stale > tolerance {
                blocks.sources.push(block);
            }
        }
        self.work.sources += blocks.sources.len();
        self.update_coefficients(scene, reflects_indirect);
        let blocks = &mut self.blocks;
        for k in 0..blocks.sources.len() {
            let block = blocks.sources[k];
            let state = &mut blocks.state[block as usize];
            state.stale = 0.0;
            let had = std::mem::replace(
                &mut state.had_coefficients,
                blocks.has_coefficients[block as usize],
            );
            blocks.lit += usize::from(state.had_coefficients);
            blocks.lit -= usize::from(had);
            if all || had || state.had_coefficients {
                blocks.await_light(block);
                if blocks.waiting.len() == blocks.state.len() {
                    continue;
                }
                for &reached in scene.transport.reached(block as usize) {
                    blocks.await_light(reached);
                }
            }
        }
        let after_coefficients = Instant::now();
        let count = match self.config.slice {
            Some(slice) if goes_on => slice.get().min(blocks.waiting.len()),
            _ => blocks.waiting.len(),
        };
        blocks.take_targets(count);
        let keep_within = (goes_on && !all).then_some(tolerance);
        self.update_responses(scene, keep_within);
        let blocks = &mut self.blocks;
        if keep_within.is_some() {
            let state = &blocks.state;
            let arrived = blocks.targets.len();
            blocks
                .targets
                .retain(|&block| !state[block as usize].is_kept);
            self.work.kept += arrived - blocks.targets.len();
        }
        self.work.targets += blocks.targets.len();
        let after_responses = Instant::now();
        self.update_indirect(scene);
        let blocks = &mut self.blocks;
        let mut change = 0.0f32;
        for k in 0..blocks.targets.len() {
            let block = blocks.targets[k];
            let state = &mut blocks.state[block as usize];
            let arrived = state.arrives;
            state.arrived = arrived.flux;
            state.peak = arrived.peak;
            state.has_indirect = arrived.peak > 0.0;
            change = change.max(arrived.change);
            // What only one bounce is asked for does not change what is sent out.
            let resent = if blocks.kept == Kept::Once {
                0.0
            } else {
                arrived.change
            };
            blocks.touch(block, resent);
            blocks.mark_changed(block);
        }
        let nothing_waits = self.blocks.waiting.is_empty() && !self.lights.has_waiting();
        self.work.limited += limit_flux(
            scene,
            &mut self.blocks,
            &mut self.indirect,
            &mut self.joint,
            nothing_waits,
        );
        let peaks = self.blocks.alive.iter();
        let peak = peaks.fold(0.0f32, |m, &block| {
            m.max(self.blocks.state[block as usize].peak)
        });
        self.blocks.forget_dark();
        self.times.coefficients += after_coefficients - start;
        self.times.responses += after_responses - after_coefficients;
        self.times.indirect += after_responses.elapsed();
        match (peak > 0.0, reflects_indirect) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => change / peak,
        }
    }

    /// Coefficients b of the sources.
    fn update_coefficients(&mut self, scene: &Scene, reflects_indirect: bool) {
        let executor = &*self.config.executor;
        let level = self.config.simd;
        let layout = &*self.layout;
        let (direct, indirect) = (&self.direct, &self.indirect);
        let size = 3 * layout.rows;
        let Blocks {
            sources,
            state,
            has_coefficients,
            ..
        } = &mut self.blocks;
        let (list, tasks) = (
            &*sources,
            task_count(executor, sources.len()).min(self.scratch.len()),
        );
        let mut coefficients = Cut::new(&mut self.coefficients, size);
        let mut flags = Cut::new(has_coefficients, 1);
        let mut state = Cut::new(state, 1);
        let mut scratch = self.scratch.iter_mut();
        let parts = (0..tasks).map_while(|k| {
            let list = part_of(list, tasks, k).filter(|list| !list.is_empty())?;
            let span = span(list);
            Some(Senders {
                scene,
                list,
                first: span.start,
                direct,
                indirect: reflects_indirect.then_some(indirect),
                coefficients: coefficients.take(span.clone()),
                flags: flags.take(span.clone()),
                state: state.take(span),
                scratch: scratch.next()?,
            })
        });
        run_parts(executor, parts, |part| level.run(part));
    }

    /// Joint coefficients of the targets. Those that change light by no more than `keep_within` stay what they were.
    fn update_responses(&mut self, scene: &Scene, keep_within: Option<f32>) {
        let executor = &*self.config.executor;
        let level = self.config.simd;
        let layout = &*self.layout;
        let (coefficients, gate_values) = (&self.coefficients, &self.gate_values);
        let size = 3 * layout.rows;
        let Blocks {
            targets,
            has_coefficients,
            lit,
            state,
            ..
        } = &mut self.blocks;
        let has_coefficients = &*has_coefficients;
        let all_lit = *lit == has_coefficients.len();
        let (list, tasks) = (
            &*targets,
            task_count(executor, targets.len()).min(self.scratch.len()),
        );
        let mut joint = Cut::new(&mut self.joint, size);
        let mut state = Cut::new(state, 1);
        let mut scratch = self.scratch.iter_mut();
        let parts = (0..tasks).map_while(|k| {
            let list = part_of(list, tasks, k).filter(|list| !list.is_empty())?;
            let span = span(list);
            Some(Receivers {
                scene,
                list,
                first: span.start,
                coefficients,
                has_coefficients,
                all_lit,
                gate_values,
                keep_within,
                joint: joint.take(span.clone()),
                state: state.take(span),
                scratch: scratch.next()?,
            })
        });
        run_parts(executor, parts, |part| level.run(part));
    }

    /// Indirect light of the targets.
    fn update_indirect(&mut self, scene: &Scene) {
        let executor = &*self.config.executor;
        let level = self.config.simd;
        let layout = &*self.layout;
        let joint = &self.joint;
        // After one bounce nobody asks what changed.
        let compare = self.blocks.kept != Kept::Once;
        let Blocks { targets, state, .. } = &mut self.blocks;
        let (list, tasks) = (
            &*targets,
            task_count(executor, targets.len()).min(self.scratch.len()),
        );
        let mut state = Cut::new(state, 1);
        let mut planes = CutPlanes::new(&mut self.indirect);
        let mut scratch = self.scratch.iter_mut();
        let parts = (0..tasks).map_while(|k| {
            let list = part_of(list, tasks, k).filter(|list| !list.is_empty())?;
            let span = span(list);
            let slots = layout.slots[span.start].start..layout.slots[span.end - 1].end;
            Some(Unfolding {
                scene,
                list,
                first: span.start,
                first_slot: slots.start,
                joint,
                compare,
                state: state.take(span),
                planes: planes.take(slots),
                scratch: scratch.next()?,
            })
        });
        run_parts(executor, parts, |part| level.run(part));
    }
}

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
pub(super) fn part_of(list: &[u32], tasks: usize, k: usize) -> Option<&[u32]> {
    (k < tasks).then(|| &list[k * list.len() / tasks..(k + 1) * list.len() / tasks])
}

/// Blocks from the first of a list to its last.
pub(super) fn span(list: &[u32]) -> std::ops::Range<usize> {
    match (list.first(), list.last()) {
        (Some(&first), Some(&last)) => first as usize..last as usize + 1,
        _ => 0..0,
    }
}
