//! The bounces of a frame: the passes, and the stages of each pass.

use crate::executor::run_parts;
use crate::modular::frame::config::{Bounces, FrameConfig, MAX_PASSES};
use crate::modular::frame::flux_limit::limit_flux;
use crate::modular::frame::light_buffers::LightBuffers;
use crate::modular::frame::report::FrameWork;
use crate::modular::frame::schedule::{Kept, Schedule};
use crate::modular::frame::split::{Cut, CutPlanes, parts_of};
use crate::modular::frame::stage_clock::{Stage, StageClock};
use crate::modular::frame::surface::Surface;
use crate::modular::frame::tasks::{Receivers, Senders, Unfolding};
use crate::modular::scene::SceneData;

/// The second half of a frame: from direct light to indirect light at texels.
pub(super) struct BounceStage<'a> {
    pub scene: &'a SceneData,
    pub config: &'a FrameConfig,
    pub surface: &'a Surface,
    pub schedule: &'a mut Schedule,
    pub light: &'a mut LightBuffers,
    pub work: &'a mut FrameWork,
    pub clock: &'a mut StageClock,
    /// Whether some blocks still wait for direct light.
    pub direct_waits: bool,
}

/// What a pass does with the light of the previous frame.
#[derive(Clone, Copy, Debug)]
struct Pass {
    /// Whether walls reflect indirect light too, not only direct light.
    reflects_indirect: bool,
    /// Whether the pass continues the previous frame: light that hardly changes may be kept, and blocks may wait for a
    /// later frame.
    goes_on: bool,
}

