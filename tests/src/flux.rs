//! Sums of light over texels.

use crate::irradiance::by_texel;
use glam::Vec3;
use mrt_runtime::{BlockIndex, Frame, Scene};

/// Weighted sums of a frame's signals over all texels, channel by channel: flux in W, if the weights are areas in m².
pub struct Flux {
    scene: Scene,
    weights: Vec<f64>,
    /// Albedo of every texel.
    albedo: Vec<[f32; 3]>,
    /// Emitted radiosity of every texel, W/m².
    emission: Vec<[f32; 3]>,
}

impl Flux {
    /// With the albedo and emission that the frame has now.
    pub fn new(frame: &Frame, weights: Vec<f64>) -> Self {
        let (mut albedo, mut emission) = (Vec::new(), Vec::new());
        for (index, block) in frame.scene().level.blocks.iter().enumerate() {
            for texel in 0..block.texels.len() {
                let of = |colour: Option<Vec3>| colour.expect("a texel").to_array();
                let index = BlockIndex::new(index);
                albedo.push(of(frame.texel_albedo(index, texel)));
                emission.push(of(frame.texel_emission(index, texel)));
            }
        }
        Self {
            scene: frame.scene().clone(),
            weights,
            albedo,
            emission,
        }
    }

    /// With weights 1: fluxes of unit cubes, up to a factor.
    pub fn unweighted(frame: &Frame) -> Self {
        Self::new(frame, vec![1.0; frame.scene().texel_count()])
    }

    /// The light that arrives at the walls.
    pub fn arrived(&self, signal: &[f32]) -> [f64; 3] {
        self.sum(&by_texel(&self.scene, signal), |_| [1.0; 3])
    }

    /// The light that the walls reflect.
    pub fn reflected(&self, signal: &[f32]) -> [f64; 3] {
        let albedo = |texel: usize| self.albedo[texel].map(f64::from);
        self.sum(&by_texel(&self.scene, signal), albedo)
    }

    /// The light that the walls emit.
    pub fn emitted(&self) -> [f64; 3] {
        self.sum(&self.emission, |_| [1.0; 3])
    }

    fn sum(&self, values: &[[f32; 3]], share: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (texel, value) in values.iter().enumerate() {
            let share = share(texel);
            for (c, sum) in sums.iter_mut().enumerate() {
                *sum += self.weights[texel] * share[c] * f64::from(value[c]);
            }
        }
        sums
    }
}
