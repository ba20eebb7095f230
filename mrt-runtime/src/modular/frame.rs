//! A frame: lights in, indirect irradiance out (Loos et al. 2011, section 7.3).
//!
//! The cost of a frame depends on what is lit and what changed, not on the size of the level. A block that no light
//! reaches costs nothing. A block whose radiosity did not change keeps its coefficients, and a block keeps its light if
//! no changed block sends light to it. Kept values have the same bits as recomputed ones, unless
//! [`FrameConfig::tolerance`] allows differences.

pub mod config;
pub mod error;
pub mod light_list;
pub mod report;
pub mod stage_clock;
pub mod surface;
mod bounce;
mod direct_stage;
mod flux_limit;
mod light_buffers;
mod outputs;
mod schedule;
mod split;
mod tasks;

use crate::level::block_index::BlockIndex;
use crate::light::direct_light::Shadows;
use crate::light::limits::MAX_LIGHT_VALUE;
use crate::light::source::Light;
use crate::light::visibility::{Openings, Visibility};
use crate::modular::frame::bounce::BounceStage;
use crate::modular::frame::config::{Bounces, FrameConfig};
use crate::modular::frame::direct_stage::{DirectJob, DirectStage};
use crate::modular::frame::error::FrameError;
use crate::modular::frame::light_buffers::LightBuffers;
use crate::modular::frame::light_list::{LightId, LightList};
use crate::modular::frame::outputs::{OutputBuffers, OutputStage};
use crate::modular::frame::report::{FrameReport, FrameWork, ReportSlot};
use crate::modular::frame::schedule::Schedule;
use crate::modular::frame::stage_clock::{Stage, StageClock};
use crate::modular::frame::surface::{Surface, SurfaceError};
use crate::modular::scene::Scene;
use crate::output::lightmap::Lightmap;
use crate::output::probe_order::PROBE_COEFFICIENTS;
use crate::output::probes::{Probes, irradiance_from_probe};
use glam::Vec3;
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::hemisphere_sh::evaluate_f32;
use std::num::NonZero;

/// The light of a scene, frame by frame.
///
/// A frame keeps its [`Scene`], and owns all that changes while a game runs: lights, doors, albedo and emission of
/// walls, and the buffers of every stage. Setting lights and solving allocate nothing, with three exceptions: the
/// caller's [`Executor`](crate::executor::Executor) may allocate, and so does a frame whose previous [`FrameReport`]
/// still exists, or that gets more lights than [`MAX_LIGHTS`](crate::light::limits::MAX_LIGHTS).
///
/// Signals are copied out block by block in the level's order, in a block channel by channel (red, green, blue), in a
/// channel texel by texel in the order of the canonical shape ([`Shape::texels`](crate::level::shape::Shape::texels)).
#[derive(Debug)]
pub struct Frame {
    scene: Scene,
    config: FrameConfig,
    lights: LightList,
    surface: Surface,
    direct_stage: DirectStage,
    schedule: Schedule,
    light: LightBuffers,
    outputs: OutputBuffers,
    report: ReportSlot,
}

impl Frame {
    /// A dark frame of a scene. Outputs in `config` that the dictionary was not baked with stay empty.
    pub fn new(scene: &Scene, config: FrameConfig) -> Self {
        let tasks = LightBuffers::task_count(config.executor.workers());
        let (surface, emits) = Surface::new(scene);
        Self {
            lights: LightList::new(),
            surface,
            direct_stage: DirectStage::new(scene, tasks),
            schedule: Schedule::new(&emits),
            light: LightBuffers::new(scene, tasks),
            outputs: OutputBuffers::new(scene, &config),
            report: ReportSlot::new(scene.level.blocks.len(), &scene.atlas),
            scene: scene.clone(),
            config,
        }
    }

    /// The scene of this frame.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The settings of this frame.
    pub fn config(&self) -> &FrameConfig {
        &self.config
    }

    /// Changes [`FrameConfig::bounces`] from the next solve on.
    pub fn set_bounces(&mut self, bounces: Bounces) {
        self.config.bounces = bounces;
    }

