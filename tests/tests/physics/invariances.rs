//! Light does not depend on the order and place of blocks, on units, or on how a light is split up.

use glam::{DMat3, DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_runtime::{AssembleConfig, Bounces, Level, Light, Scene};
use mrt_tests::{
    CONVERGED, FrameForTests, Random, by_texel, configured, corridor, default_dictionary,
    floor_plan, largest_difference, matched, solved,
};

/// Tolerance for sums of some thousand products in `f32`, in another order or with other last bits, over ten bounces.
const ROUNDING: f64 = 1e-5;

/// Tolerance where light comes through other openings of the same shape.
///
/// What an opening emits is sampled along rays. Where a ray meets the edge between two texels, rounding decides which of them
/// it sees, and may decide otherwise at another opening. Measured: 1.2e-4 for quarter turns, which exchange the openings of
/// cross blocks, and 3.7e-5 for a mirrored corridor.
const GRID: f64 = 5e-4;

const TEN: Bounces = Bounces::Count(10);

/// A loop and a dead end, with blocks of all shapes but the closed one.
const CELLS: [[i32; 2]; 11] = [
    [0, 0],
    [1, 0],
    [2, 0],
    [0, 1],
    [2, 1],
    [0, 2],
    [1, 2],
    [2, 2],
    [1, 1],
    [3, 1],
    [4, 1],
];

/// Cells whose floors and ceilings have random colours, by cell. Their colours mean the same after a rotation about +Y.
fn painted(cells: &[[i32; 2]]) -> Level {
    let mut level = floor_plan(cells, 0.7);
    for (block, &[x, z]) in level.blocks.iter_mut().zip(cells) {
        for (face, albedo) in Face::ALL.into_iter().zip(&mut block.albedo) {
            if face.axis() == 1 {
                let mut random = Random((x * 100 + z * 10 + face.index() as i32) as u64);
                let mut value = || random.unit() as f32;
                *albedo = Vec3::new(value(), value(), value());
            }
        }
    }
    level
}

const LIGHTS: [Vec3; 2] = [Vec3::new(0.3, 0.6, 0.4), Vec3::new(2.6, 0.3, 1.7)];

fn two_lights() -> [Light; 2] {
    [
        Light::sphere(LIGHTS[0], 0.1, Vec3::new(3.0, 2.0, 1.0)),
        Light::sphere(LIGHTS[1], 0.2, Vec3::new(0.5, 1.0, 2.0)),
    ]
}

/// The scene of a level and its indirect light by texel.
fn indirect(level: &Level, lights: &[Light], bounces: Bounces) -> (Scene, Vec<[f32; 3]>) {
    // Nothing is left out of far light: of two parts of the same size, either could be left out.
    let config = AssembleConfig {
        negligible: Some(0.0),
        ..AssembleConfig::default()
    };
    let scene = configured(level, default_dictionary(), &config);
    let frame = solved(&scene, lights, bounces);
    let signal = by_texel(&scene, &frame.indirect());
    (scene, signal)
}

#[test]
fn the_order_of_blocks_does_not_matter() {
    let (scene, expected) = indirect(&painted(&CELLS), &two_lights(), TEN);
    let mut random = Random(7);
    for _ in 0..3 {
        let mut cells = CELLS.to_vec();
        random.shuffle(&mut cells);
        let (other, found) = indirect(&painted(&cells), &two_lights(), TEN);
        let found = matched(&scene, &other, &found, |p| p);
        let apart = largest_difference(&found, &expected);
        assert!(apart < ROUNDING, "{apart}");
    }
}

#[test]
fn quarter_turns_of_the_level_turn_its_light() {
    let (scene, expected) = indirect(&painted(&CELLS), &two_lights(), TEN);
    let mut cells = CELLS.to_vec();
    let turns: [fn(DVec3) -> DVec3; 3] = [
        |p| DVec3::new(p.z, p.y, -p.x),
        |p| DVec3::new(-p.x, p.y, -p.z),
        |p| DVec3::new(-p.z, p.y, p.x),
    ];
    for map in turns {
        // A quarter turn takes the cell [x, x+1] x [z, z+1] to [z, z+1] x [-x-1, -x].
        for cell in &mut cells {
            *cell = [cell[1], -cell[0] - 1];
        }
        let mut level = floor_plan(&cells, 0.7);
        for (block, original) in level.blocks.iter_mut().zip(&painted(&CELLS).blocks) {
            block.albedo = original.albedo;
        }
        let lights = two_lights().map(|light| moved(light, map, 1.0));
        let (other, found) = indirect(&level, &lights, TEN);
        let found = matched(&scene, &other, &found, map);
        let apart = largest_difference(&found, &expected);
        println!("quarter turn: {apart:.2e}");
        assert!(apart < GRID, "{apart}");
    }
}

/// The light at another place, in a world that is `scale` times larger and has the same irradiance.
fn moved(light: Light, map: impl Fn(DVec3) -> DVec3, scale: f32) -> Light {
    let Light::Sphere {
        position,
        radius,
        intensity,
    } = light
    else {
        panic!("only sphere lights are moved");
    };
    Light::sphere(
        map(position.as_dvec3()).as_vec3(),
        radius * scale,
        intensity * scale * scale,
    )
}

#[test]
fn rigid_motion_and_uniform_scale_change_nothing() {
    let level = painted(&CELLS);
    let (_, expected) = indirect(&level, &two_lights(), TEN);
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    for scale in [1.0, 0.01, 37.0] {
        let map = |p: DVec3| turn * p * scale + DVec3::new(3.0, -1.0, 2.0) * scale;
        let mut other = level.clone();
        for block in &mut other.blocks {
            block.warp.corners = block.warp.corners.map(map);
        }
        let lights = two_lights().map(|light| moved(light, map, scale as f32));
        let (_, found) = indirect(&other, &lights, TEN);
        let apart = largest_difference(&found, &expected);
        // Positions in `f32` are exact to 1e-7 of the level's size, and 0.3 widths from the nearest wall.
        assert!(apart < 2.0 * ROUNDING, "scale {scale}: {apart}");
    }
}

/// The same level, with the corners, colours and openings of one block named anew: its orientation is turned back by
/// `rotation`.
fn with_permuted_corners(level: &Level, index: usize, rotation: CubeRotation) -> Level {
    let mut out = level.clone();
    let block = &mut out.blocks[index];
    let original = &level.blocks[index];
    // `rotation` takes points of the new turned cube to those of the old one.
    block.warp = Hexahedron {
        corners: std::array::from_fn(|k| {
            let there = rotation.point(Hexahedron::unit_corner(k));
            let corner = (0..8)
                .find(|&c| Hexahedron::unit_corner(c) == there)
                .expect("rotations take corners to corners");
            original.warp.corners[corner]
        }),
    };
    let back = rotation.inverse();
    let image = |face: Face| back.face(original.orientation.face(face));
    block.orientation = CubeRotation::from_images(image(Face::PosX), image(Face::PosY))
        .expect("images of two axes are two axes");
    for face in Face::ALL {
        block.albedo[face.index()] = original.albedo[rotation.face(face).index()];
    }
    for end in out
        .connections
        .iter_mut()
        .flat_map(|c| [&mut c.a, &mut c.b])
    {
        if end.block == index {
            end.face = back.face(end.face);
        }
    }
    out
}

#[test]
fn an_orientation_acts_like_a_permutation_of_corners() {
    let mut level = painted(&CELLS);
    let mut random = Random(3);
    for albedo in level.blocks.iter_mut().flat_map(|b| &mut b.albedo) {
        *albedo = Vec3::new(random.unit() as f32, 0.5, 0.8);
    }
    let (_, expected) = indirect(&level, &two_lights(), TEN);
    for (k, rotation) in CubeRotation::all().enumerate() {
        let other = with_permuted_corners(&level, k % level.blocks.len(), rotation);
        let (_, found) = indirect(&other, &two_lights(), TEN);
        assert!(
            found == expected,
            "block {}, {rotation:?}",
            k % level.blocks.len()
        );
    }
}

#[test]
fn light_is_linear_in_intensity() {
    let level = painted(&CELLS);
    let (_, expected) = indirect(&level, &two_lights(), TEN);
    let times = |factor: f32| {
        let lights = two_lights().map(|light| match light {
            Light::Sphere {
                position,
                radius,
                intensity,
            } => Light::sphere(position, radius, intensity * factor),
            other => other,
        });
        let (_, found) = indirect(&level, &lights, TEN);
        found
    };
    let scaled =
        |factor: f32| -> Vec<[f32; 3]> { expected.iter().map(|e| e.map(|e| e * factor)).collect() };
    assert!(times(1024.0) == scaled(1024.0), "powers of two are exact");
    let apart = largest_difference(&times(0.3), &scaled(0.3));
    assert!(apart < ROUNDING, "{apart}");
}

#[test]
fn a_block_may_be_upside_down() {
    let mut level = painted(&[[0, 0], [1, 0], [2, 0]]);
    let (scene, expected) = indirect(&level, &two_lights()[..1], TEN);
    let upright = level.blocks[1].orientation;
    // A half turn about the corridor's axis keeps the openings of a straight block in place.
    let along = upright.face(Face::PosX);
    let up = upright.face(Face::PosY);
    level.blocks[1].orientation =
        CubeRotation::from_images(along, up.opposite()).expect("a rotation");
    let (other, found) = indirect(&level, &two_lights()[..1], TEN);
    let found = matched(&scene, &other, &found, |p| p);
    let apart = largest_difference(&found, &expected);
    println!("upside down: {apart:.2e}");
    assert!(apart < ROUNDING, "{apart}");
}

#[test]
fn lights_add_up() {
    let level = painted(&CELLS);
    let lights = two_lights();
    let (_, together) = indirect(&level, &lights, TEN);
    let (_, first) = indirect(&level, &lights[..1], TEN);
    let (_, second) = indirect(&level, &lights[1..], TEN);
    let sum: Vec<[f32; 3]> = first
        .iter()
        .zip(&second)
        .map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]))
        .collect();
    let apart = largest_difference(&together, &sum);
    println!("superposition: {apart:.2e}");
    // Negative light is set to 0 once a pass. If one light alone left some, sums would differ. These lights are far enough
    // from walls.
    assert!(apart < 1e-4, "{apart}");
}

