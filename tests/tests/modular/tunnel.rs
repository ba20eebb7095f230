//! Tunnels of round tubes, against a path tracer on a fine mesh of the same tunnel and against physics.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_core::reference::path_tracer::{PathScene, PathSettings, SphereLight, irradiance};
use mrt_runtime::blocks::Opening;
use mrt_runtime::{
    AssembleConfig, BlockIndex, Bounces, Dictionary, Frame, FrameConfig, Level, Light, LightError,
    Scene,
};
use mrt_tests::tunnels::{ALBEDO, tunnel};
use mrt_tests::{
    FrameForTests, bake_of, baked, changed, configured, patch_mesh, point_and_normal, position_of,
    red, set_lightfields, solved, uniformly_lit, with_threads,
};
use std::sync::OnceLock;

/// A walk with bends to the left and to the right, and straight tubes between them.
const TUNNEL: [[i32; 3]; 10] = [
    [0, 0, 0],
    [1, 0, 0],
    [2, 0, 0],
    [2, 0, 1],
    [2, 0, 2],
    [3, 0, 2],
    [4, 0, 2],
    [4, 0, 1],
    [4, 0, 0],
    [5, 0, 0],
];

/// A bake that takes seconds: 12² texels a chart, and half of the preset's lightfield samples along each axis.
fn small_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("standard", "cylinders", |config| {
            config.resolution = 12;
            config.lightfield.positions = 8;
            config.lightfield.directions = 16;
        })
    })
}

fn assembled(level: &Level, dictionary: &Dictionary) -> Scene {
    let config = AssembleConfig {
        max_depth: 10,
        ..AssembleConfig::default()
    };
    configured(level, dictionary, &config)
}

fn lamp(position: DVec3) -> Light {
    Light::sphere(position.as_vec3(), 0.1, Vec3::ONE)
}

fn middle(cell: [i32; 3]) -> DVec3 {
    DVec3::from_array(cell.map(f64::from)) + 0.5
}

fn lit(scene: &Scene, lights: &[Light], bounces: Bounces) -> Vec<f64> {
    red(&solved(scene, lights, bounces))
}

/// Area of every texel, for unit blocks, m².
fn areas(scene: &Scene) -> Vec<f64> {
    let mut areas = Vec::with_capacity(scene.texel_count());
    for block in &scene.level.blocks {
        let form = block.shape.tube().expect("a tube");
        for face in block.shape.walls() {
            for j in 0..scene.level.resolution {
                let area = form.texel_area(face, scene.level.resolution, j);
                areas.extend(std::iter::repeat_n(area, scene.level.resolution));
            }
        }
    }
    areas
}

/// Facets along each axis of a chart. Facets lie up to 1e-4 inside the wall.
const FACETS: u32 = 64;

/// Distance of receivers from the wall, which keeps them before its facets.
const LIFT: f64 = 2e-4;

fn mesh(scene: &Scene) -> TriangleMesh {
    let blocks = scene.level.blocks.iter();
    let charts = blocks.flat_map(|block| {
        block.shape.walls().map(move |face| {
            move |u, v| {
                let point = block.shape.wall_point(face, u, v).position;
                block.warp.point(point)
            }
        })
    });
    patch_mesh(charts, FACETS, ALBEDO)
}

/// Two independent estimates of all texels' irradiance after one bounce.
fn traced(scene: &Scene, position: DVec3, paths: u32) -> [Vec<f64>; 2] {
    let light = SphereLight {
        position,
        intensity: DVec3::ONE,
        radius: 0.1,
    };
    let traced = PathScene::new(&mesh(scene), vec![light], &[]).expect("a sound mesh");
    let receivers: Vec<(DVec3, DVec3)> = (0..scene.texel_count())
        .map(|k| point_and_normal(scene, k))
        .map(|(p, n)| (p + n * LIFT, n))
        .collect();
    [1, 2].map(|seed| {
        let settings = PathSettings {
            paths,
            bounces: 1,
            seed,
        };
        let found = irradiance(&traced, &receivers, &settings);
        found.iter().map(|e| e.indirect.x).collect()
    })
}

