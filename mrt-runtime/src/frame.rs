//! A frame: lights in, indirect irradiance out (Loos et al. 2011, section 7.3).

use crate::direct::direct_light;
use crate::light::{Light, LightError, MAX_LIGHT_VALUE, PlacedLight, place};
use crate::probes::{ProbeOrder, Probes};
use crate::scene::Scene;
use crate::visibility::Visibility;
use glam::Vec3;
use mrt_core::matrix::{MatrixView, multiply_add};
use mrt_core::ohlsh::evaluate_f32;
use std::time::{Duration, Instant};

/// Lights in one frame, at most.
pub const MAX_LIGHTS: usize = 1024;

/// Passes in one frame, at most: at albedo 0.99 the light left after them is 1e-18 of the first.
pub const MAX_PASSES: u32 = 4096;

/// Which bounces a frame computes; more than [`MAX_PASSES`] passes are not made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounces {
    /// This many, each a pass over the reduced operators; 0 leaves indirect light at zero.
    Count(u32),
    /// One pass that reflects the previous frame's indirect light with this frame's direct light: many
    /// bounces over a few frames at the cost of one.
    Feedback,
    /// Passes until no texel changes by more than `tolerance` of the brightest, at most `limit`.
    Converged {
        /// Relative change at which to stop.
        tolerance: f32,
        /// Most passes.
        limit: u32,
    },
}

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

/// What a frame computes besides irradiance and lightmap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// Probes, with so many coefficients.
    pub probes: Option<ProbeOrder>,
    /// Vector irradiance at texels.
    pub vector: bool,
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

