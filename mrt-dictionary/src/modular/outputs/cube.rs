//! Light at the probes of a canonical cube and vector irradiance on its walls, from the radiosity of its walls.

use crate::matrix_parts::from_row_groups;
use crate::modular::outputs::polygon_light::{
    SH9, add_weighted, sh_of_unit_radiosity, vector_of_unit_radiosity,
};
use crate::modular::surface::probes::probe_points;
use crate::modular::surface::walls::cube::{texel_axes, texel_corners, wall_fraction};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::polygon_moments::polygon_moments;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::Shape;
use rayon::prelude::*;

/// Incident radiance at a shape's probes, 9 probes³ x texels, from the radiosity of its walls' texels.
///
/// Cost: one polygon's moments for each pair of probe and texel.
pub fn probe_operator(shape: &Shape, resolution: usize, probes: usize) -> Matrix<f64> {
    let points: Vec<DVec3> = probe_points(probes).collect();
    let texels: Vec<([DVec3; 4], f64)> = shape
        .texels(resolution)
        .map(|(face, center)| {
            let corners = texel_corners(face, center, resolution);
            (corners, wall_fraction(shape, face, center, resolution))
        })
        .collect();
    let columns: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|(corners, fraction)| {
            let light = points.iter().flat_map(|&point| {
                let sh = sh_of_unit_radiosity(&polygon_moments(point, corners));
                sh.map(|x| fraction * x)
            });
            light.collect()
        })
        .collect();
    Matrix::from_columns(SH9 * points.len(), &columns)
}

/// Vector irradiance on a shape's walls, 4 texels x signals, from the radiosity of their texels (texels x
/// signals), in each texel's axes ([`texel_axes`]). A wall receives from the other walls only, and texels in holes
/// receive nothing.
///
/// Cost: one polygon's moments, and four multiply-adds a signal, for each pair of texels.
pub fn vector_irradiance(shape: &Shape, resolution: usize, radiosity: &Matrix<f64>) -> Matrix<f64> {
    let by_texel = radiosity.transposed();
    let signals = radiosity.columns();
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    let rows: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|&(wall, point)| {
            let axes = texel_axes(wall);
            let mut rows = vec![0.0; 4 * signals];
            if shape.is_in_hole(wall, point) {
                return rows;
            }
            for (source, &(face, center)) in texels.iter().enumerate() {
                if face == wall {
                    continue;
                }
                let polygon = texel_corners(face, center, resolution);
                let weights = vector_of_unit_radiosity(&polygon_moments(point, &polygon), &axes);
                let fraction = wall_fraction(shape, face, center, resolution);
                let weights = weights.map(|weight| weight * fraction);
                add_weighted(&mut rows, &weights, by_texel.column(source));
            }
            rows
        })
        .collect();
    from_row_groups(&rows, 4, signals)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_closed_room_of_even_light_looks_the_same_from_every_probe() {
        let shape = Shape::from_name("closed").expect("a shape");
        let operator = probe_operator(shape, 4, 2);
        for i in 0..operator.rows() {
            let sum: f64 = (0..operator.columns()).map(|j| operator[(i, j)]).sum();
            // Radiosity one is radiance 1/π, and the constant function integrates to 2 √π.
            let expected = if i % SH9 == 0 {
                2.0 * PI.sqrt() / PI
            } else {
                0.0
            };
            assert!((sum - expected).abs() < 1e-12, "row {i}: {sum}");
        }
    }
}
