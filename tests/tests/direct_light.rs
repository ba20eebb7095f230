//! Beams of direct light, added by vector instructions, against the scalar walk that asks from every texel.

mod common;

use common::{Random, assembled, floor_plan, random_cells, sphere};
use glam::{DVec3, Vec3};
use mrt_core::simd::{SimdLevel, WIDEST};
use mrt_runtime::beam::{Beam, BeamTracer};
use mrt_runtime::direct::{TexelPlanes, add_beam, add_exact, irradiance};
use mrt_runtime::level::{Door, Level};
use mrt_runtime::light::{Light, PlacedLight, place};
use mrt_runtime::maze::maze;
use mrt_runtime::scene::Scene;
use mrt_runtime::visibility::{Openings, Receiver};

/// Share of its own irradiance that a texel may differ by.
const RELATIVE: f32 = 1e-5;

/// Share of the irradiance of a surface that faces the light that a texel may differ by: its cosine is rounded.
const OF_FACING: f32 = 1e-6;

/// Radians that the angle from a spot's axis may differ by.
const ANGLE: f32 = 2e-6;

/// A texel whose visibility flips when it moves by this much, in diagonals of its block, is on a shadow's edge.
const EDGE: f64 = 1e-5;

/// Positions and normals of a block's texels, padded.
struct Texels {
    positions: [Vec<f32>; 3],
    normals: [Vec<f32>; 3],
    count: usize,
}

impl Texels {
    fn new(scene: &Scene, block: usize) -> Self {
        let range = scene.blocks[block].texels.clone();
        let padded = range.len().next_multiple_of(WIDEST);
        let plane = |of: &[Vec3], c: usize| {
            let mut plane: Vec<f32> = of[range.clone()].iter().map(|v| v[c]).collect();
            plane.resize(padded, 0.0);
            plane
        };
        Self {
            positions: [0, 1, 2].map(|c| plane(&scene.texel_positions, c)),
            normals: [0, 1, 2].map(|c| plane(&scene.texel_normals, c)),
            count: range.len(),
        }
    }

    fn planes(&self) -> TexelPlanes<'_> {
        TexelPlanes {
            positions: [0, 1, 2].map(|c| &self.positions[c][..]),
            normals: [0, 1, 2].map(|c| &self.normals[c][..]),
        }
    }
}

/// The beams of one light; an exact one stands for all of its block.
fn beams(scene: &Scene, tracer: &mut BeamTracer, light: &PlacedLight, doors: &[f32]) -> Vec<Beam> {
    let mut beams: Vec<Beam> = Vec::new();
    tracer.trace(scene, 7, light, doors, &mut |beam| {
        assert_eq!(beam.light, 7);
        let of_block = |b: &&Beam| b.block == beam.block;
        assert!(
            !beams.iter().filter(of_block).any(|b| b.exact),
            "exact once"
        );
        if beam.exact {
            beams.retain(|b| b.block != beam.block);
        }
        beams.push(*beam);
    });
    beams
}

/// Irradiance at all texels from some beams, in the order of the scene's texels.
fn lit(
    level: SimdLevel,
    scene: &Scene,
    texels: &[Texels],
    light: &PlacedLight,
    doors: &[f32],
    beams: &[Beam],
) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; scene.texel_count()];
    for beam in beams {
        let block = beam.block as usize;
        let of_block = &texels[block];
        let mut planes = [0, 1, 2].map(|_| vec![0.0; of_block.positions[0].len()]);
        let slices = planes.each_mut().map(|plane| &mut plane[..]);
        if beam.exact {
            add_exact(scene, block, light, doors, slices);
        } else {
            add_beam(level, &of_block.planes(), light, beam, slices);
        }
        for plane in &planes {
            assert!(plane[of_block.count..].iter().all(|&e| e == 0.0), "padding");
        }
        for (k, texel) in scene.blocks[block].texels.clone().enumerate() {
            out[texel] += Vec3::new(planes[0][k], planes[1][k], planes[2][k]);
        }
    }
    out
}

/// What was compared.
#[derive(Debug, Default)]
struct Tally {
    texels: usize,
    lit: usize,
    edges: usize,
    exact: usize,
    beams: usize,
    most_planes: usize,
}

