//! Direct light by beams, added with vector instructions, equals the scalar walk from every texel to the light.

use glam::{DVec3, Vec3};
use mrt_core::simd::SimdLevel;
use mrt_runtime::blocks::{Door, maze};
use mrt_runtime::low_level::light::beam::BeamTracer;
use mrt_runtime::low_level::light::direct_light::add_beam::add_beam;
use mrt_runtime::low_level::light::placed::{PlacedLight, place};
use mrt_runtime::{Level, Light, Scene};
use mrt_tests::beam_check::{Tally, beams, compare, texels};
use mrt_tests::tunnels::tunnel;
use mrt_tests::{
    Random, add_doors, assembled, baked, corridor, floor_plan, position_of, random_cells,
    random_position, scene_of, square,
};

/// A light of any kind, at least 1e-3 from every wall.
fn random_light(level: &Level, random: &mut Random) -> Light {
    let position = random_position(random, level, 1e-3);
    let direction = loop {
        let mut part = || 2.0 * random.unit() - 1.0;
        let direction = DVec3::new(part(), part(), part());
        if direction.length() > 0.1 {
            break direction.as_vec3();
        }
    };
    let radius = [0.0, 0.02, 0.3][random.below(3)];
    let intensity = Vec3::new(1.0, 0.5, 2.0) * (0.1 + random.unit() as f32);
    let inner_angle = 1.5 * random.unit() as f32;
    match random.below(3) {
        0 => Light::sphere(position, radius, intensity),
        1 => Light::Spot {
            position,
            radius,
            intensity,
            direction,
            inner_angle,
            outer_angle: inner_angle + 0.02 + random.unit() as f32,
        },
        _ => Light::Directional {
            direction: direction * Vec3::new(1.0, 0.2, 1.0),
            irradiance: intensity,
        },
    }
}

/// A level of cells, some of whose neighbours are not connected and some behind doors.
fn random_level(random: &mut Random) -> Level {
    let count = 12 + random.below(20);
    let cells = random_cells(random, count);
    let mut level = floor_plan(&cells, 0.5);
    level.connections.retain(|_| random.unit() > 0.1);
    add_doors(random, &mut level, 0.3);
    level
}

/// Moves each corner by up to `amount` along each axis. Corners in the same place move together.
fn crumple(level: &mut Level, amount: f64) {
    for block in &mut level.blocks {
        for corner in &mut block.warp.corners {
            let key = (corner.x.round() * 73.0
                + corner.y.round() * 179.0
                + corner.z.round() * 283.0) as i64;
            let mut random = Random(key as u64);
            let mut part = || amount * (2.0 * random.unit() - 1.0);
            *corner += DVec3::new(part(), part(), part());
        }
    }
}

/// Compares random levels after a change.
fn sweep(name: &str, seed: u64, change: impl Fn(&mut Level)) {
    let mut random = Random(seed);
    let mut tally = Tally::default();
    for _ in 0..12 {
        let mut level = random_level(&mut random);
        change(&mut level);
        let lights: Vec<Light> = (0..6).map(|_| random_light(&level, &mut random)).collect();
        let scene = assembled(&level);
        compare(&scene, &lights, &scene.level.doors, &mut tally);
    }
    println!("{name}: {tally:?}");
    // In diagonals of a block, the edge of a shadow is 2e-5 wide and a texel 0.036: of the texels along an edge, one in a
    // thousand is on it.
    assert!(
        tally.edges * 1000 < tally.texels.max(tally.lit),
        "{tally:?}"
    );
    assert!(tally.lit > tally.texels / 100, "{tally:?}");
}

#[test]
fn beams_equal_the_walk_in_flat_cells() {
    sweep("flat", 1, |_| ());
}

#[test]
fn beams_equal_the_walk_in_sheared_and_stretched_cells() {
    sweep("affine", 2, |level| {
        for corner in level.blocks.iter_mut().flat_map(|b| &mut b.warp.corners) {
            *corner = DVec3::new(
                1.5 * corner.x + 0.3 * corner.y + 1000.0,
                0.8 * corner.y + 0.1 * corner.x,
                corner.z - 0.4 * corner.x,
            );
        }
    });
}

