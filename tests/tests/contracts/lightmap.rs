//! The padded lightmap: complete, exact at texel centres, continuous across openings, clamped at creases.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_runtime::BlockIndex;
use mrt_runtime::low_level::level::placed::Beyond;
use mrt_runtime::low_level::level::placed::PlacedBlock;
use mrt_runtime::{Bounces, Frame, Level, Scene};
use mrt_tests::FrameForTests;
use mrt_tests::{assembled, floor_plan, solved, sphere};

/// A loop, a junction and a room of 2x2: blocks of several orientations are joined, around pillars and not.
const CELLS: [[i32; 2]; 12] = [
    [0, 0],
    [1, 0],
    [2, 0],
    [0, 1],
    [2, 1],
    [0, 2],
    [1, 2],
    [2, 2],
    [3, 1],
    [3, 2],
    [4, 1],
    [4, 2],
];

fn lit() -> (Level, Scene, Frame) {
    let mut level = floor_plan(&CELLS, 0.7);
    // A door that is closed, between blocks that are still joined around it.
    level
        .connections
        .retain(|c| (c.a.block, c.b.block) != (9, 11));
    let scene = assembled(&level);
    let light = sphere(Vec3::new(1.8, 0.4, 0.6), 0.1, Vec3::new(1.0, 2.0, 4.0));
    let frame = solved(&scene, &[light], Bounces::Count(3));
    (level, scene, frame)
}

fn walls(scene: &Scene) -> Vec<(BlockIndex, Face)> {
    let of = |(index, block): (usize, &PlacedBlock)| {
        block
            .shape
            .walls()
            .map(move |face| (BlockIndex::new(index), face))
            .collect::<Vec<_>>()
    };
    scene.level.blocks.iter().enumerate().flat_map(of).collect()
}

fn look_up(
    scene: &Scene,
    frame: &Frame,
    block: BlockIndex,
    face: Face,
    u: f64,
    v: f64,
) -> [f32; 3] {
    let pixel = scene
        .atlas
        .pixel(block, face, u as f32, v as f32)
        .expect("walls have a tile");
    scene.atlas.sample(frame.lightmap().pixels(), pixel)
}

/// A texel of a canonical wall.
fn texel(
    scene: &Scene,
    frame: &Frame,
    block: BlockIndex,
    face: Face,
    row: usize,
    column: usize,
) -> [f32; 3] {
    let offset = scene.level.blocks[block.get()]
        .shape
        .wall_offset(face, scene.level.resolution)
        .expect("walls have texels");
    let texel = offset + row * scene.level.resolution + column;
    frame.indirect_at(block, texel).expect("a texel").to_array()
}

/// Coordinates on a face of a point of the unit cube.
fn on_face(face: Face, unit: DVec3) -> (f64, f64) {
    (unit[face.u_axis()], unit[face.v_axis()])
}

/// The sides of a wall, other than the faces it is parallel to.
fn sides(face: Face) -> impl Iterator<Item = Face> {
    Face::ALL
        .into_iter()
        .filter(move |side| side.axis() != face.axis())
}

/// An edge of a wall at an opening beyond which the wall goes on.
struct JoinedEdge {
    block: BlockIndex,
    face: Face,
    /// The opening.
    side: Face,
    there: BlockIndex,
    /// The wall beyond.
    other_wall: Face,
    there_from_here: CubeRotation,
}

fn joined_edges(scene: &Scene) -> Vec<JoinedEdge> {
    let mut edges = Vec::new();
    for (block, face) in walls(scene) {
        for side in sides(face) {
            let Beyond::Block {
                block: there,
                here_from_there,
                ..
            } = scene.level.blocks[block.get()].beyond[side.index()]
            else {
                continue;
            };
            let there_from_here = here_from_there.inverse();
            let other_wall = there_from_here.face(face);
            if !scene.level.blocks[there.get()].shape.is_open(other_wall) {
                edges.push(JoinedEdge {
                    block,
                    face,
                    side,
                    there,
                    other_wall,
                    there_from_here,
                });
            }
        }
    }
    edges
}

