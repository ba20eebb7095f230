//! Gives every wall of a level the mean albedo of the surfaces that receive their light from it, and their emission.

use super::mesh_samples::MeshSample;
use crate::import::surface_colours::{SurfaceColours, SurfacePoint};
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_runtime::Level;
use mrt_runtime::blocks::Block;
use mrt_runtime::low_level::light::limits::MAX_LIGHT_VALUE;
use mrt_runtime::low_level::output::receiver::ReceiverMap;
use serde::Serialize;
use std::f64::consts::PI;

/// A point is near a block within this share of the block's diagonal: walls of real rooms have niches, and blocks are
/// coarse.
const NEAR: f64 = 0.1;

/// Images are averaged over this share of the area that a point stands for. Less lets noise of fine patterns through; more
/// takes in what lies beyond a triangle's edges, where an image may show something else.
const SHARE_AVERAGED: f64 = 0.25;

/// Parts along each axis into which a wall is cut to measure it: warped walls are bent.
const WALL_PARTS: usize = 8;

/// Shares of the mesh's area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Coverage {
    /// Inside a block.
    pub inside: f64,
    /// Inside or near one.
    pub near: f64,
}

/// A mesh and its colours.
#[derive(Clone, Copy)]
pub struct PaintedMesh<'a> {
    /// Where its triangles are.
    pub mesh: &'a TriangleMesh,
    /// The colours of its points.
    pub colours: &'a SurfaceColours,
}

/// What [`paint_level`] gave to the walls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PaintReport {
    /// Walls whose mean albedo was moved into [`SurfaceColours::albedo_range`].
    pub moved_walls: usize,
    /// Walls that send out light.
    pub emissive_walls: usize,
    /// Power that they send out, RGB, W.
    pub emitted_w: [f64; 3],
    /// Power of surfaces too far from every block, which is left out, RGB, W.
    pub lost_emission_w: [f64; 3],
}

/// What is known of a wall's surfaces.
#[derive(Clone, Copy, Debug, Default)]
struct WallSum {
    /// Albedo times area.
    albedo: DVec3,
    area: f64,
    /// Emitted power, W.
    power: DVec3,
}

/// What walls without surfaces are painted with, and how dark and bright walls may be.
struct Palette {
    of_level: Option<Vec3>,
    range: [f32; 2],
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

impl PaintedMesh<'_> {
    /// Mean albedo around a sample.
    fn albedo(&self, point: &MeshSample) -> Vec3 {
        let place = SurfacePoint {
            triangle: point.triangle,
            barycentric: point.barycentric,
            area: (SHARE_AVERAGED * point.area) as f32,
        };
        self.colours.albedo(self.mesh, &place)
    }

    /// Power that the area around a sample sends out, W. A diffuse surface emits π times its radiance.
    fn power(&self, point: &MeshSample) -> DVec3 {
        let radiance = self.colours.emission(self.mesh, point.triangle);
        radiance.as_dvec3() * (PI * point.area)
    }
}

/// Mean albedo of each material over its triangles; grey for a material without any.
pub fn material_albedos(painted: PaintedMesh<'_>, points: &[MeshSample]) -> Vec<Vec3> {
    let materials = &painted.mesh.materials;
    let mut sums = vec![WallSum::default(); materials.len()];
    for point in points {
        let material = painted.mesh.triangle_materials[point.triangle] as usize;
        sums[material].add(painted.albedo(point), point.area);
    }
    let sums = sums.iter().zip(materials);
    sums.map(|(sum, material)| mean([sum].into_iter()).unwrap_or(material.albedo))
        .collect()
}

/// Paints the walls from samples whose normals point into the rooms.
pub fn paint_level(
    level: &mut Level,
    painted: PaintedMesh<'_>,
    receivers: &ReceiverMap,
    points: &[MeshSample],
) -> PaintReport {
    let mut report = PaintReport::default();
    let mut lost = DVec3::ZERO;
    let mut walls = vec![[WallSum::default(); 6]; level.blocks.len()];
    for point in points {
        let power = painted.power(point);
        let is_near = distance_in_blocks(level, receivers, point) <= NEAR;
        let receiver = receivers.receiver(point.position, point.normal);
        let Some(receiver) = receiver.filter(|_| is_near) else {
            lost += power;
            continue;
        };
        if let Some(face) = receivers.turned_face(&receiver) {
            let wall = &mut walls[receiver.block.get()][face.index()];
            wall.add(painted.albedo(point), point.area);
            wall.power += power;
        }
    }
    report.lost_emission_w = lost.to_array();
    let palette = Palette {
        of_level: mean(walls.iter().flatten()),
        range: painted.colours.albedo_range(),
    };
    for (block, walls) in level.blocks.iter_mut().zip(&walls) {
        paint_block(block, walls, &palette, &mut report);
    }
    report
}

fn paint_block(
    block: &mut Block,
    walls: &[WallSum; 6],
    palette: &Palette,
    report: &mut PaintReport,
) {
    let [low, high] = palette.range.map(Vec3::splat);
    let of_block = mean(walls.iter())
        .or(palette.of_level)
        .unwrap_or(Vec3::splat(0.5));
    for face in Face::ALL {
        let wall = &walls[face.index()];
        let found = if block.is_open(face) {
            of_block
        } else {
            mean([wall].into_iter()).unwrap_or(of_block)
        };
        let albedo = found.clamp(low, high);
        report.moved_walls += usize::from(albedo != found && !block.is_open(face));
        block.albedo[face.index()] = albedo;
        if wall.power != DVec3::ZERO {
            let area = wall_area(block, face);
            let most = f64::from(MAX_LIGHT_VALUE);
            let emission = (wall.power / area).min(DVec3::splat(most)).as_vec3();
            block.emission[face.index()] = emission;
            report.emissive_walls += 1;
            for (sum, emission) in report.emitted_w.iter_mut().zip(emission.to_array()) {
                *sum += f64::from(emission) * area;
            }
        }
    }
}

impl WallSum {
    fn add(&mut self, albedo: Vec3, area: f64) {
        self.albedo += albedo.as_dvec3() * area;
        self.area += area;
    }
}

/// The mean albedo over areas; `None` without area. Clamped to [0, 1], which rounding could leave.
fn mean<'a>(sums: impl Iterator<Item = &'a WallSum>) -> Option<Vec3> {
    let (sum, area) = sums.fold((DVec3::ZERO, 0.0), |(sum, area), wall| {
        (sum + wall.albedo, area + wall.area)
    });
    (area > 0.0).then(|| (sum / area).as_vec3().clamp(Vec3::ZERO, Vec3::ONE))
}

/// Area of a block's face, which may be bent, square metres.
fn wall_area(block: &Block, face: Face) -> f64 {
    let [a, b, c, d] = block.warp.face_corners(face);
    let middle = |k: usize| (k as f64 + 0.5) / WALL_PARTS as f64;
    let mut sum = 0.0;
    for i in 0..WALL_PARTS {
        for j in 0..WALL_PARTS {
            let along_u = (b - a).lerp(c - d, middle(j));
            let along_v = (d - a).lerp(c - b, middle(i));
            sum += along_u.cross(along_v).length();
        }
    }
    sum / (WALL_PARTS * WALL_PARTS) as f64
}
