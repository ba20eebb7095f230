//! The one-bounce operator by ray tracing, as the paper computes it (section 7.1): the second
//! implementation beside the closed form of [`crate::modular::one_bounce::cube`], and the one for shapes that are not convex.

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

/// Estimates F (texels x texels, constant texels) of a shape with `rays` importance-sampled gather rays
/// from each texel centre.
///
/// Rays are cosine-weighted Owen-scrambled Sobol' points with a scramble of their own for each texel, so
/// the result is the same on every run. The standard error of an element f is at most sqrt(f / rays).
pub fn ray_traced_bounce(shape: &Shape, resolution: usize, rays: u32) -> Matrix<f64> {
    let (mesh, walls) = wall_mesh(shape);
    let bvh = Bvh::build(&mesh);
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    let rows: Vec<Vec<f64>> = texels
        .par_iter()
        .enumerate()
        .map(|(index, &(face, point))| {
            let mut row = vec![0.0; texels.len()];
            if shape.is_in_hole(face, point) {
                return row;
            }
            let normal = -face.outward();
            let start = (point + normal * RAY_OFFSET).as_vec3();
            for ray in 0..rays {
                let square = square_from_unit(sobol_point(ray, index as u32));
                let local = cosine_hemisphere_from_square(square);
                let direction = around_normal(face, local).as_vec3();
                let Some(hit) = bvh.closest_hit(start, direction, f32::MAX) else {
                    continue;
                };
                let wall = walls[hit.triangle as usize / 2];
                let at = (start + direction * hit.t).as_dvec3();
                // What meets a hole leaves.
                let offset = shape.wall_offset(wall, resolution);
                if let Some(offset) = offset.filter(|_| !shape.is_in_hole(wall, at)) {
                    row[offset + wall.texel_index(at, resolution)] += 1.0;
                }
            }
            row.iter_mut().for_each(|count| *count /= f64::from(rays));
            row
        })
        .collect();
    Matrix::from_fn(texels.len(), texels.len(), |i, j| rows[i][j])
}

/// Two triangles a wall, and the wall of each pair.
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

/// A direction around +z turned to the inward normal of a wall.
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
    use crate::progress::Progress;
    use mrt_runtime::low_level::level::shape::cubes;

    #[test]
    fn rays_agree_with_the_closed_form() {
        const RESOLUTION: usize = 4;
        const RAYS: u32 = 4096;
        let closed = closed_cube_bounce(RESOLUTION, Reconstruction::Constant, &Progress::silent())
            .expect("nobody cancels");
        for shape in cubes() {
            let exact = restrict_to_shape(&closed, shape, RESOLUTION);
            let traced = ray_traced_bounce(shape, RESOLUTION, RAYS);
            for (t, e) in traced.data().iter().zip(exact.data()) {
                // Six standard errors of independent rays, over under 10⁴ elements; the points are
                // better distributed than that. One ray is the grain of the estimate.
                let bound = 6.0 * (e / f64::from(RAYS)).sqrt() + 1.0 / f64::from(RAYS);
                assert!((t - e).abs() <= bound, "{}: {t} against {e}", shape.name);
            }
            for i in 0..traced.rows() {
                let sum = |m: &Matrix<f64>| (0..m.columns()).map(|j| m[(i, j)]).sum::<f64>();
                // What leaves through the openings is a fraction known to a standard error of at most
                // 1/2 over the root of the rays.
                let bound = 6.0 * 0.5 / f64::from(RAYS).sqrt();
                assert!((sum(&traced) - sum(&exact)).abs() <= bound);
            }
        }
    }
}
