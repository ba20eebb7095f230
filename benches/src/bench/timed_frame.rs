//! The frame, as it is measured: everything in the benchmark that knows how `mrt-runtime` is called.

use super::frame_variant::{FrameVariant, assemble_config};
use super::lit_maze::{ALBEDO, LitMaze};
use super::sampled_texel::SampledTexel;
use super::timing::Timed;
use mrt_runtime::executor::{Executor, Rayon, Serial};
use mrt_runtime::{
    AssembleConfig, AssembleError, BlockIndex, Bounces, Frame, FrameConfig, Light, LightId, Scene,
    SkippedLight,
};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::sync::Arc;

/// Why a variant cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum TimedFrameError {
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// A light does not shine.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// The system gives no threads.
    #[error("no threads: {0}")]
    Threads(#[from] ThreadPoolBuildError),
}

impl TimedFrameError {
    /// True where the level needs more memory than a benchmark may take.
    pub fn is_size(&self) -> bool {
        matches!(
            self,
            TimedFrameError::Assemble(AssembleError::TooLarge { .. })
        )
    }
}

/// Names of the stages that are timed, in the order of [`Timed::run`].
pub const STAGES: [&str; 5] = ["direct", "T_d->b", "T_b->r", "U", "atlas"];

/// From direct light to indirect light.
pub const INDIRECT_STAGES: [usize; 3] = [1, 2, 3];

/// From lights to indirect light.
pub const LIGHT_STAGES: [usize; 4] = [0, 1, 2, 3];

/// A whole frame.
pub const ALL_STAGES: [usize; 5] = [0, 1, 2, 3, 4];

/// The least that a stage has to do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Operations of the products that are made, a multiplication and an addition being two; 0 for stages without
    /// products.
    pub flops: f64,
    /// Bytes that are read and written, each once.
    pub bytes: f64,
}

/// A fixed number of threads, none of which is the caller's; a frame is best called from one of them.
#[derive(Clone, Debug)]
struct Pool(Arc<ThreadPool>);

impl Executor for Pool {
    fn workers(&self) -> usize {
        self.0.current_num_threads()
    }

    fn run(&self, tasks: usize, task: &(dyn Fn(usize) + Sync)) {
        self.0.install(|| Rayon.run(tasks, task));
    }
}

/// What happens between two frames that are timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Everything is forgotten, so that a frame computes everything that is lit.
    Everything,
    /// The first light moves; light that does not depend on it is kept.
    OneLight,
    /// All lights move: all blocks that they light are computed, and blocks that stay dark are kept.
    AllLights,
}

/// How far a moving light goes, in blocks. It moves there and back in turns and never leaves its block.
const STEP: f32 = 0.05;

/// A scene and its frame.
pub struct TimedFrame {
    /// The scene.
    pub scene: Scene,
    config: FrameConfig,
    frame: Frame,
    ids: Vec<LightId>,
    lights: Vec<Light>,
    motion: Motion,
    is_moved: bool,
    pool: Option<Pool>,
}

impl TimedFrame {
    /// Assembles a level, and solves a first frame.
    ///
    /// # Errors
    /// [`TimedFrameError`].
    pub fn new(maze: &LitMaze, variant: &FrameVariant) -> Result<Self, TimedFrameError> {
        let [shape_storage, transport_storage] = variant.storage.storages();
        let config = AssembleConfig {
            shape_storage,
            transport_storage,
            ..assemble_config(variant.coupling)
        };
        let scene = Scene::assemble(&maze.level, variant.dictionary, &config)?;
        let pool = match variant.threads {
            0 | 1 => None,
            threads => {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
                Some(Pool(Arc::new(pool)))
            }
        };
        let executor: Arc<dyn Executor> = match &pool {
            None => Arc::new(Serial),
            Some(pool) => Arc::new(pool.clone()),
        };
        let config = FrameConfig {
            simd: variant.simd,
            executor,
            bounces: Bounces::Count(1),
            ..FrameConfig::default()
        };
        let (frame, ids) = first_frame(&scene, &config, &maze.lights)?;
        Ok(Self {
            scene,
            config,
            frame,
            ids,
            lights: maze.lights.clone(),
            motion: Motion::Everything,
            is_moved: false,
            pool,
        })
    }

    /// Sets what happens between frames.
    pub fn with_motion(self, motion: Motion) -> Self {
        Self { motion, ..self }
    }

