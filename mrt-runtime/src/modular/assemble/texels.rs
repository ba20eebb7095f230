//! Layouts of texels and coefficients in frames, and the positions, normals and areas of texels.

use crate::level::block::Level;
use crate::level::block_index::BlockIndex;
use crate::level::placed::{PlacedBlock, PlacedLevel};
use crate::level::warp_transport::WarpTransport;
use crate::modular::dictionary::{OperatorMatrix, ShapeOperators};
use crate::modular::packed::PackedShape;
use crate::modular::scene::{CoefficientLayout, SceneBlock};
use crate::output::texel_layout::{BlockRank, Planes, TexelGeometry, TexelLayout};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::simd::WIDEST;
use mrt_core::simd::rows::DOT_ROWS;

/// Areas of the texels of a warped block, in units of the mean area of a texel in its openings, so that light that
/// crosses an opening counts the same on both sides. Without openings, the unit is the mean area of all texels.
fn warped_areas(block: &PlacedBlock, resolution: usize) -> Vec<f32> {
    let area = |face: Face, unit: DVec3| {
        let jacobian = block.warp.jacobian(unit);
        let (u, v) = (jacobian.col(face.u_axis()), jacobian.col(face.v_axis()));
        u.cross(v).length()
    };
    let areas: Vec<f64> = block
        .shape
        .texels(resolution)
        .map(|(face, unit)| area(face, unit))
        .collect();
    let openings: Vec<f64> = block
        .shape
        .openings
        .iter()
        .map(|opening| area(opening.face, opening.face.point(0.5, 0.5)))
        .collect();
    let reference = if openings.is_empty() {
        &areas
    } else {
        &openings
    };
    let mean = reference.iter().sum::<f64>() / reference.len().max(1) as f64;
    areas.iter().map(|area| (area / mean) as f32).collect()
}

/// Areas of the texels of each shape; empty if all are 1.
pub(super) fn shape_areas(
    level: &Level,
    placed: &PlacedLevel,
    blocks: &[SceneBlock],
    used: &[&ShapeOperators<impl OperatorMatrix>],
) -> Vec<Vec<f32>> {
    let resolution = placed.resolution;
    let of_shape = |entry: &&ShapeOperators<_>| entry.shape.relative_texel_areas(resolution);
    let mut areas: Vec<Vec<f32>> = used.iter().map(of_shape).collect();
    let mut known = vec![false; areas.len()];
    for (index, block) in level.blocks.iter().enumerate() {
        let shape = blocks[index].shape_index;
        if block.transport != WarpTransport::Canonical && !known[shape] {
            areas[shape] = warped_areas(&placed.blocks[index], resolution);
            known[shape] = true;
        }
    }
    areas
}

/// The order of blocks, by shape, and the slots of their texels.
pub(super) fn texel_layout(blocks: &[SceneBlock], shapes: &[PackedShape]) -> TexelLayout {
    let shape_of = |block: BlockIndex| blocks[block.get()].shape_index;
    let mut order: Vec<BlockIndex> = (0..blocks.len()).map(BlockIndex::new).collect();
    order.sort_by_key(|&block| (shape_of(block), block));
    let mut rank = vec![BlockRank::default(); order.len()];
    let mut slots = Vec::with_capacity(order.len());
    let mut next = 0;
    for (place, &block) in order.iter().enumerate() {
        rank[block.get()] = BlockRank::new(place);
        let count = shapes[shape_of(block)].folding.slots();
        slots.push(next..next + count);
        next += count;
    }
    let foldings = || shapes.iter().map(|shape| &shape.folding);
    TexelLayout {
        shapes: order.iter().map(|&block| shape_of(block) as u32).collect(),
        slot_of_texel: foldings().map(|f| f.slot_of_texel.clone()).collect(),
        texel_of_slot: foldings().map(|f| f.texel_of_slot.clone()).collect(),
        order,
        rank,
        slots,
    }
}

/// The layout of coefficients, with room for the rows of every shape.
pub(super) fn coefficient_layout(shapes: &[PackedShape]) -> CoefficientLayout {
    let most = shapes.iter().map(|shape| shape.rows).max().unwrap_or(0);
    let rows = |shape: &PackedShape| shape.row_of_mode[..shape.modes].to_vec();
    CoefficientLayout {
        // Kernels write whole groups of rows, and the last group may have only one row in use.
        count: (most + DOT_ROWS - 1).next_multiple_of(WIDEST),
        row_of_mode: shapes.iter().map(rows).collect(),
    }
}

/// Positions and normals of all texels, by slot.
pub(super) fn texel_geometry(level: &PlacedLevel, layout: &TexelLayout) -> TexelGeometry {
    let mut geometry = TexelGeometry {
        positions: Planes::new(layout.slot_count()),
        normals: Planes::new(layout.slot_count()),
    };
    for rank in layout.ranks() {
        let placed = &level.blocks[layout.order[rank.get()].get()];
        let texels: Vec<(Face, DVec3)> = placed.shape.texels(level.resolution).collect();
        let texel_of_slot = &layout.texel_of_slot[layout.shape(rank)];
        for (slot, &texel) in layout.slots(rank).zip(texel_of_slot) {
            let Some(&(face, unit)) = texels.get(texel as usize) else {
                // A slot without a texel gets a position in the block, and no light since its normal is 0.
                let middle = placed.warp.center().as_vec3();
                geometry.positions.set(slot, middle);
                continue;
            };
            let position = placed.warp.point(unit).as_vec3();
            geometry.positions.set(slot, position);
            let normal = texel_normal(placed, face, unit).as_vec3();
            geometry.normals.set(slot, normal);
        }
    }
    geometry
}

/// Unit normal into a block at a point of a wall, given in the unit cube.
fn texel_normal(placed: &PlacedBlock, face: Face, unit: DVec3) -> DVec3 {
    match placed.shape.tube() {
        None => {
            let (u, v) = (unit[face.u_axis()], unit[face.v_axis()]);
            placed.warp.face_normal(face, u, v)
        }
        Some(form) => {
            let (face, u, v) = form.chart_of(unit);
            let point = placed.shape.wall_point(face, u, v);
            point.warped_normal(&placed.warp)
        }
    }
}
