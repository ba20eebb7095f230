//! A frame: lights in, indirect irradiance out (Loos et al. 2011, section 7.3).
//!
//! Cost follows what is lit and what changed, not what is loaded. A block that no light reaches is not touched; one
//! whose radiosity is what it was keeps its coefficients, and blocks that none of the changed ones sends light to keep
//! their light. Everything kept has the bits that computing it again would give ([`FrameConfig::tolerance`] allows more).

mod blocks;
mod config;
mod direct_stage;
mod kernels;
mod limit;
mod pass;
mod tasks;

use crate::executor::MAX_TASKS;
use crate::light::placed::{Light, LightError, MAX_LIGHT_VALUE, place};
use crate::light::visibility::Visibility;
use crate::modular::scene::{Layout, Planes, Scene};
use crate::output::probes::Probes;
use blocks::Blocks;
pub use config::{Bounces, FrameConfig, Outputs};
use direct_stage::DirectStage;
use glam::Vec3;
pub(crate) use kernels::{Expand, Scratch};
use mrt_core::lighting::hemisphere_sh::evaluate_f32;
use mrt_core::simd::Aligned;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Lights in one frame, at most.
pub const MAX_LIGHTS: usize = 1024;

/// Passes in one frame, at most: at albedo 0.99 the light left after them is 1e-18 of the first.
pub const MAX_PASSES: u32 = 4096;

/// Time of each stage of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Direct light.
    pub direct: Duration,
    /// `b = T_d->b l`.
    pub coefficients: Duration,
    /// `r = T_b->r b`.
    pub responses: Duration,
    /// Irradiance from the joint basis, `U_b b + U_r r`.
    pub indirect: Duration,
    /// Lightmap atlas.
    pub atlas: Duration,
    /// Probes, if asked for.
    pub probes: Duration,
    /// Vector irradiance, if asked for.
    pub vector: Duration,
}

/// Blocks that the last frame worked on, each once a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameWork {
    /// Blocks whose direct light was computed.
    pub direct: usize,
    /// Blocks whose coefficients b were computed.
    pub sources: usize,
    /// Blocks whose indirect light was computed.
    pub targets: usize,
    /// Blocks that changed light was sent to and whose light stays what it was: it changes by no more than
    /// [`FrameConfig::tolerance`].
    pub kept: usize,
    /// Channels that were scaled down, as more light arrived in them than left: then the next frame computes all anew.
    pub limited: usize,
}

impl StageTimes {
    /// Sum over the stages.
    pub fn total(&self) -> Duration {
        self.direct
            + self.coefficients
            + self.responses
            + self.indirect
            + self.atlas
            + self.probes
            + self.vector
    }
}

/// The buffers of a frame, made once for a scene; frames allocate nothing (what a caller's
/// [`Executor`](crate::executor::Executor) does aside, and the first frame of another scene with probes).
///
/// [`Frame::direct`], [`Frame::indirect`] and [`Frame::coefficients`] give signals block by block in the level's order, in
/// a block channel by channel (red, green, blue), and in a channel texel by texel in the canonical shape's order. They
/// copy; games read the lightmap, probes or [`Frame::indirect_at`].
#[derive(Debug)]
pub struct Frame {
    config: FrameConfig,
    layout: Arc<Layout>,
    /// [`Surface::revision`](crate::modular::scene::Surface) of the scene that the buffers hold the light of.
    revision: u64,
    lights: DirectStage,
    direct: Planes,
    indirect: Planes,
    coefficients: Aligned<f32>,
    joint: Aligned<f32>,
    doors: Vec<f32>,
    gate_values: Vec<f32>,
    blocks: Blocks,
    scratch: Vec<Scratch>,
    lightmap: Vec<[f32; 3]>,
    atlas_size: usize,
    probes: Option<Probes>,
    vector: Vec<f32>,
    times: StageTimes,
    work: FrameWork,
    passes: u32,
}

/// Why a frame was not computed; its results are those of the frame before.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// A light is refused.
    #[error(transparent)]
    Light(#[from] LightError),
    /// Above [`MAX_LIGHTS`].
    #[error("the frame has {found} lights; expected at most {MAX_LIGHTS}")]
    TooManyLights {
        /// Lights given.
        found: usize,
    },
    /// Direct light from the caller has the wrong length, or values that are no irradiance.
    #[error(
        "direct light has {found} values, the first that is no irradiance at {faulty:?}; expected \
         {expected} values in [0, {MAX_LIGHT_VALUE}]"
    )]
    Direct {
        /// Three values a texel.
        expected: usize,
        /// Values given.
        found: usize,
        /// Position of the first that is negative, too large or NaN.
        faulty: Option<usize>,
    },
    /// No such door, or not a value for one.
    #[error("door {door} is set to {found}; expected one of {count} doors and a value in [0, 1]")]
    Door {
        /// The door given.
        door: usize,
        /// Doors in the scene.
        count: usize,
        /// The value given.
        found: f32,
    },
    /// The buffers were made for a scene of another size.
    #[error("the frame's buffers hold {expected} {what}; the scene has {found}")]
    OtherScene {
        /// What there is another number of.
        what: &'static str,
        /// Those of the scene that the buffers were made for.
        expected: usize,
        /// Those of the scene given.
        found: usize,
    },
}