    /// Sets [`FrameConfig::tolerance`] to a share of the brightest indirect irradiance, and solves a first frame.
    ///
    /// # Errors
    /// [`TimedFrameError::Skipped`].
    pub fn with_tolerance(mut self, share: f32) -> Result<Self, TimedFrameError> {
        let brightest = self.indirect().into_iter().fold(0.0, f32::max);
        let config = FrameConfig {
            tolerance: share * brightest,
            ..self.config.clone()
        };
        (self.frame, self.ids) = first_frame(&self.scene, &config, &self.lights)?;
        self.config = config;
        Ok(self)
    }

    /// The largest error of a texel that [`FrameConfig::tolerance`] states for one bounce, W/m², with the albedo of the
    /// benchmark's levels.
    pub fn stated_error(&self) -> f64 {
        f64::from(self.config.tolerance * (1.0 + ALBEDO.max_element()))
    }

    /// Moves lights that are where they began to where they go.
    pub fn go(&mut self) {
        if !self.is_moved {
            self.run();
        }
    }

    /// The largest difference of a texel's indirect irradiance from that in another frame of the same level, W/m².
    pub fn largest_difference(&self, other: &Self) -> f64 {
        let (a, b) = (self.indirect(), other.indirect());
        let apart = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
        f64::from(apart.fold(0.0, f32::max))
    }

    /// Moves the first lights there or back.
    fn move_lights(&mut self, count: usize) {
        self.is_moved = !self.is_moved;
        let step = if self.is_moved { STEP } else { -STEP };
        for (light, &id) in self.lights[..count].iter_mut().zip(&self.ids) {
            if let Light::Sphere { position, .. } = light {
                position.x += step;
            }
            self.frame.set_light(id, *light);
        }
    }

    /// Direct irradiance of the last frame, block by block in the level's order, in a block channel by channel.
    pub fn direct(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.frame.copy_direct_to(&mut copy);
        copy
    }

    /// Indirect irradiance of the last frame, in the same order.
    fn indirect(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.frame.copy_indirect_to(&mut copy);
        copy
    }

    /// Indirect irradiance of the last frame at some texels, W/m².
    pub fn irradiance(&self, texels: &[SampledTexel]) -> Vec<[f64; 3]> {
        let at = |sampled: &SampledTexel| {
            let texel = texel_of(&self.scene, sampled);
            let indirect = self
                .frame
                .indirect_at(BlockIndex::new(sampled.block), texel);
            let indirect = indirect.expect("sampled texels are texels of the scene");
            indirect.to_array().map(f64::from)
        };
        texels.iter().map(at).collect()
    }

    /// Texels along an edge of a wall.
    pub fn resolution(&self) -> usize {
        self.scene.level.resolution
    }

    /// Modes `k_b` of the block that has most.
    pub fn modes(&self) -> usize {
        let blocks = self.scene.blocks.iter();
        blocks.map(|b| b.coefficients.len()).max().unwrap_or(0)
    }

    /// Blocks that indirect light reached in the last frame.
    pub fn lit_blocks(&self) -> usize {
        let [_, _, indirect] = self.lit();
        indirect.into_iter().filter(|&is_lit| is_lit).count()
    }

    /// Bytes that the scene and the frame hold while frames are computed.
    pub fn resident_bytes(&self) -> usize {
        let scene = &self.scene;
        // Positions, normals, albedo and emission; direct and indirect light.
        let slots = scene.layout.slot_count() * (4 * RGB_BYTES + 2 * RGB_BYTES);
        let lightmap = size_of_val(self.frame.lightmap().pixels());
        scene.operator_bytes() + slots + self.signal_bytes().iter().sum::<usize>() + lightmap
    }

    /// Bytes of b and r of all blocks.
    fn signal_bytes(&self) -> [usize; 2] {
        let scene = &self.scene;
        [RGB_BYTES * scene.rows.count * scene.blocks.len(); 2]
    }