    /// Changes [`FrameConfig::tolerance`], W/m², from the next solve on.
    pub fn set_tolerance(&mut self, tolerance: f32) {
        self.config.tolerance = tolerance;
    }

    /// Changes [`FrameConfig::slice`] from the next solve on.
    pub fn set_slice(&mut self, slice: Option<NonZero<usize>>) {
        self.config.slice = slice;
    }
}

/// Adding, changing and removing lights.
impl Frame {
    /// Adds a light, which shines from the next solve on. Every light gets an id: a light with values out of range, in
    /// no block, or beyond [`MAX_LIGHTS`](crate::light::limits::MAX_LIGHTS) is skipped, and
    /// [`FrameReport::skipped_lights`] names it.
    pub fn add_light(&mut self, light: Light) -> LightId {
        self.lights.add(&self.scene.level, light)
    }

    /// Moves or changes a light. Returns false if the light was removed before.
    pub fn set_light(&mut self, id: LightId, light: Light) -> bool {
        self.lights.set(&self.scene.level, id, light)
    }

    /// Removes a light and returns it; `None` if it was removed before. Other lights keep their ids.
    pub fn remove_light(&mut self, id: LightId) -> Option<Light> {
        self.lights.remove(&self.scene.level, id)
    }

    /// Replaces all lights; earlier ids no longer name a light. For games that keep a list of their own: an unchanged
    /// light at an unchanged position in the list is not computed again.
    pub fn set_lights(&mut self, lights: &[Light]) {
        self.lights.replace(&self.scene.level, lights);
    }

    /// The light that an id names; `None` if it was removed.
    pub fn light(&self, id: LightId) -> Option<Light> {
        self.lights.get(id)
    }

    /// Ids of all lights.
    pub fn light_ids(&self) -> impl Iterator<Item = LightId> + '_ {
        self.lights.ids()
    }
}

/// Doors, colours and scenes that change while a game runs.
impl Frame {
    /// Opens or closes a door, named by its position in [`Level::doors`](crate::level::block::Level::doors), for direct
    /// and indirect light. 1 lets all light through, 0 none; light that does not pass is lost. It takes effect in the
    /// next solve. With [`Rays`](crate::light::visibility::Rays), the caller's function must take doors into account
    /// for direct light.
    ///
    /// # Errors
    /// [`FrameError::Door`], if there is no such door or the value is not in [0, 1].
    pub fn set_door(&mut self, door: usize, value: f32) -> Result<(), FrameError> {
        let count = self.light.doors.len();
        match self.light.doors.get_mut(door) {
            Some(now) if (0.0..=1.0).contains(&value) => {
                self.schedule.doors_moved |= *now != value;
                *now = value;
                Ok(())
            }
            _ => Err(FrameError::Door {
                door,
                count,
                found: value,
            }),
        }
    }

    /// Fraction of light in [0, 1] that each door lets through.
    pub fn doors(&self) -> &[f32] {
        &self.light.doors
    }

    /// Gives each texel of a block an albedo of its own, linear RGB, in the order of the canonical shape's texels.
    /// Texels in holes stay black. The next solve computes all light that it changes.
    ///
    /// # Errors
    /// [`SurfaceError`], if there is no such block, if the number of values is not the number of texels, or if a value
    /// is outside [0, 1]. The frame is then unchanged.
    pub fn set_texel_albedo(
        &mut self,
        block: BlockIndex,
        albedo: &[Vec3],
    ) -> Result<(), SurfaceError> {
        let rank = self.surface.set_albedo(&self.scene, block, albedo)?;
        self.schedule.touch(rank, f32::INFINITY);
        Ok(())
    }

    /// Gives each texel of a block an emitted radiosity of its own, linear RGB, W/m², in the order of the canonical
    /// shape's texels. Texels in holes stay black.
    ///
    /// # Errors
    /// [`SurfaceError`], as in [`Frame::set_texel_albedo`], if a value is outside [0, 1e9].
    pub fn set_texel_emission(
        &mut self,
        block: BlockIndex,
        emission: &[Vec3],
    ) -> Result<(), SurfaceError> {
        let rank = self.surface.set_emission(&self.scene, block, emission)?;
        self.schedule.state[rank.get()].emits = emission.iter().any(|e| *e != Vec3::ZERO);
        self.schedule.touch(rank, f32::INFINITY);
        Ok(())
    }