impl Frame {
    /// Buffers for frames of a scene, all dark, with irradiance and lightmap only.
    pub fn new(scene: &Scene) -> Self {
        Self::with_config(scene, FrameConfig::default())
    }

    /// Buffers for frames of a scene, all dark, with everything asked for that the dictionary was baked with.
    pub fn with_outputs(scene: &Scene, outputs: Outputs) -> Self {
        let config = FrameConfig {
            outputs,
            ..FrameConfig::default()
        };
        Self::with_config(scene, config)
    }

    /// Buffers for frames of a scene, all dark.
    pub fn with_config(scene: &Scene, config: FrameConfig) -> Self {
        let layout = &scene.layout;
        let blocks = layout.block_count();
        let slots = layout.slots.iter().map(|range| range.len()).max();
        let slots = slots.unwrap_or(0);
        let coefficients = 3 * layout.rows;
        let tasks = match config.executor.workers() {
            0 | 1 => 1,
            _ => MAX_TASKS,
        };
        let outputs = config.outputs;
        let atlas_size = scene.atlas.width * scene.atlas.height;
        Self {
            layout: layout.clone(),
            revision: 0,
            lights: DirectStage::new(scene, tasks, slots),
            direct: Planes::new(layout.slot_count()),
            indirect: Planes::new(layout.slot_count()),
            coefficients: Aligned::zeroed(coefficients * blocks),
            joint: Aligned::zeroed(coefficients * blocks),
            doors: scene.doors.clone(),
            gate_values: vec![0.0; scene.transport.gates.len()],
            blocks: Blocks::new(blocks, scene.atlas.tile_list_size()),
            scratch: vec![Scratch::new(slots, coefficients); tasks],
            lightmap: if outputs.lightmap {
                vec![[0.0; 3]; atlas_size]
            } else {
                Vec::new()
            },
            atlas_size,
            probes: outputs.probes.and_then(|order| Probes::new(scene, order)),
            vector: if outputs.vector && scene.has_vector() {
                vec![0.0; 12 * scene.texel_count()]
            } else {
                Vec::new()
            },
            times: StageTimes::default(),
            work: FrameWork::default(),
            passes: 0,
            config,
        }
    }

    /// Computes direct and indirect irradiance for the lights.
    ///
    /// # Errors
    /// [`FrameError`]; the frame then holds what it held before.
    pub fn solve<V: Visibility>(
        &mut self,
        scene: &Scene,
        lights: &[Light],
        visibility: &V,
        bounces: Bounces,
    ) -> Result<(), FrameError> {
        self.check(scene, lights)?;
        let start = Instant::now();
        self.begin(scene);
        self.update_direct(scene, visibility, bounces);
        self.times = StageTimes {
            direct: start.elapsed(),
            ..StageTimes::default()
        };
        self.bounce(scene, bounces);
        self.fill_outputs(scene);
        Ok(())
    }

    /// As [`Frame::solve`], for direct irradiance that the caller computed, in this struct's order.
    ///
    /// # Errors
    /// [`FrameError::OtherScene`] and [`FrameError::Direct`]; the frame then holds what it held before.
    pub fn solve_from_direct(
        &mut self,
        scene: &Scene,
        direct: &[f32],
        bounces: Bounces,
    ) -> Result<(), FrameError> {
        self.check_scene(scene)?;
        let faulty = direct
            .iter()
            .position(|e| !(0.0..=MAX_LIGHT_VALUE).contains(e));
        let expected = 3 * scene.texel_count();
        if direct.len() != expected || faulty.is_some() {
            return Err(FrameError::Direct {
                expected,
                found: direct.len(),
                faulty,
            });
        }
        let start = Instant::now();
        self.begin(scene);
        self.work = FrameWork {
            direct: scene.blocks.len(),
            ..FrameWork::default()
        };
        self.take_direct(scene, direct);
        self.times = StageTimes {
            direct: start.elapsed(),
            ..StageTimes::default()
        };
        self.bounce(scene, bounces);
        self.fill_outputs(scene);
        Ok(())
    }

