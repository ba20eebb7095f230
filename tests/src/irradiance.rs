//! Irradiance by texel: orders, differences and sums.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::reference::error_measure::rel_l2;
use mrt_runtime::{BlockIndex, Level, Scene};
use std::collections::HashMap;

/// World position, metres, of a texel counted over all blocks.
pub fn position_of(scene: &Scene, texel: usize) -> Vec3 {
    scene.texel_position(texel).expect("a texel of the scene")
}

/// Unit normal of a texel counted over all blocks.
pub fn normal_of(scene: &Scene, texel: usize) -> Vec3 {
    scene.texel_normal(texel).expect("a texel of the scene")
}

/// World position and unit normal of a texel counted over all blocks.
pub fn point_and_normal(scene: &Scene, texel: usize) -> (DVec3, DVec3) {
    let (position, normal) = (position_of(scene, texel), normal_of(scene, texel));
    (position.as_dvec3(), normal.as_dvec3())
}

/// The scene's texels in the order of the reference files: block by block, wall by wall as the level names its faces, and
/// row by row.
pub fn level_order(level: &Level, scene: &Scene) -> Vec<usize> {
    let placed = &scene.level;
    let mut order = Vec::with_capacity(scene.texel_count());
    for (index, block) in level.blocks.iter().enumerate() {
        for face in Face::ALL.into_iter().filter(|&face| !block.is_open(face)) {
            for row in 0..placed.resolution {
                for column in 0..placed.resolution {
                    let texel = placed.level_texel(BlockIndex::new(index), face, row, column);
                    let first = placed.blocks[index].texels.start;
                    order.push(first + texel.expect("walls have texels"));
                }
            }
        }
    }
    order
}

/// A signal of a frame in the order of the reference files ([`level_order`]), channels together.
pub fn in_level_order(level: &Level, scene: &Scene, signal: &[f32]) -> Vec<[f32; 3]> {
    let values = by_texel(scene, signal);
    let order = level_order(level, scene);
    order.into_iter().map(|texel| values[texel]).collect()
}

/// The signal of a frame that [`in_level_order`] takes to these values.
pub fn from_level_order(level: &Level, scene: &Scene, values: &[[f32; 3]]) -> Vec<f32> {
    let order = level_order(level, scene);
    assert_eq!(values.len(), order.len(), "signal lengths");
    let mut sorted = vec![[0.0; 3]; values.len()];
    for (texel, &value) in order.into_iter().zip(values) {
        sorted[texel] = value;
    }
    let blocks = scene.level.blocks.iter();
    let channels = blocks.flat_map(|block| [0, 1, 2].map(|c| (block.texels.clone(), c)));
    channels
        .flat_map(|(texels, c)| sorted[texels].iter().map(move |value| value[c]))
        .collect()
}

/// A signal of a frame in the order of the scene's texels, channels together.
pub fn by_texel(scene: &Scene, signal: &[f32]) -> Vec<[f32; 3]> {
    scene
        .level
        .blocks
        .iter()
        .flat_map(|block| {
            let (start, count) = (3 * block.texels.start, block.texels.len());
            (0..count).map(move |k| std::array::from_fn(|c| signal[start + c * count + k]))
        })
        .collect()
}

/// Position and normal of a texel after a map of space, in steps of 1/64: whole numbers, to compare places by.
fn place(scene: &Scene, texel: usize, map: impl Fn(DVec3) -> DVec3) -> [i32; 6] {
    let (position, normal) = point_and_normal(scene, texel);
    let whole = |v: DVec3| (v * 64.0).round().as_ivec3().to_array();
    let [a, b, c] = whole(map(position));
    let [d, e, f] = whole(map(normal) - map(DVec3::ZERO));
    [a, b, c, d, e, f]
}

/// A signal of the second scene, by texel, in the order of the first scene's texels. An affine map takes each texel of the
/// first scene to one of the second.
pub fn matched(
    first: &Scene,
    second: &Scene,
    signal: &[[f32; 3]],
    map: impl Fn(DVec3) -> DVec3,
) -> Vec<[f32; 3]> {
    let by_place: HashMap<[i32; 6], usize> = (0..second.texel_count())
        .map(|texel| (place(second, texel, |point| point), texel))
        .collect();
    assert_eq!(by_place.len(), second.texel_count(), "places are distinct");
    (0..first.texel_count())
        .map(|texel| signal[by_place[&place(first, texel, &map)]])
        .collect()
}

/// Largest difference between two signals, relative to the largest value of the second.
pub fn largest_difference(ours: &[[f32; 3]], theirs: &[[f32; 3]]) -> f64 {
    relative_difference(ours.as_flattened(), theirs.as_flattened())
}

/// Largest difference between two lists of numbers, relative to the largest number of the second.
pub fn relative_difference(ours: &[f32], theirs: &[f32]) -> f64 {
    let largest = theirs.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    f64::from(largest_apart(ours, theirs)) / f64::from(largest).max(f64::MIN_POSITIVE)
}

/// Relative L2 difference between two lists of numbers.
pub fn relative_l2(ours: &[f32], theirs: &[f32]) -> f64 {
    let [ours, theirs] = [ours, theirs].map(|list| list.iter().map(|&x| f64::from(x)));
    rel_l2(&ours.collect::<Vec<_>>(), &theirs.collect::<Vec<_>>())
}

/// Largest difference between two lists of numbers.
pub fn largest_apart(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len(), "signal lengths");
    a.iter()
        .zip(b)
        .fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Area of every texel, m², in the order of the scene's texels.
pub fn texel_areas(scene: &Scene) -> Vec<f64> {
    let resolution = scene.level.resolution;
    let mut areas = Vec::with_capacity(scene.texel_count());
    for block in &scene.level.blocks {
        for (face, center) in block.shape.texels(resolution) {
            let half = 0.5 / resolution as f64;
            let mut along = [DVec3::ZERO; 2];
            for (side, axis) in along.iter_mut().zip([face.u_axis(), face.v_axis()]) {
                let mut step = DVec3::ZERO;
                step[axis] = half;
                *side = block.warp.point(center + step) - block.warp.point(center - step);
            }
            areas.push(along[0].cross(along[1]).length());
        }
    }
    areas
}