impl BounceStage<'_> {
    /// Computes indirect light. Returns the number of passes.
    pub(super) fn run(&mut self) -> u32 {
        self.update_gates();
        let bounces = self.config.bounces;
        let kept = match bounces {
            Bounces::Count(1) => Kept::Once,
            Bounces::Feedback => Kept::Feedback,
            _ => Kept::Nothing,
        };
        self.schedule.all_stale |= kept != self.schedule.kept || kept == Kept::Nothing;
        self.schedule.kept = kept;
        if kept != Kept::Nothing {
            self.pass(Pass {
                reflects_indirect: kept == Kept::Feedback,
                goes_on: true,
            });
            return 1;
        }
        let (limit, tolerance) = match bounces {
            Bounces::Count(count) => (count, None),
            Bounces::Feedback => (1, None),
            Bounces::Converged { tolerance, limit } => (limit, Some(tolerance)),
        };
        if limit == 0 {
            self.darken();
        }
        let mut passes = 0;
        while passes < limit.min(MAX_PASSES) {
            // The second pass is the first that reflects indirect light, so every lit block changes.
            self.schedule.all_stale |= passes == 1;
            let change = self.pass(Pass {
                reflects_indirect: passes > 0,
                goes_on: false,
            });
            passes += 1;
            if tolerance.is_some_and(|t| change <= t) {
                break;
            }
        }
        passes
    }

    /// Sets all indirect light to 0.
    fn darken(&mut self) {
        self.light.coefficients.fill(0.0);
        self.light.joint.fill(0.0);
        self.light.indirect.clear();
        let schedule = &mut *self.schedule;
        schedule.has_coefficients.fill(false);
        schedule.lit = 0;
        for k in 0..schedule.alive.len() {
            let block = schedule.alive[k];
            schedule.mark_changed(block);
            let state = &mut schedule.state[block.get()];
            (state.has_indirect, state.had_coefficients) = (false, false);
            (state.arrived, state.peak) = ([0.0; 3], 0.0);
        }
    }

    /// Computes, for each gate, the product of the values of its doors.
    fn update_gates(&mut self) {
        if !std::mem::take(&mut self.schedule.doors_moved) {
            return;
        }
        let gates = &self.scene.transport.gates;
        for (value, doors) in self.light.gate_values.iter_mut().zip(gates) {
            let open = doors.iter().map(|&door| self.light.doors[door as usize]);
            let now = open.product();
            self.schedule.all_stale |= *value != now;
            *value = now;
        }
    }

    /// Computes one bounce of the light that walls reflect and emit. Returns the largest change of irradiance divided
    /// by the largest irradiance: 1 for a pass that starts from darkness, 0 without light.
    fn pass(&mut self, pass: Pass) -> f32 {
        let all = std::mem::take(&mut self.schedule.all_stale);
        let tolerance = if pass.goes_on {
            // `max` turns NaN into 0.
            self.config.tolerance.max(0.0)
        } else {
            0.0
        };
        // 1. b = T_d->b l, for blocks whose radiosity changed.
        self.schedule.take_sources(all, tolerance);
        self.work.sources += self.schedule.sources.len();
        self.update_coefficients(pass.reflects_indirect);
        self.await_targets(all);
        self.clock.lap(Stage::Coefficients);
        // 2. r = T_b->r b, for blocks that changed light reaches.
        let waiting = self.schedule.waiting.len();
        let count = match self.config.slice {
            Some(slice) if pass.goes_on => slice.get().min(waiting),
            _ => waiting,
        };
        self.schedule.take_targets(count);
        let keep_within = (pass.goes_on && !all).then_some(tolerance);
        self.update_responses(keep_within);
        if keep_within.is_some() {
            self.work.kept += self.schedule.drop_kept_targets();
        }
        self.work.targets += self.schedule.targets.len();
        self.clock.lap(Stage::Responses);
        // 3. U_b b + U_r r, for blocks whose joint coefficients changed.
        self.update_indirect();
        let change = self.schedule.note_arrivals();
        // 4. Limit the flux, so that bounces do not grow without end.
        let nothing_waits = self.schedule.waiting.is_empty() && !self.direct_waits;
        self.work.limited += limit_flux(self.scene, self.schedule, self.light, nothing_waits);
        let peak = self.schedule.peak();
        self.schedule.forget_dark();
        self.clock.lap(Stage::Indirect);
        match (peak > 0.0, pass.reflects_indirect) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => change / peak,
        }
    }

    /// Makes the blocks wait that a source sends light to, or sent light to before.
    fn await_targets(&mut self, all: bool) {
        let schedule = &mut *self.schedule;
        for k in 0..schedule.sources.len() {
            let block = schedule.sources[k];
            let has_changed = schedule.note_sent(block);
            if !(all || has_changed) {
                continue;
            }
            schedule.await_light(block);
            if schedule.waiting.len() == schedule.state.len() {
                continue;
            }
            for &reached in self.scene.transport.reached(block) {
                schedule.await_light(reached);
            }
        }
    }

    /// Computes coefficients b of the sources.
    fn update_coefficients(&mut self, reflects_indirect: bool) {
        let executor = &*self.config.executor;
        let level = self.config.simd;
        let (scene, surface) = (self.scene, self.surface);
        let (direct, indirect) = (&self.light.direct, &self.light.indirect);
        let size = scene.rows.per_block();
        let Schedule {
            sources,
            state,
            has_coefficients,
            ..
        } = &mut *self.schedule;
        let parts = parts_of(sources, executor, &mut self.light.scratch);
        let mut coefficients = Cut::new(&mut self.light.coefficients, size);
        let mut flags = Cut::new(has_coefficients, 1);
        let mut state = Cut::new(state, 1);
        let parts = parts.map(|part| Senders {
            scene,
            surface,
            list: part.list,
            first: part.span.start,
            direct,
            indirect: reflects_indirect.then_some(indirect),
            coefficients: coefficients.take(part.span.clone()),
            flags: flags.take(part.span.clone()),
            state: state.take(part.span),
            scratch: part.scratch,
        });
        run_parts(executor, parts, |part| level.run(part));
    }

    /// Computes joint coefficients of the targets. A block whose light would change by at most `keep_within`, W/m²,
    /// keeps its old ones.
    fn update_responses(&mut self, keep_within: Option<f32>) {
        let executor = &*self.config.executor;
        let level = self.config.simd;
        let scene = self.scene;
        let (coefficients, gate_values) = (&self.light.coefficients, &self.light.gate_values);
        let size = scene.rows.per_block();
        let Schedule {
            targets,
            has_coefficients,
            lit,
            state,
            ..
        } = &mut *self.schedule;
        let has_coefficients = &*has_coefficients;
        let all_lit = *lit == has_coefficients.len();
        let parts = parts_of(targets, executor, &mut self.light.scratch);
        let mut joint = Cut::new(&mut self.light.joint, size);
        let mut state = Cut::new(state, 1);
        let parts = parts.map(|part| Receivers {
            scene,
            list: part.list,
            first: part.span.start,
            coefficients,
            has_coefficients,
            all_lit,
            gate_values,
            keep_within,
            joint: joint.take(part.span.clone()),
            state: state.take(part.span),
            scratch: part.scratch,
        });
        run_parts(executor, parts, |part| level.run(part));
    }

    /// Computes indirect light of the targets.
    fn update_indirect(&mut self) {
        let executor = &*self.config.executor;
        let level = self.config.simd;
        let scene = self.scene;
        let joint = &self.light.joint;
        // With a single bounce, nothing depends on how much light changes.
        let compare = self.schedule.kept != Kept::Once;
        let Schedule { targets, state, .. } = &mut *self.schedule;
        let parts = parts_of(targets, executor, &mut self.light.scratch);
        let mut state = Cut::new(state, 1);
        let mut planes = CutPlanes::new(&mut self.light.indirect);
        let parts = parts.map(|part| {
            let slots = scene.layout.slots_of_span(&part.span);
            Unfolding {
                scene,
                list: part.list,
                first: part.span.start,
                first_slot: slots.start,
                joint,
                compare,
                state: state.take(part.span),
                planes: planes.take(slots),
                scratch: part.scratch,
            }
        });
        run_parts(executor, parts, |part| level.run(part));
    }
}
