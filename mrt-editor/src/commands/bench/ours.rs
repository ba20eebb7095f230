//! The frame, as it is measured: everything in the benchmark that knows how `mrt-runtime` is called.

use super::reference::Receiver;
use super::setting::Setting;
use super::timing::Timed;
use mrt_core::simd::SimdLevel;
use mrt_core::storage::Storage;
use mrt_runtime::assemble::{AssembleConfig, AssembleError, Coupling, assemble};
use mrt_runtime::dictionary::Dictionary;
use mrt_runtime::frame::{Bounces, Frame, FrameError};
use mrt_runtime::light::Light;
use mrt_runtime::scene::Scene;
use mrt_runtime::visibility::Openings;

/// One way to compute a frame.
#[derive(Clone, Copy, Debug)]
pub struct Variant<'a> {
    /// What it is called: a preset, or another dictionary.
    pub preset: &'a str,
    /// The operators.
    pub dictionary: &'a Dictionary,
    /// How they are stored.
    pub storage: Storage,
    /// How light goes from block to block.
    pub coupling: Coupling,
    /// Instructions.
    pub simd: SimdLevel,
    /// Threads.
    pub threads: usize,
}

/// Bytes that scenes of the benchmark may take: 10,000 blocks with the standard preset take 2.7 GB, and what they are
/// compared with as much again.
const MAX_BYTES: usize = 4 << 30;

/// Settings for assembling with a coupling.
pub fn assemble_config(coupling: Coupling) -> AssembleConfig {
    AssembleConfig {
        coupling,
        max_bytes: MAX_BYTES,
        ..AssembleConfig::default()
    }
}

impl Variant<'_> {
    /// Such as "standard/avx2/t1", with the storage unless it is `f32` and the coupling unless it is the table.
    pub fn name(&self) -> String {
        let mut name = format!("{}/{}/t{}", self.preset, self.simd.name(), self.threads);
        if self.storage != Storage::F32 {
            name = format!("{name}/{}", self.storage.name());
        }
        if self.coupling != Coupling::Table {
            name = format!("{name}/lightfield");
        }
        name
    }
}

/// Why a variant cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum OursError {
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// The lights are refused.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl OursError {
    /// True where the level needs more memory than a benchmark may take.
    pub fn is_size(&self) -> bool {
        matches!(self, OursError::Assemble(AssembleError::TooLarge { .. }))
    }
}

/// Names of the stages that are timed, in the order of [`Timed::run`].
pub const STAGES: [&str; 5] = ["direct", "T_d->b", "T_b->r", "U", "atlas"];

/// From direct light to indirect light.
pub const INDIRECT_STAGES: [usize; 3] = [1, 2, 3];

/// From lights to indirect light.
pub const LIGHT_STAGES: [usize; 4] = [0, 1, 2, 3];

/// What a stage has to do at least.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Operations of the dense products, a product and a sum being two; 0 for stages that are no product.
    pub flops: f64,
    /// Bytes that it reads and writes, each once.
    pub bytes: f64,
}

/// A scene and its frame.
pub struct Ours {
    /// The scene.
    pub scene: Scene,
    frame: Frame,
    lights: Vec<Light>,
}

impl Ours {
    /// Assembles a level, and solves a first frame.
    ///
    /// # Errors
    /// [`OursError`].
    pub fn new(setting: &Setting, variant: &Variant) -> Result<Self, OursError> {
        let config = assemble_config(variant.coupling);
        let scene = match variant.storage {
            Storage::F32 => assemble(&setting.level, variant.dictionary, &config)?,
            storage => {
                let stored = variant.dictionary.stored_as(storage);
                assemble(&setting.level, &stored, &config)?
            }
        };
        let mut frame = Frame::new(&scene);
        frame.solve(&scene, &setting.lights, &Openings, Bounces::Count(1))?;
        Ok(Self {
            scene,
            frame,
            lights: setting.lights.clone(),
        })
    }

    /// Direct irradiance, as the frame orders it.
    pub fn direct(&self) -> &[f32] {
        self.frame.direct()
    }

    /// Indirect irradiance of the last frame.
    pub fn irradiance(&self, receivers: &[Receiver]) -> Vec<[f64; 3]> {
        let at = |receiver: &Receiver| {
            let texel = texel_of(&self.scene, receiver);
            let indirect = self.frame.indirect_at(&self.scene, receiver.block, texel);
            indirect.map(f64::from)
        };
        receivers.iter().map(at).collect()
    }

    /// Bytes that the scene and the frame hold while frames are computed.
    pub fn resident_bytes(&self) -> usize {
        let scene = &self.scene;
        // Positions, normals, albedo and emission; direct, indirect and previous light, and radiosity.
        let texels = scene.texel_count() * (4 * 12 + 4 * 12);
        let signals = 12 * (scene.coefficient_count + scene.joint_count);
        let lightmap = size_of_val(self.frame.lightmap());
        scene.operator_bytes() + texels + signals + lightmap
    }

    /// What each of [`STAGES`] has to do.
    pub fn costs(&self) -> [Cost; STAGES.len()] {
        let scene = &self.scene;
        let rgb = 12.0 * scene.texel_count() as f64;
        let (b, joint) = (
            12.0 * scene.coefficient_count as f64,
            12.0 * scene.joint_count as f64,
        );
        let of_shapes = |numbers: &dyn Fn(usize) -> usize| -> f64 {
            (0..scene.shapes.len())
                .map(|k| 4.0 * numbers(k) as f64)
                .sum()
        };
        let of_blocks = |modes: &dyn Fn(usize) -> usize| -> f64 {
            let blocks = (0..scene.blocks.len()).map(|k| scene.blocks[k].texels.len() * modes(k));
            blocks.map(|products| 6.0 * products as f64).sum()
        };
        let transport = scene.transport.bytes() as f64;
        [
            Cost {
                flops: 0.0,
                bytes: 3.0 * rgb,
            },
            Cost {
                flops: of_blocks(&|k| scene.blocks[k].coefficients.len()),
                bytes: of_shapes(&|k| scene.shapes[k].coefficients_from_direct.data().len())
                    + 2.0 * rgb
                    + b,
            },
            Cost {
                flops: 6.0 * transport / 4.0,
                bytes: transport + b + joint,
            },
            Cost {
                flops: of_blocks(&|k| scene.blocks[k].joint.len()),
                bytes: of_shapes(&|k| scene.shapes[k].joint_basis.data().len()) + joint + rgb,
            },
            Cost {
                flops: 0.0,
                bytes: rgb + size_of_val(self.frame.lightmap()) as f64,
            },
        ]
    }
}

/// Index of a receiver's texel in its block.
pub fn texel_of(scene: &Scene, receiver: &Receiver) -> usize {
    let Receiver {
        block,
        face,
        row,
        column,
        ..
    } = *receiver;
    scene
        .level_texel(block, face, row, column)
        .expect("receivers are texels of the level's walls at the scene's resolution")
}

impl Timed for Ours {
    fn run(&mut self) -> Vec<f64> {
        self.frame
            .solve(&self.scene, &self.lights, &Openings, Bounces::Count(1))
            .expect("the first frame was accepted");
        let times = self.frame.times();
        [
            times.direct,
            times.coefficients,
            times.responses,
            times.indirect,
            times.atlas,
        ]
        .map(|time| time.as_secs_f64())
        .to_vec()
    }
}