#[test]
fn beams_equal_the_walk_in_warped_cells() {
    sweep("warped", 3, |level| crumple(level, 0.08));
}

#[test]
fn beams_equal_the_walk_in_a_maze() {
    let level = maze(41, Vec3::splat(0.5), 1);
    let scene = assembled(&level);
    let mut random = Random(4);
    let lights: Vec<Light> = (0..20).map(|_| random_light(&level, &mut random)).collect();
    let mut tally = Tally::default();
    compare(&scene, &lights, &scene.level.doors, &mut tally);
    println!("{tally:?}");
    assert!(tally.edges * 1000 < tally.texels);
}

#[test]
fn blocks_behind_closed_doors_and_walls_have_no_beam() {
    let mut level = floor_plan(&corridor(6), 0.5);
    level.connections.remove(4);
    level.doors.push(Door {
        connection: 2,
        value: 0.0,
    });
    let scene = assembled(&level);
    let light = Light::sphere(Vec3::new(0.4, 0.6, 0.5), 0.1, Vec3::ONE);
    let placed = placed_in(&scene, light);
    let mut tracer = BeamTracer::new(&scene.level);
    let reached = |tracer: &mut BeamTracer, doors: &[f32]| {
        let found = beams(&scene, tracer, &placed, doors);
        found
            .iter()
            .map(|b| (b.block.get(), b.fraction))
            .collect::<Vec<_>>()
    };
    assert_eq!(reached(&mut tracer, &[0.0]), [(0, 1.0), (1, 1.0), (2, 1.0)]);
    let half_open = [(0, 1.0), (1, 1.0), (2, 1.0), (3, 0.5), (4, 0.5)];
    assert_eq!(reached(&mut tracer, &[0.5]), half_open);
    let dark = Light::sphere(Vec3::new(0.4, 0.6, 0.5), 0.1, Vec3::ZERO);
    let placed = placed_in(&scene, dark);
    assert!(beams(&scene, &mut tracer, &placed, &[1.0]).is_empty());
}

fn placed_in(scene: &Scene, light: Light) -> PlacedLight {
    place(&scene.level, light).expect("the light is inside a block")
}

/// Largest number of beams of a light in a room of 7 x 7 blocks: four for each block on average.
///
/// Seen from above, only the 36 posts between the blocks divide the light. A block is entered by one beam more than there
/// are posts in the light's way to it: one in the nearest blocks, up to seven in the middle of a side or in a corner.
/// Sequences of openings that light can pass are thousands.
const MOST_IN_ROOM: usize = 4 * 49;

#[test]
fn an_open_room_has_few_beams_for_each_block() {
    let scene = assembled(&floor_plan(&square(7), 0.5));
    let mut tracer = BeamTracer::new(&scene.level);
    for position in [
        Vec3::new(3.4, 0.5, 3.6),
        Vec3::new(0.3, 0.2, 0.4),
        // On the grid's lines, from where openings look like slits, and in its centre of symmetry.
        Vec3::new(3.0, 0.5, 3.0),
        Vec3::new(3.5, 0.5, 3.5),
    ] {
        let light = Light::sphere(position, 0.1, Vec3::ONE);
        let placed = placed_in(&scene, light);
        let found = beams(&scene, &mut tracer, &placed, &[]);
        println!("{position}: {} beams", found.len());
        assert!((49..=MOST_IN_ROOM).contains(&found.len()));
        assert!(found.iter().all(|b| !b.exact && b.planes().len() <= 4));
    }
}

