//! The mirrors that map a canonical shape onto itself.

use crate::level::shape::{Outline, Shape};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::geometry::texel_permutation;

/// True if `map` takes every opening to an opening of the same outline. Doors and windows have an upper and a lower
/// edge, so +y must stay +y for them.
fn keeps(map: CubeSymmetry, shape: &Shape) -> bool {
    shape.openings.iter().all(|opening| {
        let same = shape
            .opening(map.face(opening.face))
            .is_some_and(|image| image.outline == opening.outline);
        let keeps_up = map.face(Face::PosY) == Face::PosY;
        same && (keeps_up || opening.outline == Outline::Whole)
    })
}

/// A largest set of commuting mirrors of the shape: the axis mirrors that keep its openings, and an exchange of two
/// axes without an axis mirror.
pub fn mirrors(shape: &Shape) -> Vec<CubeSymmetry> {
    let axes: Vec<usize> = (0..3)
        .filter(|&axis| keeps(CubeSymmetry::mirror(axis), shape))
        .collect();
    let exchange = [(0, 2), (0, 1), (1, 2)]
        .into_iter()
        .filter(|(a, b)| !axes.contains(a) && !axes.contains(b))
        .map(|(a, b)| CubeSymmetry::exchange(a, b))
        .find(|&map| keeps(map, shape));
    axes.into_iter()
        .map(CubeSymmetry::mirror)
        .chain(exchange)
        .collect()
}

/// For each texel of the shape, the texel that a symmetry of the cube takes it to.
///
/// # Panics
/// If the symmetry does not keep the shape.
pub fn texel_permutation(shape: &Shape, resolution: usize, map: CubeSymmetry) -> Vec<u32> {
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    texel_permutation::texel_permutation(&texels, resolution, map)
}
