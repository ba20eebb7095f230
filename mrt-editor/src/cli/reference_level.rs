//! Error of a frame against the exact solution of the same level.

use glam::Vec3;
use mrt_core::geometry::cube::Face;
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::radiosity::direct::{PointLight, direct, direct_quarters};
use mrt_core::reference::radiosity::solve::solve;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_core::reference::radiosity::{ExactError, ExactScene, Side};
use mrt_runtime::{BlockIndex, Bounces, Frame, Level, Light, Scene, SkippedLight};
use serde::Serialize;
use std::time::Instant;

/// Sub-samples of direct light along each axis of a quarter of a texel: more change the solution by
/// less than 0.01 %.
const DIRECT_SAMPLES: usize = 4;

/// Relative L2 errors over a whole level, as fractions.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LevelErrors {
    /// Of indirect irradiance after one bounce.
    pub first_bounce: f64,
    /// Of indirect irradiance after many bounces.
    pub many_bounces: f64,
    /// Of direct and indirect irradiance after many bounces.
    pub total: f64,
    /// Seconds that the exact solution took.
    pub exact_seconds: f64,
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceLevelError {
    /// The exact solver refuses the level.
    #[error("exact solution: {0}")]
    Exact(#[from] ExactError),
    /// A light does not shine.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// Its walls are flat.
    #[error(
        "exact solution: block {block} is a `{shape}`; expected only cubes, since the exact solver has flat walls"
    )]
    Tube {
        /// Which block.
        block: usize,
        /// Its shape.
        shape: &'static str,
    },
    /// Only sphere lights have an exact counterpart.
    #[error("exact solution: light {light} is not a sphere light; expected only sphere lights")]
    Light {
        /// Which light.
        light: usize,
    },
}

/// Solves the level with both and compares all texels and channels.
///
/// # Errors
/// [`ReferenceLevelError`].
pub fn measure(
    level: &Level,
    scene: &Scene,
    frame: &mut Frame,
    lights: &[Light],
    bounces: u32,
) -> Result<LevelErrors, ReferenceLevelError> {
    let tube = level.blocks.iter().position(|b| b.shape.tube().is_some());
    if let Some(block) = tube {
        let shape = level.blocks[block].shape.name;
        return Err(ReferenceLevelError::Tube { block, shape });
    }
    let start = Instant::now();
    let exact = exact_scene(level, scene.level.resolution)?;
    let transport = Transport::build(&exact);
    let first = exact_irradiance(level, &exact, &transport, lights, 1)?;
    let many = exact_irradiance(level, &exact, &transport, lights, bounces as usize)?;
    let direct = exact_direct(&exact, lights)?;
    let exact_seconds = start.elapsed().as_secs_f64();
    frame.set_lights(lights);
    let mut signal = Vec::new();
    let mut indirect = |frame: &mut Frame, bounces: u32| {
        frame.set_bounces(Bounces::Count(bounces));
        frame.solve().require_all_lights()?;
        frame.copy_indirect_to(&mut signal);
        Ok::<_, SkippedLight>(in_level_order(level, scene, &signal))
    };
    let our_first = indirect(frame, 1)?;
    let our_many = indirect(frame, bounces)?;
    frame.copy_direct_to(&mut signal);
    let our_direct = in_level_order(level, scene, &signal);
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<_>>();
    Ok(LevelErrors {
        first_bounce: rel_l2(&our_first, &first),
        many_bounces: rel_l2(&our_many, &many),
        total: rel_l2(&sum(&our_direct, &our_many), &sum(&direct, &many)),
        exact_seconds,
    })
}

/// The level for the exact solver.
///
/// # Errors
/// [`ExactError`].
pub fn exact_scene(level: &Level, resolution: usize) -> Result<ExactScene, ExactError> {
    let neighbours = level.neighbours();
    let sides = level
        .blocks
        .iter()
        .zip(&neighbours)
        .map(|(block, beyond)| {
            Face::ALL.map(|face| match beyond[face.index()] {
                Some(there) => Side::Opening(there.block, there.face),
                None if block.is_open(face) => Side::Sky,
                None => Side::Wall,
            })
        })
        .collect();
    let blocks = level.blocks.iter().map(|block| block.warp).collect();
    ExactScene::new(blocks, sides, resolution)
}

/// Position and intensity of a sphere light.
fn sphere(light: usize, lights: &[Light]) -> Result<(PointLight, Vec3), ReferenceLevelError> {
    match lights[light] {
        Light::Sphere {
            position,
            radius,
            intensity,
        } => {
            let light = PointLight {
                position: position.as_dvec3(),
                intensity: 1.0,
                radius: f64::from(radius),
            };
            Ok((light, intensity))
        }
        _ => Err(ReferenceLevelError::Light { light }),
    }
}

/// Indirect irradiance, texel by texel and channel by channel.
fn exact_irradiance(
    level: &Level,
    exact: &ExactScene,
    transport: &Transport,
    lights: &[Light],
    bounces: usize,
) -> Result<Vec<f64>, ReferenceLevelError> {
    let albedo: Vec<Vec3> = exact
        .walls()
        .iter()
        .map(|wall| level.blocks[wall.block].albedo[wall.face.index()])
        .collect();
    let albedo = exact.spread_over_texels(&albedo)?;
    let mut sum = vec![0.0; 3 * exact.texel_count()];
    for index in 0..lights.len() {
        let (light, intensity) = sphere(index, lights)?;
        let direct = direct_quarters(exact, &light, DIRECT_SAMPLES);
        for channel in 0..3 {
            let albedo: Vec<f64> = albedo.iter().map(|a| f64::from(a[channel])).collect();
            let bounces = mrt_core::reference::bounces::ReferenceBounces::Count(bounces);
            let solved = solve(exact, transport, &direct, bounces, &albedo)?;
            for (texel, e) in solved.into_iter().enumerate() {
                sum[3 * texel + channel] += e * f64::from(intensity[channel]);
            }
        }
    }
    Ok(sum)
}

fn exact_direct(exact: &ExactScene, lights: &[Light]) -> Result<Vec<f64>, ReferenceLevelError> {
    let mut sum = vec![0.0; 3 * exact.texel_count()];
    for index in 0..lights.len() {
        let (light, intensity) = sphere(index, lights)?;
        for (texel, e) in direct(exact, &light).into_iter().enumerate() {
            for channel in 0..3 {
                sum[3 * texel + channel] += e * f64::from(intensity[channel]);
            }
        }
    }
    Ok(sum)
}

/// A frame's signal in the exact solver's order: block by block, wall by wall as the level names them,
/// row by row, channels together.
fn in_level_order(level: &Level, scene: &Scene, signal: &[f32]) -> Vec<f64> {
    let mut out = Vec::with_capacity(signal.len());
    for (index, block) in level.blocks.iter().enumerate() {
        let range = &scene.level.blocks[index].texels;
        for face in Face::ALL.into_iter().filter(|&face| !block.is_open(face)) {
            for row in 0..scene.level.resolution {
                for column in 0..scene.level.resolution {
                    let texel = scene
                        .level
                        .level_texel(BlockIndex::new(index), face, row, column)
                        .unwrap_or(0);
                    for channel in 0..3 {
                        let at = 3 * range.start + channel * range.len() + texel;
                        out.push(f64::from(signal[at]));
                    }
                }
            }
        }
    }
    out
}
