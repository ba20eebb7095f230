//! The padded lightmap is complete, exact at texel centres, continuous across openings, and clamped at creases.

use glam::{DVec2, DVec3, Vec2, Vec3, dvec2};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_runtime::low_level::level::placed::{Beyond, PlacedBlock};
use mrt_runtime::{BlockIndex, Bounces, Frame, Level, Light, Scene};
use mrt_tests::{FrameForTests, assembled, floor_plan, solved};

/// A loop, a junction and a room of 2x2. Blocks of several orientations are joined, some of them around a pillar.
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

fn lit() -> Frame {
    let mut level = floor_plan(&CELLS, 0.7);
    // Blocks 9 and 11 are not connected with each other, and still with the blocks around them.
    level
        .connections
        .retain(|c| (c.a.block, c.b.block) != (9, 11));
    lit_level(&level)
}

fn lit_level(level: &Level) -> Frame {
    let light = Light::sphere(Vec3::new(1.8, 0.4, 0.6), 0.1, Vec3::new(1.0, 2.0, 4.0));
    solved(&assembled(level), &[light], Bounces::Count(3))
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

/// The light that a game reads at a point of a canonical wall, given by u and v.
fn look_up(frame: &Frame, block: BlockIndex, face: Face, uv: DVec2) -> [f32; 3] {
    let atlas = &frame.scene().atlas;
    let pixel = atlas.pixel(block, face, uv.x as f32, uv.y as f32);
    let pixel = pixel.expect("walls have a tile");
    atlas.sample(frame.lightmap().pixels(), pixel)
}

/// The light of a texel of a canonical wall, given by row and column.
fn texel(frame: &Frame, block: BlockIndex, face: Face, [row, column]: [usize; 2]) -> [f32; 3] {
    let level = &frame.scene().level;
    let offset = level.blocks[block.get()]
        .shape
        .wall_offset(face, level.resolution)
        .expect("walls have texels");
    let texel = offset + row * level.resolution + column;
    frame.indirect_at(block, texel).expect("a texel").to_array()
}

/// u and v on a face of a point of the unit cube.
fn on_face(face: Face, unit: DVec3) -> DVec2 {
    dvec2(unit[face.u_axis()], unit[face.v_axis()])
}

/// The four faces at the sides of a wall.
fn sides(face: Face) -> impl Iterator<Item = Face> {
    Face::ALL
        .into_iter()
        .filter(move |side| side.axis() != face.axis())
}

/// An edge of a wall at an opening, where the wall continues in the next block.
struct JoinedEdge {
    block: BlockIndex,
    face: Face,
    /// The face of the opening.
    side: Face,
    there: BlockIndex,
    /// The wall's continuation.
    other_wall: Face,
    there_from_here: CubeRotation,
}

impl JoinedEdge {
    /// The lightmap on both sides of the edge, `distance` away from it, at `along` in [0, 1].
    fn both_sides(&self, frame: &Frame, along: f64, distance: f64) -> [[f32; 3]; 2] {
        let edge = edge_point(self.face, self.side, along);
        let out = self.side.outward();
        let here = edge - out * distance;
        let beyond = self.there_from_here.point(edge + out * distance - out);
        [
            look_up(frame, self.block, self.face, on_face(self.face, here)),
            look_up(
                frame,
                self.there,
                self.other_wall,
                on_face(self.other_wall, beyond),
            ),
        ]
    }
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

/// Index of the first pixel of a wall's tile, border included.
fn first_pixel(scene: &Scene, block: BlockIndex, face: Face) -> usize {
    let corner = scene.atlas.pixel(block, face, 0.0, 0.0).expect("a tile");
    (corner.y as usize - 1) * scene.atlas.width + corner.x as usize - 1
}

#[test]
fn every_pixel_of_every_tile_is_written_and_no_other() {
    let mut frame = lit();
    let scene = frame.scene().clone();
    let tile = scene.level.resolution + 2;
    let mut in_tile = vec![false; frame.lightmap().pixels().len()];
    for (block, face) in walls(&scene) {
        let first = first_pixel(&scene, block, face);
        for row in 0..tile {
            for pixel in &mut in_tile[first + row * scene.atlas.width..][..tile] {
                assert!(!*pixel, "tiles overlap");
                *pixel = true;
            }
        }
    }
    for (pixel, inside) in frame.lightmap().pixels().iter().zip(&in_tile) {
        assert_eq!(pixel.iter().all(|&e| e > 0.0), *inside);
    }
    frame.light_with(&[], Bounces::Count(1));
    let pixels = frame.lightmap().pixels();
    assert!(pixels.iter().all(|pixel| *pixel == [0.0; 3]));
}

#[test]
fn a_lookup_at_the_centre_of_a_texel_gives_the_texel() {
    let frame = lit();
    let resolution = frame.scene().level.resolution;
    let center = |k: usize| (k as f64 + 0.5) / resolution as f64;
    for (block, face) in walls(frame.scene()) {
        for row in 0..resolution {
            for column in 0..resolution {
                let uv = dvec2(center(column), center(row));
                let found = look_up(&frame, block, face, uv);
                assert_eq!(found, texel(&frame, block, face, [row, column]));
            }
        }
    }
}

#[test]
fn joined_walls_meet_without_a_step() {
    // Where the tiles of differently turned blocks meet, the same two texels are interpolated from the other end, which
    // rounds differently.
    const ROUNDING: f32 = 2e-7;
    let frame = lit();
    let brightest = frame.indirect().iter().fold(0.0f32, |m, &e| m.max(e));
    let (mut edges, mut step) = (0, 0.0f32);
    for edge in joined_edges(frame.scene()) {
        edges += 1;
        for k in 0..=64 {
            let [here, beyond] = edge.both_sides(&frame, f64::from(k) / 64.0, 0.0);
            for (a, b) in here.into_iter().zip(beyond) {
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

/// Largest difference between pixels that are neighbours in a tile.
fn largest_neighbour_difference(frame: &Frame) -> f32 {
    let scene = frame.scene();
    let (tile, width) = (scene.level.resolution + 2, scene.atlas.width);
    let pixels = frame.lightmap().pixels();
    let mut largest = 0.0f32;
    for (block, face) in walls(scene) {
        let first = first_pixel(scene, block, face);
        for k in 0..tile * (tile - 1) {
            let (along, across) = (k % tile, k / tile);
            let in_column = first + across * width + along;
            let in_row = first + along * width + across;
            for (a, b) in [(in_column, in_column + width), (in_row, in_row + 1)] {
                for (a, b) in pixels[a].into_iter().zip(pixels[b]) {
                    largest = largest.max((a - b).abs());
                }
            }
        }
    }
    largest
}

#[test]
fn light_is_continuous_across_an_opening() {
    // The distance of two points from the edge, on both sides.
    const DELTA: f64 = 1.0 / 1024.0;
    let frame = lit();
    let resolution = frame.scene().level.resolution;
    // Over the width of a texel, a bilinear filter changes by at most the largest difference between neighbours. Both
    // sides of the edge count.
    let largest = largest_neighbour_difference(&frame);
    let bound = 2.0 * (DELTA * resolution as f64) as f32 * largest;
    for edge in joined_edges(frame.scene()) {
        for k in 0..=32 {
            let [before, after] = edge.both_sides(&frame, f64::from(k) / 32.0, DELTA);
            for (a, b) in before.into_iter().zip(after) {
                let step = (a - b).abs();
                assert!(step <= bound, "{step} of at most {bound}");
            }
        }
    }
}

#[test]
fn creases_and_outside_openings_repeat_the_edge() {
    let mut level = floor_plan(&CELLS, 0.7);
    // Both openings of this connection now lead outside.
    level.connections.remove(0);
    let frame = lit_level(&level);
    let level = &frame.scene().level;
    let half = 0.5 / level.resolution as f64;
    let mut outside = 0;
    for (block, face) in walls(frame.scene()) {
        for side in sides(face) {
            let beyond = level.blocks[block.get()].beyond[side.index()];
            if matches!(beyond, Beyond::Block { .. }) {
                continue;
            }
            outside += usize::from(beyond == Beyond::Outside);
            // Not the outermost texels: around a pillar they show the wall of another block.
            for row in 1..level.resolution - 1 {
                let along = (row as f64 + 0.5) / level.resolution as f64;
                let edge = edge_point(face, side, along);
                let inside = edge - side.outward() * half;
                let [at_edge, at_texel] =
                    [edge, inside].map(|point| look_up(&frame, block, face, on_face(face, point)));
                assert_eq!(at_edge, at_texel);
            }
        }
    }
    assert_eq!(
        outside, 7,
        "three walls of a corner and four of a corridor end at the openings"
    );
}

#[test]
fn coordinates_outside_a_wall_are_clamped_and_openings_have_none() {
    let frame = lit();
    let (level, atlas) = (&frame.scene().level, &frame.scene().atlas);
    let first = BlockIndex::new(0);
    let opening = level.blocks[0].shape.openings[0].face;
    assert_eq!(atlas.pixel(first, opening, 0.5, 0.5), None);
    let no_block = BlockIndex::new(level.blocks.len());
    assert_eq!(atlas.pixel(no_block, Face::NegY, 0.5, 0.5), None);
    let inside = atlas.pixel(first, Face::NegY, 1.0, 0.0);
    assert_eq!(atlas.pixel(first, Face::NegY, 7.0, -3.0), inside);
    let uv = atlas.texture_coordinate(first, Face::NegY, 1.0, 1.0);
    let uv = uv.expect("a wall");
    assert!(uv.cmpgt(Vec2::ZERO).all() && uv.cmplt(Vec2::ONE).all());
}
