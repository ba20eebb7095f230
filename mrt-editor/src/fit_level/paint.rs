//! Gives every wall of a level the mean albedo of the surfaces that receive their light from it.

use super::mesh_samples::MeshSample;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_runtime::Level;
use mrt_runtime::low_level::output::receiver::ReceiverMap;
use serde::Serialize;

/// A point is near a block within this share of the block's diagonal: walls of real rooms have niches, and blocks are
/// coarse.
const NEAR: f64 = 0.1;

/// Shares of the mesh's area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Coverage {
    /// Inside a block.
    pub inside: f64,
    /// Inside or near one.
    pub near: f64,
}

/// Measures how much of the mesh the level holds, from samples of it.
pub fn coverage(level: &Level, receivers: &ReceiverMap, points: &[MeshSample]) -> Coverage {
    let (mut inside, mut near, mut total) = (0.0, 0.0, 0.0);
    for point in points {
        total += point.area;
        let distance = distance_in_blocks(level, receivers, point);
        // Rounding may put a wall's own surface a little outside.
        inside += if distance <= 1e-3 { point.area } else { 0.0 };
        near += if distance <= NEAR { point.area } else { 0.0 };
    }
    if total == 0.0 {
        return Coverage::default();
    }
    Coverage {
        inside: inside / total,
        near: near / total,
    }
}

/// Distance from the nearest block, in diagonals of that block.
fn distance_in_blocks(level: &Level, receivers: &ReceiverMap, point: &MeshSample) -> f64 {
    receivers
        .nearest_block(point.position)
        .map_or(f64::INFINITY, |(block, distance)| {
            distance / level.blocks[block.get()].warp.diagonal()
        })
}

/// Paints the walls and measures how much of the mesh the level holds.
pub fn paint_level(level: &mut Level, mesh: &TriangleMesh, points: &[MeshSample]) -> Coverage {
    let receivers = ReceiverMap::new(level);
    let covered = coverage(level, &receivers, points);
    let mut walls = vec![[(DVec3::ZERO, 0.0); 6]; level.blocks.len()];
    for point in points {
        if distance_in_blocks(level, &receivers, point) > NEAR {
            continue;
        }
        if let Some(receiver) = receivers.receiver(point.position, point.normal)
            && let Some(face) = receivers.turned_face(&receiver)
        {
            let material = mesh.triangle_materials[point.triangle] as usize;
            let albedo = mesh.materials[material].albedo.as_dvec3();
            let (sum, area) = &mut walls[receiver.block.get()][face.index()];
            *sum += albedo * point.area;
            *area += point.area;
        }
    }
    let whole = mean(walls.iter().flatten());
    for (block, walls) in level.blocks.iter_mut().zip(&walls) {
        let of_block = mean(walls.iter()).or(whole).unwrap_or(Vec3::splat(0.5));
        for face in Face::ALL {
            block.albedo[face.index()] = if block.is_open(face) {
                of_block
            } else {
                mean([&walls[face.index()]].into_iter()).unwrap_or(of_block)
            };
        }
    }
    covered
}

/// The mean albedo of sums over areas; `None` without area. Clamped to [0, 1], which rounding could leave.
fn mean<'a>(sums: impl Iterator<Item = &'a (DVec3, f64)>) -> Option<Vec3> {
    let (sum, area) = sums.fold((DVec3::ZERO, 0.0), |(sum, area), (s, a)| {
        (sum + s, area + a)
    });
    (area > 0.0).then(|| (sum / area).as_vec3().clamp(Vec3::ZERO, Vec3::ONE))
}
