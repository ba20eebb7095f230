//! Levels that nobody designed: results stay finite, light never multiplies, and bounces converge.

use glam::Vec3;
use mrt_runtime::BlockIndex;
use mrt_runtime::Frame;
use mrt_runtime::FrameConfig;
use mrt_runtime::Scene;
use mrt_runtime::blocks::Door;
use mrt_runtime::{Bounces, Level, Light};
use mrt_tests::FrameForTests;
use mrt_tests::{Random, assembled, by_texel, solved, sphere, texel_areas};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// What one level is made from.
#[derive(Clone, Debug)]
struct Recipe {
    seed: u64,
    cells: usize,
    /// Share of the doors that stay unconnected.
    unconnected: f64,
    /// Share of the connections that have a door.
    doors: f64,
    /// Probability of a face that shines.
    panels: f64,
    largest_albedo: f32,
    lights: usize,
    light_radius: f32,
}

fn recipe() -> impl Strategy<Value = Recipe> {
    let albedo = prop_oneof![Just(0.99f32), 0.0f32..0.99];
    let light_radius = prop_oneof![Just(0.0f32), Just(0.1f32)];
    (
        any::<u64>(),
        1usize..=40,
        0.0..0.4,
        (0.0..0.5, 0.0..1.0),
        albedo,
        1usize..=4,
        light_radius,
    )
        .prop_map(
            |(seed, cells, unconnected, (doors, panels), largest_albedo, lights, light_radius)| {
                Recipe {
                    seed,
                    cells,
                    unconnected,
                    doors,
                    panels,
                    largest_albedo,
                    lights,
                    light_radius,
                }
            },
        )
}

/// A connected heap of cells, grown from the first by random steps.
fn level(recipe: &Recipe, random: &mut Random) -> Level {
    let mut cells = vec![[0, 0, 0]];
    while cells.len() < recipe.cells {
        let [x, y, z] = cells[random.below(cells.len())];
        let next = [[x + 1, y, z], [x - 1, y, z], [x, y, z + 1], [x, y, z - 1]][random.below(4)];
        if !cells.contains(&next) {
            cells.push(next);
        }
    }
    let mut level = Level::from_cells(&cells, Vec3::ZERO).expect("cells side by side are a level");
    for block in &mut level.blocks {
        for albedo in &mut block.albedo {
            // The third power of a number near 1 is often near 1: some walls are nearly perfect mirrors
            // of light, others dark.
            let mut value = || (1.0 - random.unit().powi(3)) as f32 * recipe.largest_albedo;
            *albedo = Vec3::new(value(), value(), value());
        }
    }
    level
        .connections
        .retain(|_| random.unit() >= recipe.unconnected);
    for connection in 0..level.connections.len() {
        if random.unit() < recipe.doors {
            let value = [0.0, 1.0, random.unit() as f32][random.below(3)];
            level.doors.push(Door { connection, value });
        }
    }
    if random.unit() < recipe.panels {
        let block = random.below(level.blocks.len());
        level.blocks[block].emission[random.below(6)] = Vec3::new(1.0, 0.5, 2.0);
    }
    level
}

/// Lights in random blocks, down to 1e-3 from the nearest wall.
fn lights(recipe: &Recipe, level: &Level, random: &mut Random) -> Vec<Light> {
    (0..recipe.lights)
        .map(|_| {
            let block = &level.blocks[random.below(level.blocks.len())];
            let mut coordinate = || {
                let near = 1e-3 + 0.1 * random.unit().powi(3);
                [near, 1.0 - near, 0.05 + 0.9 * random.unit()][random.below(3)]
            };
            let unit = glam::DVec3::new(coordinate(), coordinate(), coordinate());
            let position = block.warp.point(unit).as_vec3();
            let intensity = Vec3::new(1.0, 0.5, 2.0) * (0.1 + random.unit() as f32);
            sphere(position, recipe.light_radius, intensity)
        })
        .collect()
}

