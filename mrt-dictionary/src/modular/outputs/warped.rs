//! Light at the probes of a warped block and vector irradiance on its walls, from the radiosity of its walls (Loos et
//! al. 2011, section 6.5, on the warped shapes of section 6.2).

use crate::matrix_parts::from_row_groups;
use crate::modular::outputs::polygon_light::{
    SH9, add_weighted, sh_of_unit_radiosity, vector_of_unit_radiosity,
};
use crate::modular::surface::walls::cube::texel_corners;
use crate::modular::surface::walls::warped::WarpedWalls;
use glam::DVec3;
use mrt_core::geometry::polygon_moments::{Moments, polygon_moments};
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;

/// Incident radiance at points, 9 points x signals, from the radiosity of the walls' texels (texels
/// x signals), in the axes of the warp's coordinates. Holes do not send: their radiosity must be zero.
///
/// Cost: one polygon's moments for each pair of point and texel, 64 x 1,536 of 0.3 µs for a closed block at 16².
pub fn warped_probe_light(
    walls: &WarpedWalls,
    points: &[DVec3],
    radiosity: &Matrix<f64>,
) -> Matrix<f64> {
    let texels = TexelPolygons::new(walls);
    let by_texel = radiosity.transposed();
    let signals = radiosity.columns();
    let rows: Vec<Vec<f64>> = points
        .par_iter()
        .map(|&point| {
            let mut rows = vec![0.0; SH9 * signals];
            for texel in 0..walls.texel_count() {
                let sh = sh_of_unit_radiosity(&texels.moments(texel, point));
                add_weighted(&mut rows, &sh, by_texel.column(texel));
            }
            rows
        })
        .collect();
    from_row_groups(&rows, SH9, signals)
}

/// Vector irradiance on warped walls, 4 texels x signals, from the radiosity of their texels (texels x signals),
/// in the axes of [`WarpedWalls::texel_axes`]. A wall receives from the other walls only.
pub fn warped_vector_irradiance(walls: &WarpedWalls, radiosity: &Matrix<f64>) -> Matrix<f64> {
    let texels = TexelPolygons::new(walls);
    let by_texel = radiosity.transposed();
    let signals = radiosity.columns();
    let per_wall = walls.resolution * walls.resolution;
    let rows: Vec<Vec<f64>> = (0..walls.texel_count())
        .into_par_iter()
        .map(|receiver| {
            let axes = walls.texel_axes(receiver);
            let mut rows = vec![0.0; 4 * signals];
            for texel in 0..walls.texel_count() {
                if texel / per_wall != receiver / per_wall {
                    let moments = texels.moments(texel, walls.centers[receiver]);
                    let weights = vector_of_unit_radiosity(&moments, &axes);
                    add_weighted(&mut rows, &weights, by_texel.column(texel));
                }
            }
            rows
        })
        .collect();
    from_row_groups(&rows, 4, signals)
}

/// The images of texels as planar polygons: one quadrilateral each, or two triangles where a face is bent.
struct TexelPolygons {
    corners: Vec<[DVec3; 4]>,
    is_planar: Vec<bool>,
}

/// Fraction of a texel's diagonal by which its corners may miss a plane and still count as lying in it.
const PLANAR: f64 = 1e-9;

impl TexelPolygons {
    fn new(walls: &WarpedWalls) -> Self {
        let corners: Vec<[DVec3; 4]> = walls
            .unit_texels()
            .map(|(face, center)| {
                let corners = texel_corners(face, center, walls.resolution);
                corners.map(|unit| walls.warp.point(unit))
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
    use crate::modular::outputs::cube::{probe_operator, vector_irradiance};
    use crate::modular::surface::probes::probe_points;
    use crate::modular::surface::walls::cube::texel_axes;
    use mrt_core::geometry::cube::Face;
    use mrt_core::geometry::hexahedron::Hexahedron;
    use mrt_core::linalg::matrix::multiply;
    use mrt_runtime::blocks::Shape;

    #[test]
    fn an_unwarped_block_has_the_outputs_of_the_cube() {
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
        assert_eq!(walls.texel_axes(0), texel_axes(faces[0]));
    }
}
