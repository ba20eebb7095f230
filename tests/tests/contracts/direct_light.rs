//! Beams of direct light, added by vector instructions, against the scalar walk that asks from every texel.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::simd::SimdLevel;
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Progress;
use mrt_runtime::blocks::{Block, Connection, Door, Opening, Shape, maze};
use mrt_runtime::low_level::light::beam::BeamTracer;
use mrt_runtime::low_level::light::direct_light::add_beam::add_beam;
use mrt_runtime::low_level::light::placed::place;
use mrt_runtime::{AssembleConfig, Level, Light, Scene};
use mrt_tests::beam_check::{Tally, beams, compare, texels};
use mrt_tests::position_of;
use mrt_tests::{Random, assembled, floor_plan, random_cells, sphere};

fn random_light(level: &Level, random: &mut Random) -> Light {
    let block = &level.blocks[random.below(level.blocks.len())];
    let mut coordinate = || {
        let near = 1e-3 + 0.1 * random.unit().powi(3);
        [near, 1.0 - near, 0.05 + 0.9 * random.unit()][random.below(3)]
    };
    let unit = DVec3::new(coordinate(), coordinate(), coordinate());
    let position = block.warp.point(unit).as_vec3();
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
        0 => sphere(position, radius, intensity),
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

/// Cells with some neighbours unconnected and some behind doors.
fn random_level(random: &mut Random) -> Level {
    let count = 12 + random.below(20);
    let cells = random_cells(random, count);
    let mut level = floor_plan(&cells, 0.5);
    level.connections.retain(|_| random.unit() > 0.1);
    for connection in 0..level.connections.len() {
        if random.unit() < 0.3 {
            let value = [0.0, 1.0, random.unit() as f32][random.below(3)];
            level.doors.push(Door { connection, value });
        }
    }
    level
}

/// Moves each corner by up to `amount` along each axis, corners in the same place alike.
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

fn swept(name: &str, seed: u64, change: impl Fn(&mut Level)) {
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
    // A shadow's edge is 2e-5 diagonals wide here, and a texel's edge is 0.036: one in a thousand is at an edge.
    assert!(
        tally.edges * 1000 < tally.texels.max(tally.lit),
        "{tally:?}"
    );
    assert!(tally.lit > tally.texels / 100, "{tally:?}");
}

#[test]
fn beams_are_the_walk_in_flat_cells() {
    swept("flat", 1, |_| ());
}

#[test]
fn beams_are_the_walk_in_sheared_and_stretched_cells() {
    swept("affine", 2, |level| {
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
fn beams_are_the_walk_in_warped_cells() {
    swept("warped", 3, |level| crumple(level, 0.08));
}

#[test]
fn beams_are_the_walk_in_a_maze() {
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
    let mut level = floor_plan(&mrt_tests::corridor(6), 0.5);
    level.connections.remove(4);
    level.doors.push(Door {
        connection: 2,
        value: 0.0,
    });
    let scene = assembled(&level);
    let light = sphere(Vec3::new(0.4, 0.6, 0.5), 0.1, Vec3::ONE);
    let placed = place(&scene.level, light).expect("inside");
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
    let dark = sphere(Vec3::new(0.4, 0.6, 0.5), 0.1, Vec3::ZERO);
    let placed = place(&scene.level, dark).expect("inside");
    assert!(beams(&scene, &mut tracer, &placed, &[1.0]).is_empty());
}

/// Beams of a light in a room of 7 x 7 blocks, at most. Windows part only at the 36 posts inside, seen from above:
/// what enters a block is as many beams as posts part the way to it, and one more. In the nearest blocks that is none,
/// in the middle of a side or a corner up to 7: four a block are enough, where sequences of openings are thousands.
const MOST_IN_ROOM: usize = 4 * 49;

#[test]
fn a_room_has_as_many_beams_as_it_has_sequences_of_openings() {
    let cells: Vec<[i32; 2]> = (0..49).map(|k| [k % 7, k / 7]).collect();
    let scene = assembled(&floor_plan(&cells, 0.5));
    let mut tracer = BeamTracer::new(&scene.level);
    for position in [
        Vec3::new(3.4, 0.5, 3.6),
        Vec3::new(0.3, 0.2, 0.4),
        // On the lattice's lines, where windows are slivers, and where it is symmetric.
        Vec3::new(3.0, 0.5, 3.0),
        Vec3::new(3.5, 0.5, 3.5),
    ] {
        let light = sphere(position, 0.1, Vec3::ONE);
        let placed = place(&scene.level, light).expect("inside");
        let found = beams(&scene, &mut tracer, &placed, &[]);
        println!("{position}: {} beams", found.len());
        assert!((49..=MOST_IN_ROOM).contains(&found.len()));
        assert!(found.iter().all(|b| !b.exact && b.planes().len() <= 4));
    }
}

/// The lines from a light in the middle of a block through the room's corners run through texels' centres.
#[test]
fn texels_in_the_plane_where_beams_meet_are_lit_once() {
    let cells: Vec<[i32; 2]> = (0..25).map(|k| [k % 5, k / 5]).collect();
    let mut level = floor_plan(&cells, 0.5);
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
    .map(|[x, z]| sphere(Vec3::new(x, 0.5, z), 0.1, Vec3::ONE))
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
fn extreme_sizes_and_intensities_are_the_walk() {
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
                    sphere(position, 0.0, Vec3::splat(1e9))
                }
            })
            .collect();
        // At a texel's centre, where there is no direction, and beside it.
        let texel = position_of(&scene, 100);
        lights.push(sphere(texel, 0.0, Vec3::splat(1e9)));
        lights.push(sphere(texel, 1e9, Vec3::splat(1e9)));
        compare(&scene, &lights, &scene.level.doors, &mut Tally::default());
    }
}

/// Straight tubes and bends along the floor: round openings have too many planes, and bends are not convex.
#[test]
fn tubes_are_left_to_the_walk() {
    let mut config = BakeConfig::preset_for("standard", "cylinders").expect("a preset");
    config.resolution = 6;
    config.lightfield.positions = 6;
    config.lightfield.directions = 8;
    let dictionary = bake(&config, &Progress::silent()).expect("nobody cancels");
    use Face::{NegX, NegZ, PosX, PosZ};
    let cells = [
        ([0.0, 0.0, 0.0], [NegX, PosX]),
        ([1.0, 0.0, 0.0], [NegX, PosX]),
        ([2.0, 0.0, 0.0], [NegX, PosZ]),
        ([2.0, 0.0, 1.0], [NegZ, PosZ]),
    ];
    let mut level = Level::default();
    for (cell, open) in cells {
        let name = if open[0].opposite() == open[1] {
            "tube"
        } else {
            "bend"
        };
        let shape = Shape::from_name(name).expect("a tube");
        let fits = |turn: &CubeRotation| {
            let faces = shape.openings.iter().map(|o| turn.face(o.face));
            faces.into_iter().all(|face| open.contains(&face))
        };
        let turn = CubeRotation::all().find(fits).expect("any two faces");
        let warp = Hexahedron::cell(DVec3::from_array(cell));
        level
            .blocks
            .push(Block::new(shape, turn, warp, Vec3::splat(0.5)));
    }
    for (block, face) in [(0, PosX), (1, PosX), (2, PosZ)] {
        let (a, b) = (
            Opening { block, face },
            Opening {
                block: block + 1,
                face: face.opposite(),
            },
        );
        level.connections.push(Connection { a, b });
    }
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default()).expect("tubes");
    let lights = [
        sphere(Vec3::new(0.6, 0.55, 0.45), 0.1, Vec3::ONE),
        sphere(Vec3::new(2.4, 0.5, 0.6), 0.1, Vec3::ONE),
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
    let light = sphere(Vec3::new(0.5, 0.5, 0.5), 0.1, Vec3::ONE);
    let placed = place(&scene.level, light).expect("inside");
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