/// A bounce may carry this much more flux than the walls reflected of direct light and emitted: frames scale down
/// what is above, and rounding is left.
const GAIN: f64 = 0.0501;

/// Albedo and emission of all texels.
fn colours(scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let frame = Frame::new(scene, FrameConfig::default());
    let mut colours = Vec::new();
    for (block, placed) in scene.level.blocks.iter().enumerate() {
        for texel in 0..placed.texels.len() {
            let at = (BlockIndex::new(block), texel);
            let albedo = frame.texel_albedo(at.0, at.1).expect("a texel");
            colours.push((albedo, frame.texel_emission(at.0, at.1).expect("a texel")));
        }
    }
    colours
}

proptest! {
    #![proptest_config(Config {
        cases: 60,
        rng_seed: RngSeed::Fixed(2011),
        failure_persistence: None,
        ..Config::default()
    })]

    #[test]
    fn light_in_random_levels_is_finite_and_never_multiplies(recipe in recipe()) {
        let mut random = Random(recipe.seed);
        let level = level(&recipe, &mut random);
        let lights = lights(&recipe, &level, &mut random);
        let scene = assembled(&level);
        let areas = texel_areas(&scene);
        // What the level gives its faces, which no frame changes here.
        let colours = colours(&scene);
        let flux = |signal: &[f32], reflected: bool| -> [f64; 3] {
            let mut sum = [0.0; 3];
            for (texel, e) in by_texel(&scene, signal).into_iter().enumerate() {
                for (c, sum) in sum.iter_mut().enumerate() {
                    let albedo = if reflected { colours[texel].0[c] } else { 1.0 };
                    *sum += areas[texel] * f64::from(albedo) * f64::from(e[c]);
                }
            }
            sum
        };

        let single = solved(&scene, &lights, Bounces::Count(1));
        prop_assert!(single.indirect().iter().all(|e| e.is_finite() && *e >= 0.0));
        let mut emitted = [0.0; 3];
        for (texel, area) in areas.iter().enumerate() {
            let emission = colours[texel].1;
            for (c, sum) in emitted.iter_mut().enumerate() {
                *sum += area * f64::from(emission[c]);
            }
        }
        let mut sent = flux(&single.direct(), true);
        for c in 0..3 {
            sent[c] += emitted[c];
        }
        let arrived = flux(&single.indirect(), false);
        let mut single_gain = 0.0f64;
        for (sent, arrived) in sent.into_iter().zip(arrived) {
            single_gain = single_gain.max(arrived / sent.max(1e-30));
            prop_assert!(arrived <= sent * (1.0 + GAIN), "{} of {}", arrived, sent);
        }

        let limit = 3000;
        let bounces = Bounces::Converged { tolerance: 1e-3, limit };
        let all = solved(&scene, &lights, bounces);
        prop_assert!(all.indirect().iter().all(|e| e.is_finite() && *e >= 0.0));
        prop_assert!(all.last_report().passes() < limit, "still changing after {} passes", all.last_report().passes());
        // With a the largest albedo: reflected = a (injected + reflected) at most.
        let a = f64::from(recipe.largest_albedo);
        let injected = flux(&all.direct(), false);
        let direct = flux(&all.direct(), true);
        let indirect = flux(&all.indirect(), true);
        let mut share = 0.0f64;
        for c in 0..3 {
            let bound = (injected[c] * a + emitted[c] * a) / (1.0 - a);
            let reflected = direct[c] + indirect[c];
            share = share.max(reflected / bound.max(1e-30));
            prop_assert!(reflected <= bound * (1.0 + GAIN), "{} of {}", reflected, bound);
        }
        println!(
            "radius {} {} cells, albedo {:.2}: one bounce x {:.4}, all bounces {:.3} of the bound, {} passes",
            recipe.light_radius, level.blocks.len(), a, single_gain, share, all.last_report().passes()
        );
    }
}
