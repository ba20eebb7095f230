//! A closed door lets no light pass, and an open one changes nothing.

use glam::Vec3;
use mrt_runtime::blocks::Door;
use mrt_runtime::{Bounces, Coupling, Frame, FrameConfig, FrameError, Level, Light, Scene};
use mrt_tests::{
    CONVERGED, COUPLINGS, FrameForTests, Random, by_texel, configured, corridor,
    default_dictionary, floor_plan, largest_difference, lossless, random_cells, ring, solved,
};

/// Tolerance relative to the brightest texel: light behind doors is summed apart from the rest, so sums of products in
/// `f32` have another order. Measured over ten bounces: 6e-7.
const ROUNDING: f64 = 5e-6;

const TEN: Bounces = Bounces::Count(10);

fn assembled(level: &Level, coupling: Coupling) -> Scene {
    configured(level, default_dictionary(), &lossless(coupling))
}

/// Index of the connection between two blocks.
fn between(level: &Level, a: usize, b: usize) -> usize {
    level
        .connections
        .iter()
        .position(|c| (c.a.block, c.b.block) == (a, b) || (c.b.block, c.a.block) == (a, b))
        .expect("the blocks are joined")
}

fn with_door(mut level: Level, connection: usize, value: f32) -> Level {
    level.doors.push(Door { connection, value });
    level
}

fn lamp(position: Vec3) -> Light {
    Light::sphere(position, 0.1, Vec3::new(1.0, 2.0, 3.0))
}

/// A signal at the texels of some blocks.
fn in_blocks(scene: &Scene, signal: &[f32], blocks: std::ops::Range<usize>) -> Vec<[f32; 3]> {
    let all = by_texel(scene, signal);
    let texels = scene.level.blocks[blocks.start].texels.start
        ..scene.level.blocks[blocks.end - 1].texels.end;
    all[texels].to_vec()
}

#[test]
fn behind_a_closed_door_light_is_exactly_zero() {
    let level = floor_plan(&corridor(4), 0.9);
    let connection = between(&level, 1, 2);
    let level = with_door(level, connection, 0.0);
    for coupling in COUPLINGS {
        let scene = assembled(&level, coupling);
        for bounces in [Bounces::Count(1), CONVERGED] {
            let frame = solved(&scene, &[lamp(Vec3::new(1.9, 0.5, 0.5))], bounces);
            for signal in [frame.direct(), frame.indirect()] {
                let behind = in_blocks(&scene, &signal, 2..4);
                assert!(behind.iter().all(|e| *e == [0.0; 3]), "{coupling:?}");
                let before = in_blocks(&scene, &signal, 0..2);
                assert!(before.as_flattened().iter().sum::<f32>() > 0.0);
            }
        }
    }
}

#[test]
fn an_open_door_acts_like_no_door_and_a_closed_one_like_no_connection() {
    let mut random = Random(31);
    let mut plans = vec![corridor(5), ring()];
    plans.extend((0..6).map(|_| random_cells(&mut random, 9)));
    for (k, cells) in plans.iter().enumerate() {
        let plain = floor_plan(cells, 0.8);
        let connection = random.below(plain.connections.len());
        let light = lamp(Vec3::new(0.4, 0.6, 0.3));
        for coupling in COUPLINGS {
            for value in [0.0, 1.0] {
                let mut expected = plain.clone();
                if value == 0.0 {
                    expected.connections.remove(connection);
                }
                let scene = assembled(&expected, coupling);
                let expected = solved(&scene, &[light], TEN);
                let scene = assembled(&with_door(plain.clone(), connection, value), coupling);
                let found = solved(&scene, &[light], TEN);
                assert_eq!(&found.direct(), &expected.direct());
                let apart = largest_difference(
                    &by_texel(&scene, &found.indirect()),
                    &by_texel(&scene, &expected.indirect()),
                );
                println!("plan {k}, {coupling:?}, door at {value}: {apart:.1e}");
                assert!(apart < ROUNDING, "plan {k}, {coupling:?}, {value}: {apart}");
            }
        }
    }
}

#[test]
fn light_that_crosses_doors_is_multiplied_by_their_values() {
    // A corridor with two doors, lit in the first block only. Block 1 is before the doors, 2 behind one, 3 behind both.
    let level = floor_plan(&corridor(4), 0.8);
    let (first, second) = (between(&level, 1, 2), between(&level, 2, 3));
    let level = with_door(with_door(level, first, 1.0), second, 1.0);
    for coupling in COUPLINGS {
        let scene = assembled(&level, coupling);
        let mut direct = vec![0.0; 3 * scene.texel_count()];
        direct[..3 * scene.level.blocks[0].texels.end].fill(1.0);
        let mut frame = Frame::new(&scene, FrameConfig::default());
        let mut solve = |values: [f32; 2]| {
            for (door, value) in values.into_iter().enumerate() {
                frame.set_door(door, value).expect("a door and a fraction");
            }
            frame.light_from(&direct, Bounces::Count(1));
            (0..4)
                .map(|block| in_blocks(&scene, &frame.indirect(), block..block + 1))
                .collect::<Vec<_>>()
        };
        let open = solve([1.0, 1.0]);
        for values in [[0.25, 1.0], [1.0, 0.5], [0.3, 0.7], [0.0, 1.0], [1.0, 0.0]] {
            let found = solve(values);
            let passed = [1.0, 1.0, values[0], values[0] * values[1]];
            for block in 0..4 {
                let scaled: Vec<[f32; 3]> = open[block]
                    .iter()
                    .map(|e| e.map(|x| x * passed[block]))
                    .collect();
                if passed[block] == 0.0 {
                    assert!(found[block].iter().all(|e| *e == [0.0; 3]));
                } else {
                    let apart = largest_difference(&found[block], &scaled);
                    assert!(
                        apart < ROUNDING,
                        "{coupling:?}, {values:?}, {block}: {apart}"
                    );
                }
            }
        }
    }
}

#[test]
fn opening_a_door_never_takes_light_from_behind_it() {
    let level = floor_plan(&corridor(4), 0.8);
    let connection = between(&level, 1, 2);
    let scene = assembled(&with_door(level, connection, 0.0), Coupling::Table);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let mut before = 0.0;
    for step in 0..=8 {
        frame.set_door(0, step as f32 / 8.0).expect("a fraction");
        let light = lamp(Vec3::new(0.4, 0.6, 0.3));
        frame.light_with(&[light], TEN);
        let behind = in_blocks(&scene, &frame.indirect(), 2..4);
        let sum: f32 = behind.as_flattened().iter().sum();
        assert!(step == 0 || sum > before, "{step}: {sum}, {before} before");
        before = sum;
    }
}

#[test]
fn values_outside_0_to_1_and_doors_that_do_not_exist_are_refused() {
    let level = floor_plan(&corridor(2), 0.5);
    let scene = assembled(&with_door(level, 0, 0.5), Coupling::Table);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    for (door, value) in [
        (0, f32::NAN),
        (0, -0.1),
        (0, 1.1),
        (1, 0.5),
        (usize::MAX, 0.5),
    ] {
        let error = frame.set_door(door, value).expect_err("refused");
        assert!(matches!(error, FrameError::Door { .. }), "{error}");
        assert_eq!(frame.doors(), [0.5]);
    }
}