    /// Linear RGB albedo of a texel of a block; `None` if there is no such block or texel.
    pub fn texel_albedo(&self, block: BlockIndex, texel: usize) -> Option<Vec3> {
        let slot = self.scene.layout.slot(block, texel)?;
        Some(self.surface.albedo.get(slot))
    }

    /// Radiosity that a texel of a block emits, linear RGB, W/m²; `None` if there is no such block or texel.
    pub fn texel_emission(&self, block: BlockIndex, texel: usize) -> Option<Vec3> {
        let slot = self.scene.layout.slot(block, texel)?;
        Some(self.surface.emission.get(slot))
    }

    /// Replaces the scene, for example by the same level with blocks added or removed. Lights and their ids stay.
    ///
    /// For each block of the new scene, `old_block` may name the same block in the present scene. Its indirect light
    /// then stays on the walls that both have: a cube that gains or loses an opening keeps the light of its other
    /// walls; a tube must keep its shape. All other walls start dark. Doors and colours are those of the new level.
    ///
    /// Allocates the buffers of the new scene.
    pub fn change_scene(
        &mut self,
        scene: &Scene,
        old_block: impl Fn(BlockIndex) -> Option<BlockIndex>,
    ) {
        let mut next = Frame::new(scene, self.config.clone());
        std::mem::swap(&mut next.lights, &mut self.lights);
        next.lights.place_in(&scene.level);
        for block in (0..scene.level.blocks.len()).map(BlockIndex::new) {
            if let Some(old) = old_block(block) {
                next.take_indirect(block, self, old);
            }
        }
        *self = next;
    }

    /// Takes the indirect light of a block from a block of another frame, at the walls that both have.
    fn take_indirect(&mut self, block: BlockIndex, from: &Frame, old: BlockIndex) {
        let (level, old_level) = (&self.scene.level, &from.scene.level);
        let (Some(placed), Some(old_placed)) = (level.block(block), old_level.block(old)) else {
            return;
        };
        let old_state = &from.schedule.state[from.scene.layout.rank[old.get()].get()];
        if placed.shape.form != old_placed.shape.form
            || level.resolution != old_level.resolution
            || !old_state.has_indirect
        {
            return;
        }
        let mut old_texel = vec![None; placed.texels.len()];
        for face in Face::ALL {
            for row in 0..level.resolution {
                for column in 0..level.resolution {
                    if let Some(texel) = level.level_texel(block, face, row, column) {
                        old_texel[texel] = old_level.level_texel(old, face, row, column);
                    }
                }
            }
        }
        let layout = &self.scene.layout;
        let rank = layout.rank[block.get()];
        let texel_of_slot = &layout.texel_of_slot[layout.shape(rank)];
        for (slot, &texel) in layout.slots(rank).zip(texel_of_slot) {
            let texel = old_texel.get(texel as usize).copied().flatten();
            if let Some(shown) = texel.and_then(|texel| from.scene.layout.slot(old, texel)) {
                let irradiance = from.light.indirect.get(shown);
                self.light.indirect.set(slot, irradiance);
            }
        }
        self.schedule.state[rank.get()].has_indirect = true;
        self.schedule.touch(rank, f32::INFINITY);
        // The lightmap of the new scene is dark: show this light at once, even where blocks wait for their turn.
        self.schedule.mark_changed(rank);
    }
}

/// Computing light.
impl Frame {
    /// Computes direct and indirect irradiance, with shadows of direct light by walls and openings.
    ///
    /// It cannot fail: lights that cannot shine are skipped, and the report names them.
    pub fn solve(&mut self) -> FrameReport {
        self.solve_with(&Openings)
    }

