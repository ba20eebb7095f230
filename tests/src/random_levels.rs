//! Random levels and lights, from seeds.

use crate::levels::floor_plan;
use crate::random::Random;
use glam::{DVec3, Vec3};
use mrt_runtime::blocks::Door;
use mrt_runtime::low_level::light::placed::place;
use mrt_runtime::{Level, Light, Scene};

/// Connected cells, grown from (0, 0) by random steps.
pub fn random_cells(random: &mut Random, count: usize) -> Vec<[i32; 2]> {
    let mut cells = vec![[0, 0]];
    while cells.len() < count {
        let [x, z] = cells[random.below(cells.len())];
        let next = [[x + 1, z], [x - 1, z], [x, z + 1], [x, z - 1]][random.below(4)];
        if !cells.contains(&next) {
            cells.push(next);
        }
    }
    cells
}

/// A colour between 0 and 0.99, mostly bright.
pub fn random_albedo(random: &mut Random) -> Vec3 {
    let mut value = || 0.99 * (1.0 - random.unit().powi(3)) as f32;
    Vec3::new(value(), value(), value())
}

/// A level of connected cells with random colours, missing connections, doors and panels. Every other level is bent.
pub fn random_level(random: &mut Random, blocks: usize) -> Level {
    let mut level = floor_plan(&random_cells(random, blocks), 0.0);
    furnish(random, &mut level);
    level
}

/// Gives a level of cells random colours, missing connections, doors and panels, and bends every other level.
pub fn furnish(random: &mut Random, level: &mut Level) {
    for block in &mut level.blocks {
        block.albedo = std::array::from_fn(|_| random_albedo(random));
    }
    let unconnected = [0.0, 0.2][random.below(2)];
    level.connections.retain(|_| random.unit() >= unconnected);
    add_doors(random, level, 0.2);
    add_panel(random, level, 0.3);
    if random.unit() < 0.5 {
        for block in &mut level.blocks {
            for corner in &mut block.warp.corners {
                *corner = bent(*corner);
            }
        }
    }
    assert_eq!(level.check(), Ok(()));
}

/// Puts closed, open and partly open doors into a share of the connections.
pub fn add_doors(random: &mut Random, level: &mut Level, share: f64) {
    for connection in 0..level.connections.len() {
        if random.unit() < share {
            let value = [0.0, 1.0, random.unit() as f32][random.below(3)];
            level.doors.push(Door { connection, value });
        }
    }
}

/// With this probability, lets one face of one block shine.
pub fn add_panel(random: &mut Random, level: &mut Level, probability: f64) {
    if random.unit() < probability {
        let block = random.below(level.blocks.len());
        level.blocks[block].emission[random.below(6)] = Vec3::new(1.0, 0.5, 2.0);
    }
}

/// A gentle bend of the plan: walls stay upright, floors and ceilings flat.
fn bent(point: DVec3) -> DVec3 {
    let DVec3 { x, y, z } = point;
    DVec3::new(
        x + 0.12 * (0.9 * z).sin(),
        0.8 * y,
        z + 0.1 * (0.7 * x).sin(),
    )
}

/// A point of a random block, at least `margin` from its walls in the unit cube; often next to a wall.
pub fn random_position(random: &mut Random, level: &Level, margin: f64) -> Vec3 {
    let block = &level.blocks[random.below(level.blocks.len())];
    let mut coordinate = || {
        let near = margin + 0.1 * random.unit().powi(3);
        [near, 1.0 - near, 0.05 + 0.9 * random.unit()][random.below(3)]
    };
    let unit = DVec3::new(coordinate(), coordinate(), coordinate());
    block.warp.point(unit).as_vec3()
}

/// An intensity from 0 to 1e6 W/sr, mostly below 1 W/sr.
pub fn random_intensity(random: &mut Random) -> Vec3 {
    let scale = match random.below(8) {
        0 => 0.0,
        1 => 1e6,
        2 => 1e3,
        _ => random.unit() as f32,
    };
    Vec3::new(1.0, 0.5, 0.25) * scale
}

/// A light of any kind, sometimes on a wall.
pub fn random_light(random: &mut Random, level: &Level) -> Light {
    let position = random_position(random, level, 0.0);
    let radius = [0.0, 0.1, 0.3][random.below(3)];
    let intensity = random_intensity(random);
    let mut side = || random.unit() as f32 - 0.5;
    let direction = Vec3::new(side(), side(), side() + 0.01);
    match random.below(6) {
        0 => Light::Spot {
            position,
            radius,
            intensity,
            direction,
            inner_angle: 0.3,
            outer_angle: 0.8,
        },
        1 => Light::Directional {
            direction,
            irradiance: intensity,
        },
        _ => Light::sphere(position, radius, intensity),
    }
}

/// Up to `count` random lights that are inside a block of the scene. Some fall out: positions are rounded, so one on a
/// wall of a bent block may be outside.
pub fn random_lights(
    random: &mut Random,
    level: &Level,
    scene: &Scene,
    count: usize,
) -> Vec<Light> {
    let mut lights: Vec<Light> = (0..count).map(|_| random_light(random, level)).collect();
    lights.retain(|&light| place(&scene.level, light).is_ok());
    lights
}