/// The point at `along` in [0, 1] of the edge between two faces.
fn edge_point(face: Face, side: Face, along: f64) -> DVec3 {
    let mut unit = DVec3::splat(along);
    for face in [face, side] {
        unit[face.axis()] = if face.is_positive() { 1.0 } else { 0.0 };
    }
    unit
}

#[test]
fn every_pixel_of_every_tile_is_written_and_no_other() {
    let (_, scene, mut frame) = lit();
    let tile = scene.level.resolution + 2;
    let mut in_tile = vec![false; frame.lightmap().pixels().len()];
    for (block, face) in walls(&scene) {
        let corner = scene.atlas.pixel(block, face, 0.0, 0.0).expect("a tile");
        let (left, top) = (corner.x as usize - 1, corner.y as usize - 1);
        for row in top..top + tile {
            for pixel in &mut in_tile[row * scene.atlas.width + left..][..tile] {
                assert!(!*pixel, "tiles overlap");
                *pixel = true;
            }
        }
    }
    for (pixel, inside) in frame.lightmap().pixels().iter().zip(&in_tile) {
        assert_eq!(pixel.iter().all(|&e| e > 0.0), *inside);
    }
    frame.light_with(&[], Bounces::Count(1));
    assert!(
        frame
            .lightmap()
            .pixels()
            .iter()
            .all(|pixel| *pixel == [0.0; 3])
    );
}

#[test]
fn a_lookup_at_a_texel_s_centre_is_the_texel() {
    let (_, scene, frame) = lit();
    let resolution = scene.level.resolution;
    for (block, face) in walls(&scene) {
        for row in 0..resolution {
            for column in 0..resolution {
                let center = |k: usize| (k as f64 + 0.5) / resolution as f64;
                let found = look_up(&scene, &frame, block, face, center(column), center(row));
                assert_eq!(found, texel(&scene, &frame, block, face, row, column));
            }
        }
    }
}

#[test]
fn joined_walls_meet_without_a_step() {
    // Where tiles of differently turned blocks meet, the same two texels are interpolated from the other
    // end, which rounds differently.
    const ROUNDING: f32 = 2e-7;
    let (_, scene, frame) = lit();
    let brightest = frame.indirect().iter().fold(0.0f32, |m, &e| m.max(e));
    let (mut edges, mut step) = (0, 0.0f32);
    for edge in joined_edges(&scene) {
        let JoinedEdge {
            block,
            face,
            side,
            there,
            other_wall,
            there_from_here,
        } = edge;
        edges += 1;
        for k in 0..=64 {
            let here = edge_point(face, side, f64::from(k) / 64.0);
            let beyond = there_from_here.point(here - side.outward());
            let (u, v) = on_face(face, here);
            let ours = look_up(&scene, &frame, block, face, u, v);
            let (u, v) = on_face(other_wall, beyond);
            let theirs = look_up(&scene, &frame, there, other_wall, u, v);
            for (a, b) in ours.into_iter().zip(theirs) {
                step = step.max((a - b).abs());
            }
        }
    }
    println!(
        "{edges} edges, largest step {:.1e} of the brightest",
        step / brightest
    );
    assert!(edges > 40, "{edges}");
    assert!(step <= ROUNDING * brightest, "{step}");
}

