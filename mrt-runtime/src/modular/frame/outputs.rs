//! Fills lightmap, probes and vector irradiance of blocks whose indirect light changed.

use crate::modular::frame::config::FrameConfig;
use crate::modular::frame::light_buffers::LightBuffers;
use crate::modular::frame::report::ReportData;
use crate::modular::frame::schedule::Schedule;
use crate::modular::frame::stage_clock::{Stage, StageClock};
use crate::modular::kernels::expand::Expand;
use crate::modular::scene::SceneData;
use crate::output::probes::Probes;
use crate::output::texel_layout::BlockRank;
use mrt_core::simd::SimdLevel;

/// The outputs of a frame besides irradiance at texels.
#[derive(Debug)]
pub(super) struct OutputBuffers {
    /// Pixels of the atlas; empty if not asked for.
    pub lightmap: Vec<[f32; 3]>,
    pub probes: Option<Probes>,
    /// Four coefficients for each texel and channel; empty if not asked for.
    pub vector: Vec<f32>,
}

/// The last part of a frame: from light at texels and joint coefficients to outputs.
pub(super) struct OutputStage<'a> {
    pub scene: &'a SceneData,
    pub config: &'a FrameConfig,
    pub schedule: &'a mut Schedule,
    pub light: &'a mut LightBuffers,
    pub report: &'a mut ReportData,
    pub clock: &'a mut StageClock,
}

impl OutputBuffers {
    /// Dark outputs: those that the settings ask for and the dictionary was baked with.
    pub(super) fn new(scene: &SceneData, config: &FrameConfig) -> Self {
        let outputs = config.outputs;
        let pixels = if outputs.lightmap {
            scene.atlas.width * scene.atlas.height
        } else {
            0
        };
        let vector = if outputs.vector && scene.has_vector() {
            12 * scene.texel_count()
        } else {
            0
        };
        let order = outputs.probes.filter(|_| scene.probes > 0);
        let rotations = || scene.blocks.iter().map(|block| block.world_from_probe);
        Self {
            lightmap: vec![[0.0; 3]; pixels],
            probes: order.map(|order| Probes::new(order, scene.probes, rotations())),
            vector: vec![0.0; vector],
        }
    }

    /// Sets probes and vector irradiance to 0.
    pub(super) fn darken(&mut self) {
        self.vector.fill(0.0);
        if let Some(probes) = &mut self.probes {
            probes.darken();
        }
    }

    /// Brings the outputs of all changed blocks up to date, and lists those blocks in the report.
    pub(super) fn fill(&mut self, stage: OutputStage<'_>) {
        let OutputStage {
            scene,
            config,
            schedule,
            light,
            report,
            clock,
        } = stage;
        schedule.changed.sort_unstable();
        let changed = &schedule.changed;
        let order = &scene.layout.order;
        let blocks = changed.iter().map(|&rank| order[rank.get()]);
        report.blocks.extend(blocks);
        if !self.lightmap.is_empty() {
            let executor = &*config.executor;
            let (lightmap, texels) = (&mut self.lightmap, &light.indirect);
            scene
                .atlas
                .fill(changed, &mut report.tiles, texels, lightmap, executor);
        }
        clock.lap(Stage::Lightmap);
        if let Some(probes) = &mut self.probes {
            for &rank in changed {
                update_probes(probes, scene, rank, config.simd, light);
            }
        }
        clock.lap(Stage::Probes);
        if !self.vector.is_empty() {
            for &rank in changed {
                update_vector(&mut self.vector, scene, rank, config.simd, light);
            }
        }
        clock.lap(Stage::Vector);
        schedule.clear_changed();
    }
}

fn update_probes(
    probes: &mut Probes,
    scene: &SceneData,
    rank: BlockRank,
    simd: SimdLevel,
    light: &mut LightBuffers,
) {
    let rows = probes.order().coefficients() * probes.per_axis().pow(3);
    let expand = |out: [&mut [f32]; 3]| {
        simd.run(Expand {
            basis: &scene.shapes[scene.layout.shape(rank)].probes,
            rows,
            joint: &light.joint[scene.rows.of_block(rank)],
            scratch: &mut light.scratch[0],
            out,
        });
    };
    probes.update(scene.layout.order[rank.get()], simd, expand);
}

fn update_vector(
    vector: &mut [f32],
    scene: &SceneData,
    rank: BlockRank,
    simd: SimdLevel,
    light: &mut LightBuffers,
) {
    let block = scene.layout.order[rank.get()];
    let texels = &scene.level.blocks[block.get()].texels;
    let out = &mut vector[12 * texels.start..12 * texels.end];
    let (red, rest) = out.split_at_mut(4 * texels.len());
    let (green, blue) = rest.split_at_mut(4 * texels.len());
    let basis = &scene.shapes[scene.layout.shape(rank)].vector;
    simd.run(Expand {
        basis,
        rows: basis.rows,
        joint: &light.joint[scene.rows.of_block(rank)],
        scratch: &mut light.scratch[0],
        out: [red, green, blue],
    });
}