    /// Same as [`Frame::solve`], with shadows of direct light by the caller, such as rays into the real mesh.
    pub fn solve_with<V: Visibility>(&mut self, visibility: &V) -> FrameReport {
        let mut clock = StageClock::start();
        let report = self.report.begin();
        // 1. List the lights that cannot shine.
        self.lights.list_skipped(&mut report.skipped);
        // 2. Compute direct light at texels.
        let job = DirectJob {
            scene: &self.scene,
            config: &self.config,
            shadows: Shadows {
                level: &self.scene.level,
                doors: &self.light.doors,
                visibility,
            },
            lights: self.lights.placed(),
            most: blocks_at_most(&self.config),
        };
        let direct = &mut self.light.direct;
        report.work = FrameWork {
            direct: self.direct_stage.update(&job, direct, &mut self.schedule),
            ..FrameWork::default()
        };
        clock.lap(Stage::Direct);
        // 3. Compute bounces. 4. Fill outputs.
        self.finish(clock)
    }

    /// Same as [`Frame::solve`], from direct irradiance that the caller computed, W/m², in the order of
    /// [`Frame::copy_direct_to`]. The lights of the frame do not shine, and the report has no skipped lights.
    ///
    /// # Errors
    /// [`FrameError::Direct`], if the number of values is not three for each texel, or a value is negative, too large
    /// or NaN. The frame is then unchanged.
    pub fn solve_from_direct(&mut self, direct: &[f32]) -> Result<FrameReport, FrameError> {
        let mut clock = StageClock::start();
        let is_irradiance = |e: &f32| (0.0..=MAX_LIGHT_VALUE).contains(e);
        let faulty = direct.iter().position(|e| !is_irradiance(e));
        let expected = 3 * self.scene.texel_count();
        if direct.len() != expected || faulty.is_some() {
            return Err(FrameError::Direct {
                expected,
                found: direct.len(),
                faulty,
            });
        }
        let report = self.report.begin();
        report.work = FrameWork {
            direct: self.scene.level.blocks.len(),
            ..FrameWork::default()
        };
        let planes = &mut self.light.direct;
        self.direct_stage
            .take_from_caller(&self.scene, direct, planes, &mut self.schedule);
        clock.lap(Stage::Direct);
        Ok(self.finish(clock))
    }

    /// Computes bounces of the present direct light, and fills outputs and report.
    fn finish(&mut self, mut clock: StageClock) -> FrameReport {
        let report = self.report.data();
        let mut bounces = BounceStage {
            scene: &self.scene,
            config: &self.config,
            surface: &self.surface,
            schedule: &mut self.schedule,
            light: &mut self.light,
            work: &mut report.work,
            clock: &mut clock,
            direct_waits: self.direct_stage.has_waiting(),
        };
        report.passes = bounces.run();
        if report.passes == 0 {
            // Truncation can leave a little light in probes of blocks whose walls are dark, and those blocks are in no
            // list.
            self.outputs.darken();
        }
        self.outputs.fill(OutputStage {
            scene: &self.scene,
            config: &self.config,
            schedule: &mut self.schedule,
            light: &mut self.light,
            report,
            clock: &mut clock,
        });
        #[cfg(feature = "timing")]
        {
            report.times = clock.times();
        }
        self.report.finish()
    }

    /// The report of the last solve; an empty one before the first.
    pub fn last_report(&self) -> FrameReport {
        self.report.finish()
    }

    /// Makes the next solve compute everything again. For measurements, and for callers whose shadows changed without a
    /// new [`version`](Visibility::version).
    pub fn forget(&mut self) {
        self.direct_stage.forget();
        self.schedule.all_stale = true;
    }
}

/// Reading results.
impl Frame {
    /// Replaces the content of `out` by the direct irradiance, W/m², of all texels.
    pub fn copy_direct_to(&self, out: &mut Vec<f32>) {
        self.scene.layout.copy_by_texel(&self.light.direct, out);
    }

    /// Replaces the content of `out` by the indirect irradiance, W/m², of all texels, not multiplied by their albedo.
    pub fn copy_indirect_to(&self, out: &mut Vec<f32>) {
        self.scene.layout.copy_by_texel(&self.light.indirect, out);
    }