/// Compares every texel, light and level with the reference.
fn compare(scene: &Scene, lights: &[Light], doors: &[f32], tally: &mut Tally) {
    let texels: Vec<Texels> = (0..scene.blocks.len())
        .map(|block| Texels::new(scene, block))
        .collect();
    let mut tracer = BeamTracer::new(scene);
    for &light in lights {
        let placed = place(scene, 0, light).expect("a sound light");
        let beams = beams(scene, &mut tracer, &placed, doors);
        tally.beams += beams.len();
        tally.exact += beams.iter().filter(|b| b.exact).count();
        let planes = beams.iter().map(|b| b.planes().len());
        tally.most_planes = planes.max().unwrap_or(0).max(tally.most_planes);
        let found: Vec<Vec<Vec3>> = SimdLevel::available()
            .map(|level| lit(level, scene, &texels, &placed, doors, &beams))
            .collect();
        for (index, block) in scene.blocks.iter().enumerate() {
            for texel in block.texels.clone() {
                let position = scene.texel_positions[texel].as_dvec3();
                let normal = scene.texel_normals[texel].as_dvec3();
                let at = |position: DVec3, normal: DVec3| {
                    let receiver = Receiver {
                        block: index,
                        position,
                    };
                    irradiance(scene, &placed, doors, receiver, normal, &Openings)
                };
                let expected = at(position, normal);
                let to_light = match light {
                    Light::Sphere { position: p, .. } | Light::Spot { position: p, .. } => {
                        (p.as_dvec3() - position).normalize_or_zero()
                    }
                    Light::Directional { direction, .. } => -direction.as_dvec3().normalize(),
                };
                let facing = at(position, to_light);
                let of_falloff = match light {
                    Light::Spot {
                        position: p,
                        radius,
                        intensity,
                        inner_angle,
                        outer_angle,
                        ..
                    } => {
                        let squared = p.as_dvec3().distance_squared(position) as f32;
                        let full = intensity / squared.max(radius * radius);
                        full * 1.5 * ANGLE / (outer_angle - inner_angle)
                    }
                    _ => Vec3::ZERO,
                };
                let slack = RELATIVE * expected + OF_FACING * facing + of_falloff;
                tally.texels += 1;
                tally.lit += usize::from(expected != Vec3::ZERO);
                let is_near = |found: &Vec<Vec3>| {
                    let apart = (found[texel] - expected).abs();
                    found[texel].is_finite() && apart.cmple(slack).all()
                };
                if found.iter().all(is_near) {
                    continue;
                }
                let (low, high) = block.bounds;
                let step = EDGE * (high - low).length();
                let mut sees = [false; 2];
                for k in 0..27 {
                    let offset = DVec3::new(
                        f64::from(k % 3 - 1),
                        f64::from(k / 3 % 3 - 1),
                        f64::from(k / 9 - 1),
                    );
                    sees[usize::from(at(position + offset * step, to_light) != Vec3::ZERO)] = true;
                }
                let values: Vec<Vec3> = found.iter().map(|f| f[texel]).collect();
                assert!(
                    sees == [true; 2],
                    "texel {texel} of block {index} at {position}, {light:?}: {values:?} where {expected}"
                );
                tally.edges += 1;
            }
        }
    }
}

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
        compare(&scene, &lights, &scene.doors, &mut tally);
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
    compare(&scene, &lights, &scene.doors, &mut tally);
    println!("{tally:?}");
    assert!(tally.edges * 1000 < tally.texels);
}

#[test]
fn blocks_behind_closed_doors_and_walls_have_no_beam() {
    let mut level = floor_plan(&common::corridor(6), 0.5);
    level.connections.remove(4);
    level.doors.push(Door {
        connection: 2,
        value: 0.0,
    });
    let scene = assembled(&level);
    let light = sphere(Vec3::new(0.4, 0.6, 0.5), 0.1, Vec3::ONE);
    let placed = place(&scene, 0, light).expect("inside");
    let mut tracer = BeamTracer::new(&scene);
    let reached = |tracer: &mut BeamTracer, doors: &[f32]| {
        let found = beams(&scene, tracer, &placed, doors);
        found
            .iter()
            .map(|b| (b.block, b.fraction))
            .collect::<Vec<_>>()
    };
    assert_eq!(reached(&mut tracer, &[0.0]), [(0, 1.0), (1, 1.0), (2, 1.0)]);
    let half_open = [(0, 1.0), (1, 1.0), (2, 1.0), (3, 0.5), (4, 0.5)];
    assert_eq!(reached(&mut tracer, &[0.5]), half_open);
    let dark = sphere(Vec3::new(0.4, 0.6, 0.5), 0.1, Vec3::ZERO);
    let placed = place(&scene, 0, dark).expect("inside");
    assert!(beams(&scene, &mut tracer, &placed, &[1.0]).is_empty());
}

