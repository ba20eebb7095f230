//! The light of a frame after each stage.

use crate::executor::MAX_TASKS;
use crate::modular::kernels::scratch::Scratch;
use crate::modular::scene::SceneData;
use crate::output::texel_layout::Planes;
use mrt_core::simd::Aligned;

/// Buffers of the stages of a frame, allocated once for a scene.
#[derive(Debug)]
pub(super) struct LightBuffers {
    /// Direct irradiance, W/m², by slot.
    pub direct: Planes,
    /// Indirect irradiance, W/m², by slot.
    pub indirect: Planes,
    /// Coefficients b of all blocks, in the order of [`CoefficientLayout`](crate::modular::scene::CoefficientLayout).
    pub coefficients: Aligned<f32>,
    /// Joint coefficients of all blocks, in the same order.
    pub joint: Aligned<f32>,
    /// Fraction of light that each door lets through.
    pub doors: Vec<f32>,
    /// For each gate of the scene's transport, the product of the values of its doors.
    pub gate_values: Vec<f32>,
    /// Memory of the kernels of each task.
    pub scratch: Vec<Scratch>,
}

impl LightBuffers {
    /// Dark buffers, with memory for `tasks` tasks that run in parallel.
    pub(super) fn new(scene: &SceneData, tasks: usize) -> Self {
        let slots = scene.layout.slot_count();
        let coefficients = scene.rows.per_block();
        let all = coefficients * scene.layout.block_count();
        let scratch = Scratch::new(scene.layout.most_slots(), coefficients);
        Self {
            direct: Planes::new(slots),
            indirect: Planes::new(slots),
            coefficients: Aligned::zeroed(all),
            joint: Aligned::zeroed(all),
            doors: scene.level.doors.clone(),
            gate_values: vec![0.0; scene.transport.gates.len()],
            scratch: vec![scratch; tasks],
        }
    }

    /// Most tasks that an executor with `workers` workers runs in parallel.
    pub(super) fn task_count(workers: usize) -> usize {
        match workers {
            0 | 1 => 1,
            _ => MAX_TASKS,
        }
    }
}
