//! What the walls of a warped block send to its probes, and the directions of what its own walls receive (Loos et
//! al. 2011, section 6.5, on the warped shapes of section 6.2).

use crate::modular::one_bounce::warped::WarpedWalls;
use crate::modular::outputs::cube::{SH9, sh_of_unit_radiosity, vector_of_unit_radiosity};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::polygon_moments::{Moments, polygon_moments};
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;

/// Incident radiance at points, 9 coefficients a point x signals, from the radiosity of the walls' texels (texels
/// x signals), in the axes of the warp's coordinates. Holes do not send: their radiosity must be zero.
///
/// Cost: the moments of a polygon for each pair of point and texel, 64 x 1,536 of 0.3 µs for a closed block.
pub fn warped_probe_light(
    walls: &WarpedWalls,
    points: &[DVec3],
    radiosity: &Matrix<f64>,
) -> Matrix<f64> {
    let texels = TexelLoops::new(walls);
    let by_texel = radiosity.transposed();
    let signals = radiosity.columns();
    let rows: Vec<Vec<f64>> = points
        .par_iter()
        .map(|&point| {
            let mut rows = vec![0.0; SH9 * signals];
            for texel in 0..walls.texel_count() {
                let sh = sh_of_unit_radiosity(&texels.moments(texel, point));
                add(&mut rows, &sh, by_texel.column(texel));
            }
            rows
        })
        .collect();
    Matrix::from_fn(SH9 * points.len(), signals, |i, j| {
        rows[i / SH9][i % SH9 * signals + j]
    })
}

/// Vector irradiance on warped walls, 4 texels x signals, from the radiosity of their texels (texels x signals),
/// in the axes of [`warped_texel_axes`].
pub fn warped_vector_irradiance(walls: &WarpedWalls, radiosity: &Matrix<f64>) -> Matrix<f64> {
    let texels = TexelLoops::new(walls);
    let by_texel = radiosity.transposed();
    let signals = radiosity.columns();
    let per_wall = walls.resolution * walls.resolution;
    let rows: Vec<Vec<f64>> = (0..walls.texel_count())
        .into_par_iter()
        .map(|receiver| {
            let axes = warped_texel_axes(walls, receiver);
            let mut rows = vec![0.0; 4 * signals];
            for texel in 0..walls.texel_count() {
                if texel / per_wall != receiver / per_wall {
                    let moments = texels.moments(texel, walls.centers[receiver]);
                    let weights = vector_of_unit_radiosity(&moments, &axes);
                    add(&mut rows, &weights, by_texel.column(texel));
                }
            }
            rows
        })
        .collect();
    Matrix::from_fn(4 * walls.texel_count(), signals, |i, j| {
        rows[i / 4][i % 4 * signals + j]
    })
}

/// Along u; along v as far as that is across u; along the normal. Unit vectors.
pub fn warped_texel_axes(walls: &WarpedWalls, texel: usize) -> [DVec3; 3] {
    let per_wall = walls.resolution * walls.resolution;
    let face = walls.faces[texel / per_wall];
    let k = texel % per_wall;
    let unit = face.texel_center(walls.resolution, k / walls.resolution, k % walls.resolution);
    let jacobian = walls.warp.jacobian(unit);
    let normal = walls.normals[texel];
    let tangent = |axis: usize| jacobian.col(axis).reject_from(normal);
    let u = tangent(face.u_axis()).normalize();
    let v = tangent(face.v_axis()).reject_from(u).normalize();
    [u, v, normal]
}

/// `rows[k] += weights[k] * signals`, rows one after the other.
fn add(rows: &mut [f64], weights: &[f64], signals: &[f64]) {
    for (row, weight) in rows.chunks_exact_mut(signals.len().max(1)).zip(weights) {
        for (sum, x) in row.iter_mut().zip(signals) {
            *sum += weight * x;
        }
    }
}

/// The images of texels as planar polygons: two triangles where a face is bent.
struct TexelLoops {
    corners: Vec<[DVec3; 4]>,
    is_planar: Vec<bool>,
}

/// Fraction of a texel's diagonal by which its corners may miss a plane and count as lying in it.
const PLANAR: f64 = 1e-9;

impl TexelLoops {
    fn new(walls: &WarpedWalls) -> Self {
        let half = 0.5 / walls.resolution as f64;
        let corners: Vec<[DVec3; 4]> = walls
            .unit_texels()
            .map(|(face, c): (Face, DVec3)| {
                let (u, v) = (c[face.u_axis()], c[face.v_axis()]);
                face.rectangle([u - half, u + half], [v - half, v + half])
                    .map(|unit| walls.warp.point(unit))
            })
            .collect();
        let is_planar = corners
            .iter()
            .map(|[a, b, c, d]| {
                let across = (*c - *a).cross(*d - *b);
                let size = (*c - *a).length();
                (*b - *a).dot(across).abs() <= PLANAR * size * across.length()
            })
            .collect();
        Self { corners, is_planar }
    }

    fn moments(&self, texel: usize, point: DVec3) -> Moments {
        let [a, b, c, d] = self.corners[texel];
        if self.is_planar[texel] {
            return polygon_moments(point, &[a, b, c, d]);
        }
        let mut sum = polygon_moments(point, &[a, b, c]);
        sum.add(&polygon_moments(point, &[a, c, d]), 1.0);
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::outputs::cube::{
        probe_operator, probe_points, texel_axes, vector_irradiance,
    };
    use mrt_core::geometry::hexahedron::Hexahedron;
    use mrt_core::linalg::matrix::multiply;
    use mrt_runtime::blocks::Shape;

    #[test]
    fn on_the_cube_they_are_the_canonical_outputs() {
        let shape = Shape::from_name("straight").expect("a shape");
        let faces: Vec<Face> = shape.walls().collect();
        let walls = WarpedWalls::new(&faces, 4, &Hexahedron::cell(DVec3::ZERO));
        let radiosity = Matrix::from_fn(walls.texel_count(), 3, |i, j| ((7 * i + j) % 5) as f64);
        let points: Vec<DVec3> = probe_points(2).collect();
        let found = warped_probe_light(&walls, &points, &radiosity);
        let expected = multiply(probe_operator(shape, 4, 2).view(), radiosity.view());
        let vector = warped_vector_irradiance(&walls, &radiosity);
        let expected_vector = vector_irradiance(shape, 4, &radiosity);
        // Sums of 64 texels.
        for (a, b) in [(found, expected), (vector, expected_vector)] {
            assert_eq!(a.rows(), b.rows());
            for (a, b) in a.data().iter().zip(b.data()) {
                assert!((a - b).abs() < 1e-12, "{a} against {b}");
            }
        }
        assert_eq!(warped_texel_axes(&walls, 0), texel_axes(faces[0]));
    }
}