#[test]
fn a_room_has_as_many_beams_as_it_has_sequences_of_openings() {
    let cells: Vec<[i32; 2]> = (0..49).map(|k| [k % 7, k / 7]).collect();
    let scene = assembled(&floor_plan(&cells, 0.5));
    let mut tracer = BeamTracer::new(&scene);
    for position in [
        Vec3::new(3.4, 0.5, 3.6),
        Vec3::new(0.3, 0.2, 0.4),
        // On the lattice's lines, where windows are slivers.
        Vec3::new(3.0, 0.5, 3.0),
        Vec3::new(3.5, 0.5, 3.5),
    ] {
        let light = sphere(position, 0.1, Vec3::ONE);
        let placed = place(&scene, 0, light).expect("inside");
        let found = beams(&scene, &mut tracer, &placed, &[]);
        println!("{position}: {} beams", found.len());
    }
}

/// Prints what direct light costs in a maze with four lights.
#[test]
#[ignore = "measures; run it alone with --release --nocapture"]
fn cost() {
    let level = maze(41, Vec3::splat(0.5), 1);
    let scene = assembled(&level);
    let lights: Vec<Light> = [0, 11, 23, 37]
        .map(|block: usize| {
            let center = level.blocks[block].warp.center().as_vec3();
            sphere(center + Vec3::new(0.1, 0.2, -0.15), 0.1, Vec3::ONE)
        })
        .to_vec();
    let placed: Vec<PlacedLight> = lights
        .iter()
        .map(|&light| place(&scene, 0, light).expect("inside"))
        .collect();
    let best = |run: &mut dyn FnMut()| {
        let mut best = f64::INFINITY;
        for _ in 0..200 {
            let start = std::time::Instant::now();
            run();
            best = best.min(start.elapsed().as_secs_f64());
        }
        1e6 * best
    };
    let mut frame = mrt_runtime::frame::Frame::new(&scene);
    let mut old = f64::INFINITY;
    for _ in 0..30 {
        let bounces = mrt_runtime::frame::Bounces::Count(0);
        frame
            .solve(&scene, &lights, &Openings, bounces)
            .expect("sound");
        old = old.min(frame.times().direct.as_secs_f64() * 1e6);
    }
    println!("walk: {old:.0} us, {} texels", scene.texel_count());
    let mut tracer = BeamTracer::new(&scene);
    let mut beams: Vec<Beam> = Vec::with_capacity(4096);
    let traced = best(&mut || {
        beams.clear();
        for (k, light) in placed.iter().enumerate() {
            tracer.trace(&scene, k as u32, light, &[], &mut |beam| beams.push(*beam));
        }
    });
    let planes: usize = beams.iter().map(|b| b.planes().len()).sum();
    println!(
        "trace: {traced:.1} us, {} beams, {planes} planes",
        beams.len()
    );
    let texels: Vec<Texels> = (0..scene.blocks.len())
        .map(|block| Texels::new(&scene, block))
        .collect();
    let mut out: Vec<[Vec<f32>; 3]> = texels
        .iter()
        .map(|t| [0, 1, 2].map(|_| vec![0.0; t.positions[0].len()]))
        .collect();
    for simd in SimdLevel::available() {
        let added = best(&mut || {
            for beam in &beams {
                let block = beam.block as usize;
                let slices = out[block].each_mut().map(|plane| &mut plane[..]);
                let light = &placed[beam.light as usize];
                add_beam(simd, &texels[block].planes(), light, beam, slices);
            }
        });
        println!("{}: add {added:.1} us", simd.name());
    }
    let cells: Vec<[i32; 2]> = (0..900).map(|k| [k % 30, k / 30]).collect();
    for (name, level) in [
        ("room 30x30", floor_plan(&cells, 0.5)),
        (
            "room 7x7",
            floor_plan(
                &cells
                    .iter()
                    .copied()
                    .filter(|c| c[0] < 7 && c[1] < 7)
                    .collect::<Vec<_>>(),
                0.5,
            ),
        ),
        ("maze 2000", maze(2000, Vec3::splat(0.5), 1)),
    ] {
        let scene = assembled_shallow(&level);
        let mut tracer = BeamTracer::new(&scene);
        let light = sphere(Vec3::new(3.4, 0.5, 3.6), 0.1, Vec3::ONE);
        let placed = place(&scene, 0, light).expect("inside");
        let mut count = 0;
        let traced = best(&mut || {
            count = 0;
            tracer.trace(&scene, 0, &placed, &[], &mut |_| count += 1);
        });
        println!("{name}: {count} beams, {traced:.1} us");
    }
}

fn assembled_shallow(level: &Level) -> Scene {
    let config = mrt_runtime::assemble::AssembleConfig {
        max_depth: 1,
        ..Default::default()
    };
    mrt_runtime::assemble::assemble(level, common::default_dictionary(), &config).expect("fits")
}
