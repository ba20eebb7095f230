//! Error of a frame against the exact solution of the same level.

use glam::Vec3;
use mrt_core::geometry::cube::Face;
use mrt_core::reference::bounces::ReferenceBounces as ExactBounces;
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::radiosity::direct::{PointLight, direct, direct_quarters};
use mrt_core::reference::radiosity::solve::solve;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_core::reference::radiosity::{ExactError, ExactScene, Side};
use mrt_runtime::{BlockIndex, Bounces, Frame, Level, Light, Scene, SkippedLight};
use serde::Serialize;
use std::time::Instant;

/// Sub-samples of direct light along each axis of a quarter of a texel: more change the solution by less than 0.01 %.
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
pub enum ExactLevelError {
    /// The exact solver refuses the level.
    #[error("exact solution: {0}")]
    Exact(#[from] ExactError),
    /// A light does not shine.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// A block's walls are not flat.
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

/// Solves the frame's level with the frame and exactly, and compares all texels and channels.
///
/// # Errors
/// [`ExactLevelError`].
pub fn measure(
    level: &Level,
    frame: &mut Frame,
    lights: &[Light],
    bounces: u32,
) -> Result<LevelErrors, ExactLevelError> {
    require_cubes(level)?;
    let start = Instant::now();
    let exact = ExactLight::solve(level, frame.scene().level.resolution, lights, bounces)?;
    let exact_seconds = start.elapsed().as_secs_f64();
    frame.set_lights(lights);
    let first = indirect(level, frame, 1)?;
    let many = indirect(level, frame, bounces)?;
    let mut signal = Vec::new();
    frame.copy_direct_to(&mut signal);
    let direct = in_level_order(level, frame.scene(), &signal);
    Ok(LevelErrors {
        first_bounce: rel_l2(&first, &exact.first_bounce),
        many_bounces: rel_l2(&many, &exact.many_bounces),
        total: rel_l2(
            &sum(&direct, &many),
            &sum(&exact.direct, &exact.many_bounces),
        ),
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

fn require_cubes(level: &Level) -> Result<(), ExactLevelError> {
    let tube = level.blocks.iter().position(|b| b.shape.tube().is_some());
    match tube {
        Some(block) => Err(ExactLevelError::Tube {
            block,
            shape: level.blocks[block].shape.name,
        }),
        None => Ok(()),
    }
}

/// Exact irradiance, texel by texel and channel by channel.
struct ExactLight {
    direct: Vec<f64>,
    /// Indirect irradiance after one bounce.
    first_bounce: Vec<f64>,
    /// Indirect irradiance after many bounces.
    many_bounces: Vec<f64>,
}

impl ExactLight {
    fn solve(
        level: &Level,
        resolution: usize,
        lights: &[Light],
        bounces: u32,
    ) -> Result<Self, ExactLevelError> {
        let exact = exact_scene(level, resolution)?;
        let transport = Transport::build(&exact);
        let spheres = spheres(lights)?;
        let indirect = |bounces| exact_indirect(level, &exact, &transport, &spheres, bounces);
        Ok(Self {
            first_bounce: indirect(1)?,
            many_bounces: indirect(bounces as usize)?,
            direct: exact_direct(&exact, &spheres),
        })
    }
}

/// A sphere light of unit intensity, and its intensity.
struct Sphere {
    light: PointLight,
    intensity: Vec3,
}

fn spheres(lights: &[Light]) -> Result<Vec<Sphere>, ExactLevelError> {
    let sphere = |(index, light): (usize, &Light)| match *light {
        Light::Sphere {
            position,
            radius,
            intensity,
        } => Ok(Sphere {
            light: PointLight {
                position: position.as_dvec3(),
                intensity: 1.0,
                radius: f64::from(radius),
            },
            intensity,
        }),
        _ => Err(ExactLevelError::Light { light: index }),
    };
    lights.iter().enumerate().map(sphere).collect()
}

fn exact_indirect(
    level: &Level,
    exact: &ExactScene,
    transport: &Transport,
    spheres: &[Sphere],
    bounces: usize,
) -> Result<Vec<f64>, ExactError> {
    let albedo: Vec<Vec3> = exact
        .walls()
        .iter()
        .map(|wall| level.blocks[wall.block].albedo[wall.face.index()])
        .collect();
    let albedo = exact.spread_over_texels(&albedo)?;
    let mut sum = vec![0.0; 3 * exact.texel_count()];
    for Sphere { light, intensity } in spheres {
        let direct = direct_quarters(exact, light, DIRECT_SAMPLES);
        for channel in 0..3 {
            let albedo: Vec<f64> = albedo.iter().map(|a| f64::from(a[channel])).collect();
            let bounces = ExactBounces::Count(bounces);
            let solved = solve(exact, transport, &direct, bounces, &albedo)?;
            for (texel, e) in solved.into_iter().enumerate() {
                sum[3 * texel + channel] += e * f64::from(intensity[channel]);
            }
        }
    }
    Ok(sum)
}

fn exact_direct(exact: &ExactScene, spheres: &[Sphere]) -> Vec<f64> {
    let mut sum = vec![0.0; 3 * exact.texel_count()];
    for Sphere { light, intensity } in spheres {
        for (texel, e) in direct(exact, light).into_iter().enumerate() {
            for channel in 0..3 {
                sum[3 * texel + channel] += e * f64::from(intensity[channel]);
            }
        }
    }
    sum
}

/// The frame's indirect irradiance after some bounces, in the exact solver's order.
fn indirect(level: &Level, frame: &mut Frame, bounces: u32) -> Result<Vec<f64>, SkippedLight> {
    frame.set_bounces(Bounces::Count(bounces));
    frame.solve().require_all_lights()?;
    let mut signal = Vec::new();
    frame.copy_indirect_to(&mut signal);
    Ok(in_level_order(level, frame.scene(), &signal))
}

/// A frame's signal in the exact solver's order: block by block, wall by wall as the level names them, row by row,
/// channels together.
fn in_level_order(level: &Level, scene: &Scene, signal: &[f32]) -> Vec<f64> {
    let placed = &scene.level;
    let mut out = Vec::with_capacity(signal.len());
    for (index, block) in level.blocks.iter().enumerate() {
        let range = &placed.blocks[index].texels;
        for face in Face::ALL.into_iter().filter(|&face| !block.is_open(face)) {
            for row in 0..placed.resolution {
                for column in 0..placed.resolution {
                    let texel = placed.level_texel(BlockIndex::new(index), face, row, column);
                    for channel in 0..3 {
                        let at = 3 * range.start + channel * range.len() + texel.unwrap_or(0);
                        out.push(f64::from(signal[at]));
                    }
                }
            }
        }
    }
    out
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