/// Relative L2 error of some texels, weighted by area.
///
/// The noise of the reference adds nothing to it. Noise is independent in the two estimates a and b, so (x - a)(x - b) has
/// the mean (x - exact)².
fn error(
    found: &[f64],
    reference: &[Vec<f64>; 2],
    areas: &[f64],
    texels: impl Iterator<Item = usize>,
) -> f64 {
    let [a, b] = reference;
    let (mut miss, mut norm) = (0.0, 0.0);
    for k in texels {
        miss += areas[k] * (found[k] - a[k]) * (found[k] - b[k]);
        norm += areas[k] * a[k] * b[k];
    }
    (miss.max(0.0) / norm).sqrt()
}

/// The larger error over all texels of a tunnel with two lights, one after the other. Prints errors block by block.
fn worst_error(dictionary: &Dictionary, cells: &[[i32; 3]], paths: u32) -> f64 {
    let scene = assembled(&tunnel(cells), dictionary);
    let areas = areas(&scene);
    let mut worst: f64 = 0.0;
    for source in [0, cells.len() / 2] {
        let light = middle(cells[source]) + DVec3::new(0.05, 0.1, -0.08);
        let found = lit(&scene, &[lamp(light)], Bounces::Count(1));
        let reference = traced(&scene, light, paths);
        for (block, placed) in scene.level.blocks.iter().enumerate() {
            let error = error(&found, &reference, &areas, placed.texels.clone());
            let mean = |e: &[f64]| {
                let sum: f64 = placed.texels.clone().map(|k| e[k] * areas[k]).sum();
                sum / placed.texels.clone().map(|k| areas[k]).sum::<f64>()
            };
            println!(
                "light in {source}, block {block} ({}), hop {}: {:.4} of mean {:.2e}, found {:.2e}",
                placed.shape.name,
                block.abs_diff(source),
                error,
                mean(&reference[0]),
                mean(&found),
            );
        }
        let total = error(&found, &reference, &areas, 0..scene.texel_count());
        println!("light in {source}: {total:.4}");
        worst = worst.max(total);
    }
    worst
}

#[test]
fn a_tunnel_agrees_with_a_path_tracer() {
    // The bound is that of the standard preset, which the ignored test bakes.
    let worst = worst_error(small_dictionary(), &TUNNEL, 128);
    assert!(worst < 0.06, "{worst}");
}

#[test]
#[ignore = "bakes the standard preset of tubes, which takes minutes"]
fn a_tunnel_of_the_standard_preset_agrees_with_a_path_tracer() {
    let dictionary = baked("standard", "cylinders", |_| ());
    let worst = worst_error(&dictionary, &TUNNEL, 32);
    assert!(worst < 0.06, "{worst}");
    // Measured: 13.4 %. Texels of 1/32 are nearer to the rim than positions of the lightfields, 1/12 apart, can resolve.
    assert!(seam(&dictionary) < 0.15);
}

/// Relative L2 difference between the light of a level and of its image under a map of space.
fn image_error(level: &Level, image: &Level, map: impl Fn(DVec3) -> DVec3) -> f64 {
    let light = DVec3::new(2.4, 0.6, 1.45);
    let (here, there) = (
        assembled(level, small_dictionary()),
        assembled(image, small_dictionary()),
    );
    let found = lit(&here, &[lamp(light)], Bounces::Count(2));
    let mapped = lit(&there, &[lamp(map(light))], Bounces::Count(2));
    let (mut miss, mut norm) = (0.0, 0.0);
    for (block, other) in here.level.blocks.iter().zip(&there.level.blocks) {
        for texel in block.texels.clone() {
            let place = map(position_of(&here, texel).as_dvec3());
            let distance = |k: &usize| position_of(&there, *k).as_dvec3().distance(place);
            let twin = other
                .texels
                .clone()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .expect("a tube has texels");
            // Positions are in single precision.
            assert!(distance(&twin) < 1e-5);
            miss += (found[texel] - mapped[twin]).powi(2);
            norm += found[texel].powi(2);
        }
    }
    (miss / norm).sqrt()
}

#[test]
fn a_mirrored_tunnel_has_mirrored_light() {
    let mirrored = TUNNEL.map(|[x, y, z]| [x, y, -z]);
    let mirror = |p: DVec3| DVec3::new(p.x, p.y, 1.0 - p.z);
    let error = image_error(&tunnel(&TUNNEL), &tunnel(&mirrored), mirror);
    println!("mirrored: {error:.1e}");
    // Operators keep the mirror symmetry of shapes up to rounding of `f32`, about 1e-6 for each product.
    assert!(error < 1e-4, "{error}");
}

