//! What is measured: mazes and their lights, the same on every machine.

use glam::{DVec3, Vec3};
use mrt_core::lighting::sampling::hash;
use mrt_runtime::blocks::maze;
use mrt_runtime::{Level, Light};

/// Of all mazes.
const SEED: u64 = 41;

/// Of all walls: three channels that differ.
pub const ALBEDO: Vec3 = Vec3::new(0.8, 0.6, 0.4);

/// Blocks that share a light, and lights at most: direct light asks every light at every texel.
const BLOCKS_PER_LIGHT: usize = 10;
const MOST_LIGHTS: usize = 16;

/// Of lights, in blocks: what the lights of a dictionary's prior have.
const RADIUS: f32 = 0.1;

/// Of lights: how far from the middle of a block, in blocks, which leaves a quarter of one to the walls.
const JITTER: f64 = 0.25;

/// A lit maze.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Such as "maze41".
    pub name: String,
    /// The maze.
    pub level: Level,
    /// Sphere lights of several colours, each in a block of its own.
    pub lights: Vec<Light>,
}

impl Setting {
    /// A maze of so many blocks with so many lights, or one for each ten blocks, at most 16.
    pub fn new(blocks: usize, lights: Option<usize>) -> Self {
        let level = maze(blocks, ALBEDO, SEED);
        let count = level.blocks.len();
        let usual = (count / BLOCKS_PER_LIGHT).clamp(1, MOST_LIGHTS);
        let lights = lights.unwrap_or(usual).clamp(1, count);
        let lit = (0..lights).map(|light| (2 * light + 1) * count / (2 * lights));
        Self::with_lights_in(format!("maze{blocks}"), level, &lit.collect::<Vec<_>>())
    }

    /// A maze of so many blocks, with lights in those that fewest openings part from the one in the middle.
    pub fn together(blocks: usize, lights: usize) -> Self {
        let level = maze(blocks, ALBEDO, SEED);
        let neighbours = level.neighbours();
        // Mazes are nearly square, row after row.
        let count = level.blocks.len();
        let width = (count as f64).sqrt().ceil() as usize;
        let mut lit = vec![(count / 2 + width / 2).min(count - 1)];
        let mut next = 0;
        while next < lit.len() && lit.len() < lights {
            for opening in neighbours[lit[next]].iter().flatten() {
                if !lit.contains(&opening.block) && lit.len() < lights {
                    lit.push(opening.block);
                }
            }
            next += 1;
        }
        Self::with_lights_in(format!("maze{blocks}"), level, &lit)
    }

    /// So many mazes side by side, of which light reaches one: as many blocks as [`Setting::together`] has lights.
    pub fn islands(mazes: usize, blocks: usize) -> Self {
        let one = maze(blocks, ALBEDO, SEED);
        let side = (mazes as f64).sqrt().ceil() as usize;
        let mut level = Level::default();
        for k in 0..mazes {
            let apart = 2.0 * blocks as f64;
            let shift = DVec3::new((k % side) as f64 * apart, 0.0, (k / side) as f64 * apart);
            let first = level.blocks.len();
            level
                .blocks
                .extend(one.blocks.iter().cloned().map(|mut block| {
                    block.warp.corners = block.warp.corners.map(|corner| corner + shift);
                    block
                }));
            level
                .connections
                .extend(one.connections.iter().map(|&(mut connection)| {
                    connection.a.block += first;
                    connection.b.block += first;
                    connection
                }));
        }
        let lit: Vec<usize> = (0..blocks).collect();
        Self::with_lights_in(format!("maze{blocks}x{mazes}"), level, &lit)
    }

    fn with_lights_in(name: String, level: Level, lit: &[usize]) -> Self {
        let place = |(light, &block): (usize, &usize)| {
            let jitter = |axis: u32| {
                let unit = f64::from(hash(light as u32, axis)) / f64::from(u32::MAX);
                (2.0 * unit - 1.0) * JITTER
            };
            let offset = DVec3::new(jitter(0), jitter(1), jitter(2));
            Light::Sphere {
                position: (level.blocks[block].warp.center() + offset).as_vec3(),
                radius: RADIUS,
                intensity: COLOURS[light % COLOURS.len()],
            }
        };
        Self {
            name,
            lights: lit.iter().enumerate().map(place).collect(),
            level,
        }
    }

    /// Position, radius and intensity of each light.
    pub fn spheres(&self) -> Vec<(Vec3, f32, Vec3)> {
        let sphere = |light: &Light| match *light {
            Light::Sphere {
                position,
                radius,
                intensity,
            } => Some((position, radius, intensity)),
            _ => None,
        };
        self.lights.iter().filter_map(sphere).collect()
    }
}

const COLOURS: [Vec3; 4] = [
    Vec3::new(1.0, 0.9, 0.8),
    Vec3::new(0.6, 0.8, 1.0),
    Vec3::new(1.0, 0.7, 0.4),
    Vec3::new(0.8, 1.0, 0.7),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_light_is_in_a_block_of_its_own() {
        for blocks in [1, 5, 41, 300] {
            let setting = Setting::new(blocks, None);
            let mut lit: Vec<usize> = setting
                .spheres()
                .iter()
                .filter_map(|(position, ..)| {
                    let mut all = setting.level.blocks.iter();
                    all.position(|b| b.warp.contains(position.as_dvec3(), 0.0))
                })
                .collect();
            assert_eq!(lit.len(), setting.lights.len());
            lit.dedup();
            assert_eq!(lit.len(), setting.lights.len());
        }
        assert_eq!(Setting::new(41, None).lights.len(), 4);
        assert_eq!(Setting::new(5, Some(9)).lights.len(), 5);
        assert_eq!(Setting::together(10, 10).lights.len(), 10);
    }

    #[test]
    fn lights_together_are_few_openings_apart() {
        let positions = Setting::together(400, 10).spheres();
        assert_eq!(positions.len(), 10);
        let far = |a: &(Vec3, f32, Vec3)| positions.iter().any(|b| a.0.distance(b.0) > 12.0);
        assert!(!positions.iter().any(far));
    }
}