#[test]
fn channels_do_not_mix() {
    let level = painted(&CELLS);
    let (_, white) = indirect(&level, &two_lights(), TEN);
    for channel in 0..3 {
        let lights = two_lights().map(|light| match light {
            Light::Sphere {
                position,
                radius,
                intensity,
            } => {
                let mut single = Vec3::ZERO;
                single[channel] = intensity[channel];
                Light::sphere(position, radius, single)
            }
            other => other,
        });
        let (_, found) = indirect(&level, &lights, TEN);
        for (found, white) in found.iter().zip(&white) {
            for c in 0..3 {
                let expected = if c == channel { white[c] } else { 0.0 };
                assert_eq!(found[c], expected);
            }
        }
    }
}

#[test]
fn a_mirrored_corridor_has_mirrored_light() {
    let level = floor_plan(&corridor(6), 0.8);
    let at = |x: f32| [Light::sphere(Vec3::new(x, 0.3, 0.6), 0.1, Vec3::ONE)];
    let (scene, left) = indirect(&level, &at(1.25), CONVERGED);
    let (other, right) = indirect(&level, &at(4.75), CONVERGED);
    let mirrored = matched(&scene, &other, &right, |p| DVec3::new(6.0 - p.x, p.y, p.z));
    let apart = largest_difference(&mirrored, &left);
    println!("mirrored corridor: {apart:.2e}");
    assert!(apart < GRID, "{apart}");
}