    /// What each of [`STAGES`] had to do for the light of the last frame: the products of blocks with light, folded by
    /// mirrors and without what is negligible.
    pub fn costs(&self) -> [Cost; STAGES.len()] {
        let scene = &self.scene;
        let layout = &scene.layout;
        let [direct, coefficients, indirect] = self.lit();
        let of_lit = |is_lit: &[bool], of_rank: &dyn Fn(usize) -> f64| -> f64 {
            let lit = (0..layout.block_count()).filter(|&rank| is_lit[rank]);
            lit.map(of_rank).sum()
        };
        let slots = |rank: usize| (RGB_BYTES * layout.slots[rank].len()) as f64;
        let rows = |_| (RGB_BYTES * scene.rows.count) as f64;
        let products = |stage: usize| {
            move |rank: usize| {
                let shape = &scene.shapes[layout.shapes[rank] as usize];
                2.0 * shape.multiply_adds()[stage] as f64
            }
        };
        let lightmap = size_of_val(self.frame.lightmap().pixels()) as f64;
        let mut operators = [0.0; 2];
        for shape in &scene.shapes {
            for (sum, bytes) in operators.iter_mut().zip(shape.stage_bytes()) {
                *sum += bytes as f64;
            }
        }
        let transport = scene.transport.multiply_adds_from(&coefficients) as f64;
        let [of_all, _] = scene.transport.multiply_adds();
        let share = transport / (of_all as f64).max(1.0);
        let (b, joint) = (of_lit(&coefficients, &rows), of_lit(&indirect, &rows));
        [
            // Positions and normals in, direct light out.
            Cost {
                flops: 0.0,
                bytes: 3.0 * of_lit(&direct, &slots),
            },
            // Direct light and albedo in.
            Cost {
                flops: of_lit(&coefficients, &products(0)),
                bytes: operators[0] + 2.0 * of_lit(&coefficients, &slots) + b,
            },
            Cost {
                flops: 2.0 * transport,
                bytes: share * scene.transport.bytes() as f64 + b + joint,
            },
            Cost {
                flops: of_lit(&indirect, &products(1)),
                bytes: operators[1] + joint + of_lit(&indirect, &slots),
            },
            Cost {
                flops: 0.0,
                bytes: of_lit(&indirect, &slots) + lightmap,
            },
        ]
    }

    /// By rank of a block: whether it has direct light, coefficients b and indirect light.
    fn lit(&self) -> [Vec<bool>; 3] {
        let mut coefficients = Vec::new();
        self.frame.copy_coefficients_to(&mut coefficients);
        let signals = [self.direct(), coefficients, self.indirect()];
        let mut lit = [(); 3].map(|()| vec![false; self.scene.level.blocks.len()]);
        let blocks = self.scene.blocks.iter().zip(&self.scene.level.blocks);
        for ((block, placed), &rank) in blocks.zip(&self.scene.layout.rank) {
            let ranges = [&placed.texels, &block.coefficients, &placed.texels];
            for ((lit, signal), range) in lit.iter_mut().zip(&signals).zip(ranges) {
                let values = &signal[3 * range.start..3 * range.end];
                lit[rank.get()] = values.iter().any(|&value| value != 0.0);
            }
        }
        lit
    }
}

/// A frame that is lit by all lights, and their ids.
fn first_frame(
    scene: &Scene,
    config: &FrameConfig,
    lights: &[Light],
) -> Result<(Frame, Vec<LightId>), SkippedLight> {
    let mut frame = Frame::new(scene, config.clone());
    let ids = lights.iter().map(|&light| frame.add_light(light)).collect();
    frame.solve().require_all_lights()?;
    Ok((frame, ids))
}

/// Bytes of three numbers.
const RGB_BYTES: usize = 12;

/// Index of a sampled texel in its block.
pub fn texel_of(scene: &Scene, sampled: &SampledTexel) -> usize {
    let SampledTexel {
        block,
        face,
        row,
        column,
        ..
    } = *sampled;
    scene
        .level
        .level_texel(BlockIndex::new(block), face, row, column)
        .expect("sampled texels are texels of the level's walls at the scene's resolution")
}

impl Timed for TimedFrame {
    fn run(&mut self) -> Vec<f64> {
        match self.motion {
            Motion::Everything => self.frame.forget(),
            Motion::OneLight => self.move_lights(1),
            Motion::AllLights => self.move_lights(self.lights.len()),
        }
        let frame = &mut self.frame;
        let mut solve = || frame.solve();
        let report = match &self.pool {
            None => solve(),
            Some(Pool(threads)) => threads.install(solve),
        };
        report
            .require_all_lights()
            .expect("the first frame was lit by all");
        let times = report.times();
        [
            times.direct,
            times.coefficients,
            times.responses,
            times.indirect,
            times.lightmap,
        ]
        .map(|time| time.as_secs_f64())
        .to_vec()
    }
}