/// From the middle of a block, lines through the corners of the room run through centres of texels.
#[test]
fn texels_in_the_plane_where_beams_meet_are_lit_once() {
    let mut level = floor_plan(&square(5), 0.5);
    level
        .connections
        .retain(|c| c.a.block != 0 && c.b.block != 0);
    let scene = assembled(&level);
    let mut lights: Vec<Light> = [
        [2.5, 2.5],
        [2.03125, 2.09375],
        [1.46875, 2.53125],
        [2.0, 2.5],
    ]
    .map(|[x, z]| Light::sphere(Vec3::new(x, 0.5, z), 0.1, Vec3::ONE))
    .to_vec();
    lights.extend(
        [[1.0, 1.0], [0.5, 1.0], [1.0, 0.25]].map(|[x, z]| Light::Directional {
            direction: Vec3::new(x, -0.125, z),
            irradiance: Vec3::ONE,
        }),
    );
    let mut tally = Tally::default();
    compare(&scene, &lights, &[], &mut tally);
    println!("{tally:?}");
    assert!(tally.edges < 100, "{tally:?}");
}

#[test]
fn beams_equal_the_walk_at_extreme_sizes_and_intensities() {
    let mut random = Random(5);
    for scale in [1e-5, 1e8] {
        let mut level = random_level(&mut random);
        for corner in level.blocks.iter_mut().flat_map(|b| &mut b.warp.corners) {
            *corner *= scale;
        }
        let scene = assembled(&level);
        let mut lights: Vec<Light> = (0..4)
            .map(|_| match random_light(&level, &mut random) {
                Light::Directional { direction, .. } => Light::Directional {
                    direction: direction * 1e8,
                    irradiance: Vec3::splat(1e9),
                },
                Light::Sphere { position, .. } | Light::Spot { position, .. } => {
                    Light::sphere(position, 0.0, Vec3::splat(1e9))
                }
            })
            .collect();
        // At the centre of a texel, from where light has no direction.
        let texel = position_of(&scene, 100);
        lights.push(Light::sphere(texel, 0.0, Vec3::splat(1e9)));
        lights.push(Light::sphere(texel, 1e9, Vec3::splat(1e9)));
        compare(&scene, &lights, &scene.level.doors, &mut Tally::default());
    }
}

/// A round opening has too many planes for a beam, and a bend is not convex.
#[test]
fn tubes_are_left_to_the_walk() {
    let dictionary = baked("standard", "cylinders", |config| {
        config.resolution = 6;
        config.lightfield.positions = 6;
        config.lightfield.directions = 8;
    });
    let level = tunnel(&[[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1]]);
    let scene = scene_of(&level, &dictionary);
    let lights = [
        Light::sphere(Vec3::new(0.6, 0.55, 0.45), 0.1, Vec3::ONE),
        Light::sphere(Vec3::new(2.4, 0.5, 0.6), 0.1, Vec3::ONE),
        Light::Directional {
            direction: Vec3::new(1.0, -0.1, 0.05),
            irradiance: Vec3::ONE,
        },
    ];
    let mut tally = Tally::default();
    compare(&scene, &lights, &[], &mut tally);
    println!("{tally:?}");
    assert!(tally.exact > 5 && tally.lit > 100, "{tally:?}");
}

#[test]
fn tracing_and_adding_allocate_nothing() {
    let scene = assembled(&maze(41, Vec3::splat(0.5), 1));
    let mut tracer = BeamTracer::new(&scene.level);
    let light = Light::sphere(Vec3::new(0.5, 0.5, 0.5), 0.1, Vec3::ONE);
    let placed = placed_in(&scene, light);
    let most = scene.layout.slots.iter().map(|slots| slots.len()).max();
    let mut out = [0, 1, 2].map(|_| vec![0.0; most.expect("blocks")]);
    let counted = allocation_counter::measure(|| {
        tracer.trace(&scene.level, 0, &placed, &[], &mut |beam| {
            let planes = texels(&scene, beam.block);
            let count = planes.positions[0].len();
            let slices = out.each_mut().map(|s| &mut s[..count]);
            add_beam(SimdLevel::detect(), &planes, &placed, beam, slices);
        });
    });
    assert_eq!(counted.count_total, 0);
    assert!(out[0].iter().any(|&e| e > 0.0));
}