/// The buffers of a frame, made once for a scene; frames allocate nothing.
///
/// Signals on texels are stored block by block, in a block channel by channel (red, green, blue), and in a
/// channel texel by texel in the canonical shape's order.
#[derive(Debug)]
pub struct Frame {
    lights: Vec<PlacedLight>,
    direct: Vec<f32>,
    radiosity: Vec<f32>,
    coefficients: Vec<f32>,
    joint: Vec<f32>,
    doors: Vec<f32>,
    indirect: Vec<f32>,
    previous: Vec<f32>,
    lightmap: Vec<[f32; 3]>,
    probes: Option<Probes>,
    vector: Vec<f32>,
    times: StageTimes,
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
        Self::with_outputs(scene, Outputs::default())
    }

    /// Buffers for frames of a scene, all dark, with everything asked for that the dictionary was baked with.
    pub fn with_outputs(scene: &Scene, outputs: Outputs) -> Self {
        let texels = 3 * scene.texel_count();
        Self {
            lights: Vec::with_capacity(MAX_LIGHTS),
            direct: vec![0.0; texels],
            radiosity: vec![0.0; texels],
            coefficients: vec![0.0; 3 * scene.coefficient_count],
            joint: vec![0.0; 3 * scene.joint_count],
            doors: scene.doors.clone(),
            indirect: vec![0.0; texels],
            previous: vec![0.0; texels],
            lightmap: vec![[0.0; 3]; scene.atlas.width * scene.atlas.height],
            probes: outputs.probes.and_then(|order| Probes::new(scene, order)),
            vector: if outputs.vector && scene.has_vector() {
                vec![0.0; 4 * texels]
            } else {
                Vec::new()
            },
            times: StageTimes::default(),
            passes: 0,
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
        direct_light(
            scene,
            &self.lights,
            &self.doors,
            visibility,
            &mut self.direct,
        );
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
        if direct.len() != self.direct.len() || faulty.is_some() {
            return Err(FrameError::Direct {
                expected: self.direct.len(),
                found: direct.len(),
                faulty,
            });
        }
        self.direct.copy_from_slice(direct);
        self.times = StageTimes::default();
        self.bounce(scene, bounces);
        self.fill_outputs(scene);
        Ok(())
    }

    fn fill_outputs(&mut self, scene: &Scene) {
        let start = Instant::now();
        scene
            .atlas
            .fill(&scene.blocks, &self.indirect, &mut self.lightmap);
        let after_atlas = Instant::now();
        if let Some(probes) = &mut self.probes {
            probes.fill(scene, &self.joint);
        }
        let after_probes = Instant::now();
        if !self.vector.is_empty() {
            vector_from_joint(scene, &self.joint, &mut self.vector);
        }
        self.times.atlas = after_atlas - start;
        self.times.probes = after_probes - after_atlas;
        self.times.vector = after_probes.elapsed();
    }

    fn check_scene(&self, scene: &Scene) -> Result<(), FrameError> {
        // Doors and shapes may differ where the number of texels does not.
        let pixels = scene.atlas.width * scene.atlas.height;
        for (what, expected, found) in [
            ("texels", self.direct.len() / 3, scene.texel_count()),
            (
                "coefficients",
                self.coefficients.len() / 3,
                scene.coefficient_count,
            ),
            (
                "joint coefficients",
                self.joint.len() / 3,
                scene.joint_count,
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
            ("lightmap pixels", self.lightmap.len(), pixels),
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
        // Read by this frame only, so a refused light may leave them incomplete.
        self.lights.clear();
        for (index, &light) in lights.iter().enumerate() {
            self.lights.push(place(scene, index, light)?);
        }
        Ok(())
    }

    fn bounce(&mut self, scene: &Scene, bounces: Bounces) {
        let (limit, tolerance) = match bounces {
            Bounces::Count(count) => (count.min(MAX_PASSES), None),
            Bounces::Feedback => (1, None),
            Bounces::Converged { tolerance, limit } => (limit.min(MAX_PASSES), Some(tolerance)),
        };
        if bounces != Bounces::Feedback {
            self.indirect.fill(0.0);
            self.coefficients.fill(0.0);
            self.joint.fill(0.0);
        }
        self.passes = 0;
        while self.passes < limit {
            if tolerance.is_some() {
                self.previous.copy_from_slice(&self.indirect);
            }
            self.pass(scene);
            self.passes += 1;
            if tolerance.is_some_and(|t| largest_change(&self.previous, &self.indirect) <= t) {
                break;
            }
        }
    }

    /// One bounce of everything that the walls reflect now.
    fn pass(&mut self, scene: &Scene) {
        let start = Instant::now();
        reflect(scene, &self.direct, &self.indirect, &mut self.radiosity);
        coefficients_from_radiosity(scene, &self.radiosity, &mut self.coefficients);
        let after_coefficients = Instant::now();
        scene
            .transport
            .multiply(&self.coefficients, &self.doors, &mut self.joint);
        add_own(scene, &self.coefficients, &mut self.joint);
        let after_responses = Instant::now();
        indirect_from_joint(scene, &self.joint, &mut self.indirect);
        // Truncated bases leave small negative values; they end here, once, on the final sum.
        self.indirect.iter_mut().for_each(|e| *e = e.max(0.0));
        limit_flux(
            scene,
            &self.direct,
            &self.radiosity,
            &mut self.indirect,
            &mut self.joint,
        );
        let end = Instant::now();
        self.times.coefficients += after_coefficients - start;
        self.times.responses += after_responses - after_coefficients;
        self.times.indirect += end - after_responses;
    }

    /// Opens or closes a door for direct and indirect light ([`Rays`](crate::visibility::Rays) ask the caller's function
    /// alone, which must know it): 1 lets everything through, 0 nothing; what does not pass is lost. The next
    /// frame sees it.
    ///
    /// # Errors
    /// [`FrameError::Door`], if there is no such door or the value is not in [0, 1].
    pub fn set_door(&mut self, door: usize, value: f32) -> Result<(), FrameError> {
        let count = self.doors.len();
        match self.doors.get_mut(door) {
            Some(place) if (0.0..=1.0).contains(&value) => {
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
    pub fn direct(&self) -> &[f32] {
        &self.direct
    }

    /// Indirect irradiance, W/m², not multiplied by the receiving texel's albedo.
    pub fn indirect(&self) -> &[f32] {
        &self.indirect
    }

    /// Indirect irradiance, RGB, of one texel of a block; the scene must be the one that was solved.
    ///
    /// # Panics
    /// If the scene has no such block or the block no such texel.
    pub fn indirect_at(&self, scene: &Scene, block: usize, texel: usize) -> [f32; 3] {
        let range = &scene.blocks[block].texels;
        assert!(texel < range.len(), "texel {texel} of {}", range.len());
        let start = 3 * range.start + texel;
        std::array::from_fn(|channel| self.indirect[start + channel * range.len()])
    }

    /// Coefficients b: block by block, channel by channel.
    pub fn coefficients(&self) -> &[f32] {
        &self.coefficients
    }

    /// Padded lightmap of indirect irradiance, row by row; see [`Scene::atlas`].
    pub fn lightmap(&self) -> &[[f32; 3]] {
        &self.lightmap
    }

    /// Probes, if asked for and there are any.
    pub fn probes(&self) -> Option<&Probes> {
        self.probes.as_ref()
    }

    /// Vector irradiance, if asked for and there is any: block by block, in a block channel by channel, in a
    /// channel texel by texel four coefficients of 1, v, normal and u in the texel's tangent frame.
    /// [`mrt_core::ohlsh::evaluate_f32`] gives irradiance for a normal.
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

    /// Passes of the last frame.
    pub fn passes(&self) -> u32 {
        self.passes
    }
}

/// radiosity = albedo (direct + indirect) + emission
fn reflect(scene: &Scene, direct: &[f32], indirect: &[f32], radiosity: &mut [f32]) {
    for block in &scene.blocks {
        let count = block.texels.len();
        for channel in 0..3 {
            let start = 3 * block.texels.start + channel * count;
            for (k, texel) in block.texels.clone().enumerate() {
                let incident = direct[start + k] + indirect[start + k];
                radiosity[start + k] = scene.texel_albedo[texel][channel] * incident
                    + scene.texel_emission[texel][channel];
            }
        }
    }
}

/// `b = T_d->b l`
fn coefficients_from_radiosity(scene: &Scene, radiosity: &[f32], coefficients: &mut [f32]) {
    coefficients.fill(0.0);
    for block in &scene.blocks {
        let operator = &scene.shapes[block.shape_index].coefficients_from_direct;
        let light = &radiosity[3 * block.texels.start..3 * block.texels.end];
        let out = &mut coefficients[3 * block.coefficients.start..3 * block.coefficients.end];
        let light = MatrixView::new(block.texels.len(), 3, light);
        multiply_add(operator.view(), light, out);
    }
}

/// A block's own coefficients are the first of its joint ones.
fn add_own(scene: &Scene, coefficients: &[f32], joint: &mut [f32]) {
    for block in &scene.blocks {
        let (own, all) = (block.coefficients.len(), block.joint.len());
        for channel in 0..3 {
            let from = 3 * block.coefficients.start + channel * own;
            let to = 3 * block.joint.start + channel * all;
            for (sum, &b) in joint[to..to + own]
                .iter_mut()
                .zip(&coefficients[from..from + own])
            {
                *sum += b;
            }
        }
    }
}

/// `U_b b + U_r r`, both in the joint basis.
fn indirect_from_joint(scene: &Scene, joint: &[f32], indirect: &mut [f32]) {
    indirect.fill(0.0);
    for block in &scene.blocks {
        let basis = &scene.shapes[block.shape_index].joint_basis;
        let c = &joint[3 * block.joint.start..3 * block.joint.end];
        let c = MatrixView::new(block.joint.len(), 3, c);
        let out = &mut indirect[3 * block.texels.start..3 * block.texels.end];
        multiply_add(basis.view(), c, out);
    }
}

/// Vector irradiance, in the joint basis.
fn vector_from_joint(scene: &Scene, joint: &[f32], vector: &mut [f32]) {
    vector.fill(0.0);
    for block in &scene.blocks {
        let basis = &scene.shapes[block.shape_index].vector_basis;
        let c = &joint[3 * block.joint.start..3 * block.joint.end];
        let c = MatrixView::new(block.joint.len(), 3, c);
        let out = &mut vector[12 * block.texels.start..12 * block.texels.end];
        multiply_add(basis.view(), c, out);
    }
}

/// Share by which more may arrive of direct light that left the walls, and of what they emit: irradiance is that at
/// texel centres, whose mean differs from a wall's where light comes from nearby. At 3² texels that is 0.1 % for even
/// light, and without it exact operators would be scaled, and lights not add up.
const SPOT_GAIN: f64 = 0.05;

/// Scales a channel down where more flux would arrive on all walls than left them.
///
/// Exact transport never does that. Where truncated operators did, bounces would grow without end; so the flux of
/// indirect light falls by the largest albedo at each bounce, whatever the level. Direct light and what walls emit
/// have some [`SPOT_GAIN`]. Areas are those of the canonical blocks.
fn limit_flux(
    scene: &Scene,
    direct: &[f32],
    radiosity: &[f32],
    indirect: &mut [f32],
    joint: &mut [f32],
) {
    for channel in 0..3 {
        let (mut sent, mut arrived) = (0.0f64, 0.0f64);
        for block in &scene.blocks {
            let start = 3 * block.texels.start + channel * block.texels.len();
            let range = start..start + block.texels.len();
            let areas = &scene.shapes[block.shape_index].texel_areas;
            let texels = block.texels.clone().zip(&direct[range.clone()]);
            let fresh: f64 = texels
                .enumerate()
                .map(|(k, (texel, &e))| {
                    // Cubes list no areas: theirs are equal.
                    let area = areas.get(k).copied().unwrap_or(1.0);
                    let reflected = scene.texel_albedo[texel][channel] * e;
                    f64::from((reflected + scene.texel_emission[texel][channel]) * area)
                })
                .sum();
            sent += flux(&radiosity[range.clone()], areas) + SPOT_GAIN * fresh;
            arrived += flux(&indirect[range], areas);
        }
        if arrived > sent {
            let scale = (sent / arrived) as f32;
            for block in &scene.blocks {
                let start = 3 * block.texels.start + channel * block.texels.len();
                for e in &mut indirect[start..start + block.texels.len()] {
                    *e *= scale;
                }
                let start = 3 * block.joint.start + channel * block.joint.len();
                for c in &mut joint[start..start + block.joint.len()] {
                    *c *= scale;
                }
            }
        }
    }
}

/// Sum by area; no areas stand for areas of 1.
fn flux(values: &[f32], areas: &[f32]) -> f64 {
    if areas.is_empty() {
        return values.iter().map(|&x| f64::from(x)).sum();
    }
    let weighted = values.iter().zip(areas);
    weighted.map(|(&x, &a)| f64::from(x) * f64::from(a)).sum()
}

/// Largest difference over the largest value.
fn largest_change(before: &[f32], after: &[f32]) -> f32 {
    let largest = after.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    let change = before
        .iter()
        .zip(after)
        .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    if largest > 0.0 { change / largest } else { 0.0 }
}
