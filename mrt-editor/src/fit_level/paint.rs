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
use rayon::prelude::*;
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

/// Distance of each sample from the nearest block, in diagonals of that block.
pub fn distances(level: &Level, receivers: &ReceiverMap, points: &[MeshSample]) -> Vec<f64> {
    let distance = |point: &MeshSample| {
        let nearest = receivers.nearest_block(point.position);
        nearest.map_or(f64::INFINITY, |(block, distance)| {
            distance / level.blocks[block.get()].warp.diagonal()
        })
    };
    points.par_iter().map(distance).collect()
}

/// Measures how much of the mesh a level holds, from samples of it and their [`distances`] from the level.
pub fn coverage(points: &[MeshSample], distances: &[f64]) -> Coverage {
    let (mut inside, mut near, mut total) = (0.0, 0.0, 0.0);
    for (point, &distance) in points.iter().zip(distances) {
        total += point.area;
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

/// Paints the walls from samples whose normals point into the rooms, and their [`distances`] from the level.
pub fn paint_level(
    level: &mut Level,
    painted: PaintedMesh<'_>,
    receivers: &ReceiverMap,
    points: &[MeshSample],
    distances: &[f64],
) -> PaintReport {
    let wall_of = |point: &MeshSample| {
        let receiver = receivers.receiver(point.position, point.normal)?;
        let face = receivers.turned_face(&receiver)?;
        Some((receiver.block.get(), face, painted.albedo(point)))
    };
    let found: Vec<_> = points
        .par_iter()
        .zip(distances)
        .map(|(point, &distance)| {
            if distance <= NEAR {
                wall_of(point)
            } else {
                None
            }
        })
        .collect();
    let mut report = PaintReport::default();
    let mut lost = DVec3::ZERO;
    let mut walls = vec![[WallSum::default(); 6]; level.blocks.len()];
    // One after the other, so that sums do not depend on the number of threads.
    for (point, found) in points.iter().zip(found) {
        let power = painted.power(point);
        if let Some((block, face, albedo)) = found {
            let wall = &mut walls[block][face.index()];
            wall.add(albedo, point.area);
            wall.power += power;
        } else {
            lost += power;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit_level::mesh_samples::sample_mesh;
    use glam::DVec3;
    use mrt_core::geometry::cube::CubeRotation;
    use mrt_core::geometry::hexahedron::Hexahedron;
    use mrt_core::geometry::mesh::Material;
    use mrt_runtime::blocks::SHAPES;

    /// A closed block whose ceiling is bent.
    fn level() -> Level {
        let mut warp = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(4.0, 3.0, 4.0));
        warp.corners[7].y = 3.5;
        let block = Block::new(&SHAPES[0], CubeRotation::IDENTITY, warp, Vec3::ONE);
        Level {
            blocks: vec![block],
            ..Level::default()
        }
    }

    /// A panel of 1 m² below the ceiling that looks down, and one of 2 m² as far away as `x`, both of one material.
    fn panels(x: f32, albedo: Vec3) -> TriangleMesh {
        let panel = |x: f32, width: f32| {
            [[0.0, 0.0], [width, 0.0], [0.0, 1.0], [width, 1.0]]
                .map(|[dx, z]| Vec3::new(x + dx, 2.9, 1.0 + z))
        };
        let positions = [panel(1.0, 1.0), panel(x, 2.0)].concat();
        let triangles = vec![[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]];
        TriangleMesh {
            materials: vec![Material {
                name: "panel".to_owned(),
                albedo,
            }],
            ..TriangleMesh::from_triangles(positions, triangles)
        }
    }

    fn paint(level: &mut Level, mesh: &TriangleMesh, radiance: Vec3) -> PaintReport {
        let colours = &SurfaceColours::of_materials(mesh).with_emission(radiance);
        let receivers = ReceiverMap::new(level);
        let points = sample_mesh(mesh, 500);
        let far = distances(level, &receivers, &points);
        paint_level(
            level,
            PaintedMesh { mesh, colours },
            &receivers,
            &points,
            &far,
        )
    }

    #[test]
    fn walls_send_out_the_power_of_their_surfaces() {
        let mut level = level();
        let radiance = Vec3::new(3.0, 2.0, 1.0);
        let report = paint(&mut level, &panels(40.0, Vec3::splat(0.5)), radiance);
        let ceiling = Face::PosY.index();
        let block = &level.blocks[0];
        let lit = block
            .emission
            .iter()
            .filter(|&&emission| emission != Vec3::ZERO);
        assert_eq!(lit.count(), 1);
        // The bent ceiling, cut into far more parts than paint_level cuts it.
        let mut area = 0.0;
        for k in 0..200 * 200 {
            let at = |k: usize| (k as f64 + 0.5) / 200.0;
            let jacobian = block
                .warp
                .jacobian(DVec3::new(at(k % 200), 1.0, at(k / 200)));
            area += jacobian.x_axis.cross(jacobian.z_axis).length() / 40_000.0;
        }
        let power = block.emission[ceiling].as_dvec3() * area;
        let expected = radiance.as_dvec3() * PI;
        // A wall in 8 x 8 parts errs by 1e-5; emission is stored in f32.
        assert!(
            (power / expected - 1.0).abs().max_element() < 1e-4,
            "{power}"
        );
        let near = |found: [f64; 3], expected: DVec3| {
            (DVec3::from_array(found) / expected - 1.0)
                .abs()
                .max_element()
                < 1e-6
        };
        assert!(near(report.emitted_w, expected), "{report:?}");
        assert!(near(report.lost_emission_w, 2.0 * expected), "{report:?}");
    }

    #[test]
    fn means_of_walls_are_moved_into_range_and_counted() {
        let mut level = level();
        let report = paint(
            &mut level,
            &panels(2.0, Vec3::new(1.0, 0.5, 0.0)),
            Vec3::ZERO,
        );
        // Walls without surfaces take the block's mean, which is moved as well.
        assert_eq!(report.moved_walls, 6);
        assert_eq!(level.blocks[0].albedo, [Vec3::new(0.9, 0.5, 0.05); 6]);
        assert_eq!(report.emissive_walls, 0);
    }
}