#[test]
fn light_is_continuous_on_the_way_across_an_opening() {
    let (_, scene, frame) = lit();
    // Two points this far from the edge on both sides.
    const DELTA: f64 = 1.0 / 1024.0;
    let (tile, width) = (scene.level.resolution + 2, scene.atlas.width);
    let map = frame.lightmap().pixels();
    let mut largest_difference = 0.0f32;
    for (block, face) in walls(&scene) {
        let corner = scene.atlas.pixel(block, face, 0.0, 0.0).expect("a tile");
        let first = (corner.y as usize - 1) * width + corner.x as usize - 1;
        for k in 0..tile * (tile - 1) {
            let (along, across) = (k % tile, k / tile);
            let rows = (
                first + across * width + along,
                first + (across + 1) * width + along,
            );
            let columns = (
                first + along * width + across,
                first + along * width + across + 1,
            );
            for (a, b) in [rows, columns] {
                for (a, b) in map[a].into_iter().zip(map[b]) {
                    largest_difference = largest_difference.max((a - b).abs());
                }
            }
        }
    }
    // A bilinear filter changes by at most one texel's difference a texel, twice that across the edge.
    let bound = 2.0 * (DELTA * scene.level.resolution as f64) as f32 * largest_difference;
    for edge in joined_edges(&scene) {
        let JoinedEdge {
            block,
            face,
            side,
            there,
            other_wall,
            there_from_here,
        } = edge;
        for k in 0..=32 {
            let edge = edge_point(face, side, f64::from(k) / 32.0);
            let before = edge - side.outward() * DELTA;
            let after = there_from_here.point(edge + side.outward() * DELTA - side.outward());
            let (u, v) = on_face(face, before);
            let ours = look_up(&scene, &frame, block, face, u, v);
            let (u, v) = on_face(other_wall, after);
            let theirs = look_up(&scene, &frame, there, other_wall, u, v);
            for (a, b) in ours.into_iter().zip(theirs) {
                assert!(
                    (a - b).abs() <= bound,
                    "{} of at most {bound}",
                    (a - b).abs()
                );
            }
        }
    }
}

#[test]
fn creases_and_outside_openings_repeat_the_edge() {
    let mut level = floor_plan(&CELLS, 0.7);
    // Door 0 now leads outside on both sides.
    level.connections.remove(0);
    let scene = assembled(&level);
    let light = sphere(Vec3::new(1.8, 0.4, 0.6), 0.1, Vec3::new(1.0, 2.0, 4.0));
    let frame = solved(&scene, &[light], Bounces::Count(3));
    let half = 0.5 / scene.level.resolution as f64;
    let mut outside = 0;
    for (block, face) in walls(&scene) {
        for side in sides(face) {
            let beyond = scene.level.blocks[block.get()].beyond[side.index()];
            if matches!(beyond, Beyond::Block { .. }) {
                continue;
            }
            outside += usize::from(beyond == Beyond::Outside);
            // The outermost texels show what is around a pillar, if there is one.
            for row in 1..scene.level.resolution - 1 {
                let along = (row as f64 + 0.5) / scene.level.resolution as f64;
                let edge = edge_point(face, side, along);
                let (u, v) = on_face(face, edge);
                let at_edge = look_up(&scene, &frame, block, face, u, v);
                let (u, v) = on_face(face, edge - side.outward() * half);
                assert_eq!(at_edge, look_up(&scene, &frame, block, face, u, v));
            }
        }
    }
    assert_eq!(
        outside, 7,
        "three walls of a corner and four of a corridor end at the door"
    );
}

#[test]
fn coordinates_outside_a_wall_are_clamped_and_openings_have_none() {
    let (_, scene, _) = lit();
    let opening = scene.level.blocks[0].shape.openings[0].face;
    assert_eq!(
        scene.atlas.pixel(BlockIndex::new(0), opening, 0.5, 0.5),
        None
    );
    assert_eq!(
        scene.atlas.pixel(
            BlockIndex::new(scene.level.blocks.len()),
            Face::NegY,
            0.5,
            0.5
        ),
        None
    );
    let inside = scene.atlas.pixel(BlockIndex::new(0), Face::NegY, 1.0, 0.0);
    assert_eq!(
        scene.atlas.pixel(BlockIndex::new(0), Face::NegY, 7.0, -3.0),
        inside
    );
    let uv = scene
        .atlas
        .texture_coordinate(BlockIndex::new(0), Face::NegY, 1.0, 1.0)
        .expect("a wall");
    assert!(uv.cmpgt(glam::Vec2::ZERO).all() && uv.cmplt(glam::Vec2::ONE).all());
}