    /// Replaces the content of `out` by the coefficients b, block by block, in a block channel by channel.
    pub fn copy_coefficients_to(&self, out: &mut Vec<f32>) {
        out.clear();
        let rows = &self.scene.rows;
        for &rank in &self.scene.layout.rank {
            let row_of_mode = &rows.row_of_mode[self.scene.layout.shape(rank)];
            let of_block = &self.light.coefficients[rows.of_block(rank)];
            for channel in of_block.chunks_exact(rows.count) {
                out.extend(row_of_mode.iter().map(|&row| channel[usize::from(row)]));
            }
        }
    }

    /// Direct irradiance, W/m², RGB, of one texel of a block; `None` if there is no such block or texel.
    pub fn direct_at(&self, block: BlockIndex, texel: usize) -> Option<Vec3> {
        let slot = self.scene.layout.slot(block, texel)?;
        Some(self.light.direct.get(slot))
    }

    /// Indirect irradiance, W/m², RGB, of one texel of a block; `None` if there is no such block or texel.
    pub fn indirect_at(&self, block: BlockIndex, texel: usize) -> Option<Vec3> {
        let slot = self.scene.layout.slot(block, texel)?;
        Some(self.light.indirect.get(slot))
    }

    /// The padded lightmap of indirect irradiance; without pixels unless
    /// [`Outputs::lightmap`](config::Outputs::lightmap) is set.
    pub fn lightmap(&self) -> Lightmap<'_> {
        Lightmap::new(&self.scene.atlas, &self.outputs.lightmap)
    }

    /// All probes; `None` unless [`Outputs::probes`](config::Outputs::probes) is set and the dictionary has probes.
    pub fn probes(&self) -> Option<&Probes> {
        self.outputs.probes.as_ref()
    }

    /// Spherical harmonics of indirect radiance in world axes, with RGB for each, at a point in metres: trilinear
    /// between the probes around it. `None` outside all blocks, and without probes
    /// ([`Outputs::probes`](config::Outputs::probes)).
    ///
    /// Cost: independent of the number of blocks.
    pub fn probe_at(&self, point: Vec3) -> Option<[[f32; 3]; PROBE_COEFFICIENTS]> {
        let probes = self.outputs.probes.as_ref()?;
        probes.at(&self.scene.level, point.as_dvec3())
    }

    /// Indirect irradiance, W/m², RGB, on a surface with a unit normal at a point in metres, such as the surface of a
    /// moving object; `None` where [`Frame::probe_at`] is `None`.
    pub fn irradiance_at(&self, point: Vec3, normal: Vec3) -> Option<Vec3> {
        Some(irradiance_from_probe(&self.probe_at(point)?, normal))
    }

    /// Vector irradiance: block by block, in a block channel by channel, in a channel texel by texel, for each texel
    /// four coefficients of 1, v, normal and u in the texel's tangent frame. [`evaluate_f32`] gives the irradiance for
    /// a normal. Empty unless [`Outputs::vector`](config::Outputs::vector) is set and the dictionary has it.
    pub fn vector(&self) -> &[f32] {
        &self.outputs.vector
    }

    /// Indirect irradiance, W/m², RGB, at one texel of a block for a unit normal in the texel's tangent frame (its
    /// components along u, along v, along the wall's normal); 0 where truncation makes it negative. `None` if there is
    /// no such block or texel, and without vector irradiance ([`Outputs::vector`](config::Outputs::vector)).
    pub fn vector_at(&self, block: BlockIndex, texel: usize, normal: Vec3) -> Option<Vec3> {
        let range = &self.scene.level.block(block)?.texels;
        if texel >= range.len() || self.outputs.vector.is_empty() {
            return None;
        }
        let start = 4 * (3 * range.start + texel);
        let channel = |channel: usize| {
            let at = start + 4 * channel * range.len();
            let coefficients = std::array::from_fn(|k| self.outputs.vector[at + k]);
            evaluate_f32(&coefficients, normal).max(0.0)
        };
        Some(Vec3::new(channel(0), channel(1), channel(2)))
    }
}

/// Most blocks whose direct light one frame computes.
fn blocks_at_most(config: &FrameConfig) -> usize {
    match (config.slice, config.bounces) {
        (Some(slice), Bounces::Count(1) | Bounces::Feedback) => slice.get(),
        _ => usize::MAX,
    }
}
