//! What is measured: mazes and their lights, the same on every machine.

use glam::{DVec3, Vec3};
use mrt_core::lighting::sampling::hash;
use mrt_runtime::blocks::maze;
use mrt_runtime::{Level, Light};

/// Seed of all mazes.
const SEED: u64 = 41;

/// Albedo of all walls: three channels that differ.
pub const ALBEDO: Vec3 = Vec3::new(0.8, 0.6, 0.4);

/// Blocks for each light by default, and lights by default at most: direct light asks every light at every texel.
const BLOCKS_PER_LIGHT: usize = 10;
const MOST_LIGHTS: usize = 16;

/// Radius of lights, in blocks: that of the lights of a dictionary's prior.
const RADIUS: f32 = 0.1;

/// How far lights may be from the middle of a block along each axis, in blocks: a quarter of a block from the walls.
const JITTER: f64 = 0.25;

/// A sphere light of a maze.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MazeLamp {
    /// Centre, metres.
    pub position: Vec3,
    /// Metres.
    pub radius: f32,
    /// Radiant intensity, W/sr.
    pub intensity: Vec3,
}

/// A lit maze.
#[derive(Clone, Debug)]
pub struct LitMaze {
    /// A name such as "maze41".
    pub name: String,
    /// The maze.
    pub level: Level,
    /// Sphere lights of several colours, each in a block of its own.
    pub lights: Vec<Light>,
}

impl LitMaze {
    /// A maze of this number of blocks, with this number of lights or, by default, one for each ten blocks, 1 to 16.
    pub fn new(blocks: usize, lights: Option<usize>) -> Self {
        let level = maze(blocks, ALBEDO, SEED);
        let count = level.blocks.len();
        let usual = (count / BLOCKS_PER_LIGHT).clamp(1, MOST_LIGHTS);
        let lights = lights.unwrap_or(usual).clamp(1, count);
        let lit = (0..lights).map(|light| (2 * light + 1) * count / (2 * lights));
        Self::with_lights_in(format!("maze{blocks}"), level, &lit.collect::<Vec<_>>())
    }

    /// A maze of this number of blocks, with lights in the blocks that are the fewest openings away from the middle one.
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

    /// A number of mazes side by side that are not joined; each block of the first has a light, and no light reaches the
    /// others.
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

    /// The lights once more, for other methods.
    pub fn lamps(&self) -> Vec<MazeLamp> {
        let lamp = |light: &Light| match *light {
            Light::Sphere {
                position,
                radius,
                intensity,
            } => Some(MazeLamp {
                position,
                radius,
                intensity,
            }),
            _ => None,
        };
        self.lights.iter().filter_map(lamp).collect()
    }
}

/// Intensities that lights take in turn, W/sr.
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
            let maze = LitMaze::new(blocks, None);
            let mut lit: Vec<usize> = maze
                .lamps()
                .iter()
                .filter_map(|lamp| {
                    let mut all = maze.level.blocks.iter();
                    all.position(|b| b.warp.contains(lamp.position.as_dvec3(), 0.0))
                })
                .collect();
            assert_eq!(lit.len(), maze.lights.len());
            lit.dedup();
            assert_eq!(lit.len(), maze.lights.len());
        }
        assert_eq!(LitMaze::new(41, None).lights.len(), 4);
        assert_eq!(LitMaze::new(5, Some(9)).lights.len(), 5);
        assert_eq!(LitMaze::together(10, 10).lights.len(), 10);
    }

    #[test]
    fn lights_together_are_few_openings_apart() {
        let lamps = LitMaze::together(400, 10).lamps();
        assert_eq!(lamps.len(), 10);
        let is_far = |a: &MazeLamp| lamps.iter().any(|b| a.position.distance(b.position) > 12.0);
        assert!(!lamps.iter().any(is_far));
    }
}