    /// Lets the next frame compute everything anew, as if nothing were known: for measurements, and for callers that
    /// changed what frames cannot see.
    pub fn forget(&mut self) {
        self.lights.forget();
        self.blocks.all_stale = true;
    }

    /// Forgets everything if the scene is not the one of the frame before, or has changed.
    fn begin(&mut self, scene: &Scene) {
        if self.revision == scene.surface.revision {
            return;
        }
        self.revision = scene.surface.revision;
        let same_blocks = Arc::ptr_eq(&self.layout, &scene.layout);
        self.layout = scene.layout.clone();
        self.direct.clear();
        self.indirect.clear();
        self.coefficients.fill(0.0);
        self.joint.fill(0.0);
        self.lightmap.fill([0.0; 3]);
        self.vector.fill(0.0);
        match &mut self.probes {
            Some(probes) if same_blocks => probes.darken(),
            // This allocates; surfaces that change do not come here.
            Some(probes) => probes.restart(scene),
            None => {}
        }
        self.lights.restart(scene);
        self.blocks.restart(&scene.surface.emitting);
    }

    fn fill_outputs(&mut self, scene: &Scene) {
        let (level, executor) = (self.config.simd, &*self.config.executor);
        self.blocks.changed.sort_unstable();
        let changed = &self.blocks.changed;
        let start = Instant::now();
        if self.config.outputs.lightmap {
            scene.atlas.fill(
                changed,
                &mut self.blocks.tiles,
                &self.indirect,
                &mut self.lightmap,
                executor,
            );
        }
        let after_atlas = Instant::now();
        let joint = |place: usize| {
            let size = 3 * self.layout.rows;
            &self.joint[place * size..(place + 1) * size]
        };
        if let Some(probes) = &mut self.probes {
            for &place in changed {
                let place = place as usize;
                let scratch = &mut self.scratch[0];
                probes.fill(scene, place, level, joint(place), scratch);
            }
        }
        let after_probes = Instant::now();
        if !self.vector.is_empty() {
            for &place in changed {
                let place = place as usize;
                let block = &scene.blocks[self.layout.order[place] as usize];
                let out = &mut self.vector[12 * block.texels.start..12 * block.texels.end];
                let (red, rest) = out.split_at_mut(4 * block.texels.len());
                let (green, blue) = rest.split_at_mut(4 * block.texels.len());
                let basis = &scene.shapes[block.shape_index].vector;
                level.run(Expand {
                    basis,
                    rows: basis.rows,
                    joint: joint(place),
                    scratch: &mut self.scratch[0],
                    out: [red, green, blue],
                });
            }
        }
        self.times.atlas = after_atlas - start;
        self.times.probes = after_probes - after_atlas;
        self.times.vector = after_probes.elapsed();
        self.blocks.clear_changed();
    }