#[test]
fn bends_up_and_down_act_like_bends_to_the_side() {
    // A quarter turn about x: z becomes y.
    let turned = TUNNEL.map(|[x, y, z]| [x, z, -y]);
    let turn = |p: DVec3| DVec3::new(p.x, p.z, 1.0 - p.y);
    let error = image_error(&tunnel(&TUNNEL), &tunnel(&turned), turn);
    println!("turned: {error:.1e}");
    // A straight tube may be rolled between bends that are not. The error is what the basis loses in that exchange.
    assert!(error < 0.01, "{error}");
}

#[test]
fn a_white_furnace_stays_white_in_a_long_tunnel() {
    let cells: [[i32; 3]; 9] = std::array::from_fn(|x| [x as i32, 0, 0]);
    let scene = assembled(&tunnel(&cells), small_dictionary());
    let found = red(&uniformly_lit(&scene, Bounces::Count(1)));
    for texel in scene.level.blocks[4].texels.clone() {
        // In the middle, 0.1 % of the light is missing through the ends, four widths away. The rest of the tolerance is the
        // error of the bases at the borders of tubes.
        assert!(
            (found[texel] / f64::from(ALBEDO) - 1.0).abs() < 0.03,
            "{}",
            found[texel]
        );
    }
}

#[test]
fn energy_never_grows() {
    let mut level = tunnel(&TUNNEL);
    for block in &mut level.blocks {
        block.albedo = [Vec3::ONE; 6];
    }
    let scene = assembled(&level, small_dictionary());
    let areas = areas(&scene);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let flux = |e: &[f64]| e.iter().zip(&areas).map(|(e, a)| e * a).sum::<f64>();
    let lights = [lamp(middle(TUNNEL[4]))];
    let mut before = 0.0;
    let mut added = f64::INFINITY;
    for passes in 1..40 {
        frame.light_with(&lights, Bounces::Count(passes));
        let now = flux(&red(&frame));
        // The tolerance is rounding of `f32` in the sum.
        assert!(now - before <= added + 1e-5 * now, "{passes}");
        (added, before) = (now - before, now);
    }
}

#[test]
fn joined_tubes_have_no_seam() {
    // Measured: 4.7 %, with 12 texels and 8 positions of the lightfields across a tube.
    let seam = seam(small_dictionary());
    assert!(seam < 0.06, "{seam}");
}

/// The two texels of a row that are nearest to an opening.
struct RowEnd {
    /// World position of the nearest.
    place: DVec3,
    nearest: usize,
    next: usize,
}

impl RowEnd {
    /// Light in the opening, extrapolated from the two texels.
    fn extrapolated(&self, light: &[f64]) -> f64 {
        1.5 * light[self.nearest] - 0.5 * light[self.next]
    }
}

/// The ends of all rows of a block at an opening.
fn row_ends(scene: &Scene, opening: &Opening) -> Vec<RowEnd> {
    let resolution = scene.level.resolution;
    let block = &scene.level.blocks[opening.block];
    let side = block.orientation.inverse().face(opening.face);
    let point = |texel: usize| position_of(scene, texel).as_dvec3();
    let plane = block.warp.point(side.point(0.5, 0.5));
    let out = (plane - block.warp.center()).normalize();
    let depth = |texel: usize| (plane - point(texel)).dot(out);
    let rows = block.texels.clone().step_by(resolution);
    rows.map(|first| {
        let last = first + resolution - 1;
        let (nearest, next) = if depth(first) < depth(last) {
            (first, first + 1)
        } else {
            (last, last - 1)
        };
        RowEnd {
            place: point(nearest),
            nearest,
            next,
        }
    })
    .collect()
}

/// Jump of the light between joined tubes, extrapolated to their openings from both sides: root mean square over all rims,
/// relative to the mean of the level.
fn seam(dictionary: &Dictionary) -> f64 {
    let scene = assembled(&tunnel(&TUNNEL), dictionary);
    let lamp = lamp(middle(TUNNEL[4]) + DVec3::new(0.1, 0.05, 0.1));
    let found = lit(&scene, &[lamp], Bounces::Count(2));
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    let (mut squares, mut count) = (0.0, 0);
    for connection in &tunnel(&TUNNEL).connections {
        let theirs = row_ends(&scene, &connection.b);
        for ours in row_ends(&scene, &connection.a) {
            let distance = |end: &RowEnd| end.place.distance(ours.place);
            let twin = theirs
                .iter()
                .min_by(|p, q| distance(p).total_cmp(&distance(q)))
                .expect("tubes have rows");
            let jump = ours.extrapolated(&found) - twin.extrapolated(&found);
            squares += jump * jump;
            count += 1;
        }
    }
    let seam = (squares / f64::from(count)).sqrt() / mean;
    println!("seams: {seam:.4} of the mean");
    seam
}

