//! The one-bounce operator by ray tracing, as the paper computes it (section 7.1). Tests compare it with the closed form
//! of [`crate::modular::one_bounce::cube`] and with the quadrature of [`crate::modular::one_bounce::tube`].
//!
//! Rays are cosine-weighted Owen-scrambled Sobol' points with a scramble of their own for each texel, so
//! the result is the same on every run. The standard error of an element f is at most sqrt(f / rays).

use crate::modular::surface::walls::cube::texel_at;
use crate::modular::surface::walls::tube::{TubeWall, direction_around};
use glam::DVec3;
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_core::lighting::sampling::{cosine_hemisphere_from_square, sobol_point, square_from_unit};
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::Shape;
use rayon::prelude::*;

/// Distance, in block widths, by which rays start off the wall.
const RAY_OFFSET: f64 = 1e-5;

/// Estimates F (texels x texels, one value a texel) of a shape with `rays` rays from each texel centre.
pub fn ray_traced_bounce(shape: &Shape, resolution: usize, rays: u32) -> Matrix<f64> {
    let (mesh, walls) = wall_mesh(shape);
    let bvh = Bvh::build(&mesh);
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    traced_bounce(texels.len(), rays, |receiver, local| {
        let (face, point) = texels[receiver];
        if shape.is_in_hole(face, point) {
            return None;
        }
        let start = (point - face.outward() * RAY_OFFSET).as_vec3();
        let direction = around_normal(face, local).as_vec3();
        let hit = bvh.closest_hit(start, direction, f32::MAX)?;
        let wall = walls[hit.triangle as usize / 2];
        let at = (start + direction * hit.t).as_dvec3();
        // A ray that meets a hole leaves the block.
        if shape.is_in_hole(wall, at) {
            return None;
        }
        texel_at(shape, wall, at, resolution)
    })
}

/// Estimates F (texels x texels, one value a texel) of a tube with `rays` rays from each texel centre.
pub fn ray_traced_tube_bounce(wall: &TubeWall, rays: u32) -> Matrix<f64> {
    traced_bounce(wall.texels.len(), rays, |receiver, local| {
        let center = &wall.texels[receiver].center;
        let hit = wall
            .form
            .first_hit(center.position, direction_around(center, local));
        match hit.opening {
            None => Some(wall.texel_at(hit.point)),
            Some(_) => None,
        }
    })
}

/// The share of each texel's rays that end on each other texel. `end(texel, direction)` says where a ray ends that
/// leaves a texel in a direction around +z.
fn traced_bounce(
    texels: usize,
    rays: u32,
    end: impl Fn(usize, DVec3) -> Option<usize> + Sync,
) -> Matrix<f64> {
    let rows: Vec<Vec<f64>> = (0..texels)
        .into_par_iter()
        .map(|receiver| {
            let mut row = vec![0.0; texels];
            for ray in 0..rays {
                let square = square_from_unit(sobol_point(ray, receiver as u32));
                let local = cosine_hemisphere_from_square(square);
                if let Some(texel) = end(receiver, local) {
                    row[texel] += 1.0;
                }
            }
            row.iter_mut().for_each(|count| *count /= f64::from(rays));
            row
        })
        .collect();
    Matrix::from_fn(texels, texels, |i, j| rows[i][j])
}

/// Two triangles for each wall, and the list of the walls.
fn wall_mesh(shape: &Shape) -> (TriangleMesh, Vec<Face>) {
    let walls: Vec<Face> = shape.walls().collect();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for face in &walls {
        let first = positions.len() as u32;
        let corners = face.rectangle([0.0, 1.0], [0.0, 1.0]);
        positions.extend(corners.map(|corner| corner.as_vec3()));
        triangles.push([first, first + 1, first + 2]);
        triangles.push([first, first + 2, first + 3]);
    }
    (TriangleMesh::from_triangles(positions, triangles), walls)
}

/// The direction that stands to the inward normal of a wall as `local` stands to +z.
fn around_normal(face: Face, local: DVec3) -> DVec3 {
    let mut direction = -face.outward() * local.z;
    direction[face.u_axis()] = local.x;
    direction[face.v_axis()] = local.y;
    direction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce, restrict_to_shape};
    use crate::modular::one_bounce::tube::{Parts, tube_bounce};
    use crate::progress::Progress;
    use mrt_core::geometry::tube::TubeForm;
    use mrt_runtime::low_level::level::shape::cubes;

    #[test]
    fn rays_agree_with_the_closed_form_of_cubes() {
        const RESOLUTION: usize = 4;
        const RAYS: u32 = 4096;
        let closed = closed_cube_bounce(RESOLUTION, Reconstruction::Constant, &Progress::silent())
            .expect("nobody cancels");
        for shape in cubes() {
            let exact = restrict_to_shape(&closed, shape, RESOLUTION);
            let traced = ray_traced_bounce(shape, RESOLUTION, RAYS);
            for (t, e) in traced.data().iter().zip(exact.data()) {
                // Six standard errors of independent rays, for fewer than 10⁴ elements; these points are
                // better distributed. One ray is the grain of the estimate.
                let bound = 6.0 * (e / f64::from(RAYS)).sqrt() + 1.0 / f64::from(RAYS);
                assert!((t - e).abs() <= bound, "{}: {t} against {e}", shape.name);
            }
            for i in 0..traced.rows() {
                let sum = |m: &Matrix<f64>| (0..m.columns()).map(|j| m[(i, j)]).sum::<f64>();
                // The fraction that leaves through openings has a standard error of at most 1/2 over the root of
                // the number of rays.
                let bound = 6.0 * 0.5 / f64::from(RAYS).sqrt();
                assert!((sum(&traced) - sum(&exact)).abs() <= bound);
            }
        }
    }

    #[test]
    fn rays_agree_with_the_quadrature_of_tubes() {
        const RAYS: u32 = 4096;
        for form in TubeForm::ALL {
            let wall = TubeWall::new(form, 4);
            let parts = Parts { far: 8, near: 16 };
            let summed = tube_bounce(&wall, parts, &Progress::silent()).expect("nobody cancels");
            let traced = ray_traced_tube_bounce(&wall, RAYS);
            for (t, e) in traced.data().iter().zip(summed.data()) {
                // As for cubes: six standard errors, and a grain of one ray.
                let bound = 6.0 * (e / f64::from(RAYS)).sqrt() + 1.0 / f64::from(RAYS);
                assert!((t - e).abs() <= bound, "{form:?}: {t} against {e}");
            }
        }
    }
}