    fn check_scene(&self, scene: &Scene) -> Result<(), FrameError> {
        // Doors and shapes may differ where the number of texels does not.
        let pixels = scene.atlas.width * scene.atlas.height;
        let slots = scene.shapes.iter().map(|shape| shape.folding.slots());
        let (largest_block, largest_room) = (slots.max().unwrap_or(0), self.lights.slots());
        for (what, expected, found) in [
            ("texels", self.layout.texel_count(), scene.texel_count()),
            ("blocks", self.layout.block_count(), scene.blocks.len()),
            (
                "texel slots",
                self.direct.slots(),
                scene.layout.slot_count(),
            ),
            (
                "texel slots in a block",
                largest_room,
                largest_block.max(largest_room),
            ),
            (
                "coefficients",
                self.coefficients.len() / 3,
                scene.layout.rows * scene.blocks.len(),
            ),
            (
                "sets of doors that light passes",
                self.gate_values.len(),
                scene.transport.gates.len(),
            ),
            ("doors", self.doors.len(), scene.doors.len()),
            (
                "blocks with probes",
                self.probes.as_ref().map_or(0, Probes::block_count),
                self.probes.as_ref().map_or(0, |_| scene.blocks.len()),
            ),
            (
                "probes along an edge",
                self.probes.as_ref().map_or(0, Probes::per_axis),
                self.probes.as_ref().map_or(0, |_| scene.probes),
            ),
            (
                "texels with vector irradiance",
                self.vector.len() / 12,
                if self.vector.is_empty() || !scene.has_vector() {
                    0
                } else {
                    scene.texel_count()
                },
            ),
            ("lightmap pixels", self.atlas_size, pixels),
        ] {
            if found != expected {
                return Err(FrameError::OtherScene {
                    what,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }

    fn check(&mut self, scene: &Scene, lights: &[Light]) -> Result<(), FrameError> {
        self.check_scene(scene)?;
        if lights.len() > MAX_LIGHTS {
            return Err(FrameError::TooManyLights {
                found: lights.len(),
            });
        }
        self.lights.next.clear();
        for (index, &light) in lights.iter().enumerate() {
            self.lights.next.push(place(scene, index, light)?);
        }
        Ok(())
    }

    /// Opens or closes a door for direct and indirect light ([`Rays`](crate::light::visibility::Rays) ask the caller's function
    /// alone, which must know it): 1 lets everything through, 0 nothing; what does not pass is lost. The next
    /// frame sees it.
    ///
    /// # Errors
    /// [`FrameError::Door`], if there is no such door or the value is not in [0, 1].
    pub fn set_door(&mut self, door: usize, value: f32) -> Result<(), FrameError> {
        let count = self.doors.len();
        match self.doors.get_mut(door) {
            Some(place) if (0.0..=1.0).contains(&value) => {
                self.blocks.doors_moved |= *place != value;
                *place = value;
                Ok(())
            }
            _ => Err(FrameError::Door {
                door,
                count,
                found: value,
            }),
        }
    }

    /// Value of each door.
    pub fn doors(&self) -> &[f32] {
        &self.doors
    }

    /// Direct irradiance, W/m².
    pub fn direct(&self) -> Vec<f32> {
        self.layout.by_texel(&self.direct)
    }

    /// Indirect irradiance, W/m², not multiplied by the receiving texel's albedo.
    pub fn indirect(&self) -> Vec<f32> {
        self.layout.by_texel(&self.indirect)
    }

    /// Indirect irradiance, RGB, of one texel of a block; the scene must be the one that was solved.
    ///
    /// # Panics
    /// If the scene has no such block or the block no such texel.
    pub fn indirect_at(&self, scene: &Scene, block: usize, texel: usize) -> [f32; 3] {
        let range = &scene.blocks[block].texels;
        assert!(texel < range.len(), "texel {texel} of {}", range.len());
        self.indirect.get(scene.slot_in(block, texel)).to_array()
    }

    /// Coefficients b: block by block, channel by channel.
    pub fn coefficients(&self) -> Vec<f32> {
        let layout = &*self.layout;
        let mut out = Vec::new();
        for &place in &layout.rank {
            let place = place as usize;
            let rows = &layout.row_of_mode[layout.shapes[place] as usize];
            for channel in 0..3 {
                let start = (3 * place + channel) * layout.rows;
                let of_block = &self.coefficients[start..start + layout.rows];
                out.extend(rows.iter().map(|&row| of_block[usize::from(row)]));
            }
        }
        out
    }

    /// Padded lightmap of indirect irradiance, row by row, see [`Scene::atlas`]; empty if not asked for.
    pub fn lightmap(&self) -> &[[f32; 3]] {
        &self.lightmap
    }

    /// Probes, if asked for and there are any.
    pub fn probes(&self) -> Option<&Probes> {
        self.probes.as_ref()
    }

    /// Vector irradiance, if asked for and there is any: block by block, in a block channel by channel, in a
    /// channel texel by texel four coefficients of 1, v, normal and u in the texel's tangent frame.
    /// [`mrt_core::lighting::hemisphere_sh::evaluate_f32`] gives irradiance for a normal.
    pub fn vector(&self) -> &[f32] {
        &self.vector
    }

    /// Indirect irradiance, RGB, at one texel of a block for a unit normal in the texel's tangent frame (along u,
    /// along v, along the wall's normal); zero where truncation makes it negative, and without vector irradiance.
    ///
    /// # Panics
    /// If the scene has no such block or the block no such texel.
    pub fn vector_at(&self, scene: &Scene, block: usize, texel: usize, normal: Vec3) -> [f32; 3] {
        let range = &scene.blocks[block].texels;
        assert!(texel < range.len(), "texel {texel} of {}", range.len());
        if self.vector.is_empty() {
            return [0.0; 3];
        }
        let start = 4 * (3 * range.start + texel);
        std::array::from_fn(|channel| {
            let at = start + 4 * channel * range.len();
            let c = std::array::from_fn(|k| self.vector[at + k]);
            evaluate_f32(&c, normal).max(0.0)
        })
    }

    /// Time that each stage took, summed over the passes.
    pub fn times(&self) -> StageTimes {
        self.times
    }

    /// Blocks that the last frame worked on.
    pub fn work(&self) -> FrameWork {
        self.work
    }

    /// Passes of the last frame.
    pub fn passes(&self) -> u32 {
        self.passes
    }
}