/// A place on the rim of a chart.
struct RimPoint {
    /// World position.
    place: DVec3,
    /// What the lightmap shows there.
    light: [f32; 3],
    /// Block and face of the chart.
    chart: (usize, Face),
}

/// Points along the rims of all charts, one beside each texel.
fn rim_points(frame: &Frame) -> Vec<RimPoint> {
    let scene = frame.scene();
    let resolution = scene.level.resolution;
    let mut points = Vec::new();
    for (index, block) in scene.level.blocks.iter().enumerate() {
        for face in block.shape.walls() {
            for k in 0..resolution {
                let along = (k as f64 + 0.5) / resolution as f64;
                for (u, v) in [(0.0, along), (1.0, along), (along, 0.0), (along, 1.0)] {
                    let point = block.shape.wall_point(face, u, v).position;
                    let atlas = &scene.atlas;
                    let pixel = atlas.pixel(BlockIndex::new(index), face, u as f32, v as f32);
                    let pixel = pixel.expect("a chart");
                    points.push(RimPoint {
                        place: block.warp.point(point),
                        light: atlas.sample(frame.lightmap().pixels(), pixel),
                        chart: (index, face),
                    });
                }
            }
        }
    }
    points
}

#[test]
fn the_lightmap_is_continuous_around_and_along_the_tunnel() {
    let scene = assembled(&tunnel(&TUNNEL), small_dictionary());
    let frame = solved(&scene, &[lamp(middle(TUNNEL[2]))], Bounces::Count(1));
    let rims = rim_points(&frame);
    let brightest = rims.iter().fold(0f32, |most, rim| most.max(rim.light[0]));
    let mut pairs = 0;
    for (k, a) in rims.iter().enumerate() {
        for b in &rims[k + 1..] {
            if a.chart != b.chart && a.place.distance(b.place) < 1e-9 {
                // Both are means of the same two texels. In an image of this size, `f32` coordinates give the weights of 1/2
                // to 1e-5.
                let slack = 1e-5 * brightest;
                assert!(
                    (a.light[0] - b.light[0]).abs() <= slack,
                    "{:?} {:?}",
                    a.chart,
                    b.chart
                );
                pairs += 1;
            }
        }
    }
    // Four rims along each of ten tubes, and nine discs where two tubes of four charts meet.
    assert_eq!(pairs, (10 * 4 + 9 * 4) * scene.level.resolution);
}

#[test]
fn an_unconnected_tube_is_dark() {
    let mut level = tunnel(&TUNNEL[..4]);
    level.connections.pop();
    let scene = assembled(&level, small_dictionary());
    let found = lit(&scene, &[lamp(middle(TUNNEL[0]))], Bounces::Count(4));
    let texels = &scene.level.blocks[3].texels;
    assert!(found[texels.clone()].iter().all(|&e| e == 0.0));
    assert!(
        found[scene.level.blocks[2].texels.clone()]
            .iter()
            .any(|&e| e > 0.0)
    );
}

#[test]
fn a_light_outside_the_round_wall_is_skipped() {
    let scene = assembled(&tunnel(&TUNNEL), small_dictionary());
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let corner = lamp(DVec3::new(1.5, 0.05, 0.05));
    frame.add_light(corner);
    let report = frame.solve();
    let expected = LightError::OutsideTube {
        block: BlockIndex::new(1),
        found: Vec3::new(1.5, 0.05, 0.05),
    };
    let reasons = report.skipped_lights().iter().map(|light| light.reason);
    assert_eq!(reasons.collect::<Vec<_>>(), [expected]);
}

#[test]
fn the_number_of_threads_changes_no_bit_of_a_bake_of_tubes() {
    let config = changed("mobile", "cylinders", |config| {
        config.resolution = 6;
        set_lightfields(config, 6, 10, 24);
    });
    let bytes = |threads| with_threads(threads, || bake_of(&config).to_bytes().expect("finite"));
    assert_eq!(bytes(1), bytes(3));
}
