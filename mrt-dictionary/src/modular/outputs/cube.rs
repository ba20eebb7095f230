//! What a basis has to hold besides the irradiance of walls: the light at probes (Loos et al. 2011, section 6.5).
//!
//! A probe stores nine SH coefficients of incident radiance. Bases are computed with its values in
//! [`DIRECTIONS`] instead, weighted so that both have the same norm: a mirror exchanges directions, where it would
//! change signs of coefficients, so texels and probes fold into parity classes alike.

use crate::modular::one_bounce::cube::wall_fraction;
use glam::{DVec3, IVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::polygon_moments::{Moments, polygon_moments};
use mrt_core::lighting::hemisphere_sh::ohlsh_from_moments;
use mrt_core::lighting::sh;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::Shape;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Weight of a probe's values against a texel's irradiance where a basis is chosen for light that is already
/// given: that of other blocks.
pub const PROBE_WEIGHT: f64 = 0.15;

/// The same where a shape's modes are chosen. Both were tuned on the reference files: without probes modes for the
/// walls err by 9 % there, and with heavier ones light on the walls of the next blocks pays for it.
pub const OWN_PROBE_WEIGHT: f64 = 0.3;

/// Coefficients of a probe.
pub const SH9: usize = 9;

/// The 26 directions to the faces, edges and corners of a cube: with Lebedev's weights they integrate polynomials
/// up to degree seven exactly, so also products of two functions of order 3.
pub static DIRECTIONS: [IVec3; 26] = directions();

const fn directions() -> [IVec3; 26] {
    let mut out = [IVec3::ZERO; 26];
    let (mut next, mut k) = (0, 0);
    while k < 27 {
        let d = IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if d.x != 0 || d.y != 0 || d.z != 0 {
            out[next] = d;
            next += 1;
        }
        k += 1;
    }
    out
}

/// Lebedev's weight of a direction on the sphere of area 4π.
fn lebedev_weight(direction: IVec3) -> f64 {
    let weight = match direction.length_squared() {
        1 => 1.0 / 21.0,
        2 => 4.0 / 105.0,
        _ => 9.0 / 280.0,
    };
    4.0 * PI * weight
}

/// Centres of the probes of a block: `per_axis`³, x fastest, then y, then z, at (i + 0.5) / per_axis.
pub fn probe_points(per_axis: usize) -> impl Iterator<Item = DVec3> {
    let center = move |k: usize| (k as f64 + 0.5) / per_axis as f64;
    (0..per_axis * per_axis * per_axis).map(move |k| {
        let (x, y, z) = (
            k % per_axis,
            k / per_axis % per_axis,
            k / per_axis / per_axis,
        );
        DVec3::new(center(x), center(y), center(z))
    })
}

/// Index of a probe's sample, in one of the [`DIRECTIONS`], among the samples of all `per_axis`³ probes of a block.
pub fn probe_sample(point: DVec3, direction: IVec3, per_axis: usize) -> usize {
    let cell = (point * per_axis as f64).floor().as_uvec3();
    let probe = (cell.z as usize * per_axis + cell.y as usize) * per_axis + cell.x as usize;
    // Place in the 3 x 3 x 3 neighbours of a cell, whose middle one is no direction.
    let place = ((direction.z + 1) * 3 + direction.y + 1) * 3 + direction.x + 1;
    let direction = if place > 13 { place - 1 } else { place };
    probe * DIRECTIONS.len() + direction as usize
}

/// Between coefficients and samples of probes.
#[derive(Clone, Debug)]
pub struct ProbeSamples {
    /// 26 x 9: samples, times the roots of their weights, from coefficients. Its transpose leads back.
    samples_from_sh: Matrix<f64>,
}

impl Default for ProbeSamples {
    fn default() -> Self {
        Self {
            samples_from_sh: Matrix::from_fn(DIRECTIONS.len(), SH9, |i, j| {
                let direction = DIRECTIONS[i].as_dvec3().normalize();
                sh_value(direction, j) * lebedev_weight(DIRECTIONS[i]).sqrt()
            }),
        }
    }
}

fn sh_value(direction: DVec3, index: usize) -> f64 {
    let mut values = [0.0; SH9];
    sh::evaluate(direction, &mut values);
    values[index]
}

impl ProbeSamples {
    /// Rows of samples (26 a probe, times `weight`) from rows of coefficients (9 a probe).
    pub fn from_sh(&self, sh: &Matrix<f64>, weight: f64) -> Matrix<f64> {
        self.apply(sh, SH9, DIRECTIONS.len(), |out, k| {
            weight * self.samples_from_sh[(out, k)]
        })
    }

    /// Rows of coefficients from rows of samples that were given `weight`.
    pub fn to_sh(&self, samples: &Matrix<f64>, weight: f64) -> Matrix<f64> {
        self.apply(samples, DIRECTIONS.len(), SH9, |out, k| {
            self.samples_from_sh[(k, out)] / weight
        })
    }

    fn apply(
        &self,
        rows: &Matrix<f64>,
        from: usize,
        to: usize,
        at: impl Fn(usize, usize) -> f64,
    ) -> Matrix<f64> {
        let probes = rows.rows() / from;
        let mut out = Matrix::zeros(probes * to, rows.columns());
        let small: Vec<f64> = (0..to * from).map(|k| at(k / from, k % from)).collect();
        for j in 0..rows.columns() {
            let column = rows.column(j);
            let out = &mut out.data_mut()[j * probes * to..][..probes * to];
            for (input, output) in column.chunks_exact(from).zip(out.chunks_exact_mut(to)) {
                for (value, weights) in output.iter_mut().zip(small.chunks_exact(from)) {
                    *value = weights.iter().zip(input).map(|(w, x)| w * x).sum();
                }
            }
        }
        out
    }
}

/// Incident radiance at a shape's probes, 9 probes³ x texels, from the radiosity of its walls' texels.
pub fn probe_operator(shape: &Shape, resolution: usize, probes: usize) -> Matrix<f64> {
    let points: Vec<DVec3> = probe_points(probes).collect();
    let step = 1.0 / resolution as f64;
    let half = 0.5 * step;
    let texels: Vec<([DVec3; 4], f64)> = shape
        .texels(resolution)
        .map(|(face, c)| {
            let (u, v) = (c[face.u_axis()], c[face.v_axis()]);
            let corners = face.rectangle([u - half, u + half], [v - half, v + half]);
            (corners, wall_fraction(shape, face, c, resolution))
        })
        .collect();
    let columns: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|(corners, fraction)| {
            points
                .iter()
                .flat_map(|&point| {
                    let sh = sh_of_unit_radiosity(&polygon_moments(point, corners));
                    sh.map(|x| fraction * x)
                })
                .collect()
        })
        .collect();
    Matrix::from_columns(SH9 * points.len(), &columns)
}

/// SH coefficients of incident radiance from a polygon of radiosity one.
pub fn sh_of_unit_radiosity(moments: &Moments) -> [f64; SH9] {
    moments.sh9().map(|x| x / PI)
}

/// Vector irradiance on a shape's walls, 4 texels x signals, from the radiosity of their texels (texels x
/// signals): the other walls' light, as the hemispherical coefficients of [`mrt_core::lighting::hemisphere_sh`] in each texel's axes
/// ([`texel_axes`]).
pub fn vector_irradiance(shape: &Shape, resolution: usize, radiosity: &Matrix<f64>) -> Matrix<f64> {
    let by_texel = radiosity.transposed();
    let signals = radiosity.columns();
    let half = 0.5 / resolution as f64;
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    let rows: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|&(wall, point)| {
            let axes = texel_axes(wall);
            let mut rows = vec![0.0; 4 * signals];
            if shape.is_in_hole(wall, point) {
                return rows;
            }
            for (source, &(face, c)) in texels.iter().enumerate() {
                if face == wall {
                    continue;
                }
                let (u, v) = (c[face.u_axis()], c[face.v_axis()]);
                let polygon = face.rectangle([u - half, u + half], [v - half, v + half]);
                let weights = vector_of_unit_radiosity(&polygon_moments(point, &polygon), &axes);
                let fraction = wall_fraction(shape, face, c, resolution);
                for (row, weight) in rows.chunks_exact_mut(signals.max(1)).zip(weights) {
                    for (sum, &x) in row.iter_mut().zip(by_texel.column(source)) {
                        *sum += weight * fraction * x;
                    }
                }
            }
            rows
        })
        .collect();
    Matrix::from_fn(4 * texels.len(), signals, |i, j| {
        rows[i / 4][i % 4 * signals + j]
    })
}

/// The frame in which a texel's vector irradiance is stored: along u, along v, along the normal.
pub fn texel_axes(face: Face) -> [DVec3; 3] {
    let axis = |k: usize| DVec3::AXES[k];
    [axis(face.u_axis()), axis(face.v_axis()), -face.outward()]
}

/// Vector irradiance from a polygon of radiosity one, in a texel's axes: coefficients of 1, v, normal, u.
pub fn vector_of_unit_radiosity(moments: &Moments, axes: &[DVec3; 3]) -> [f64; 4] {
    ohlsh_from_moments(&moments.in_frame(axes)).map(|x| x / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_keep_norms_and_lead_back() {
        let samples = ProbeSamples::default();
        let sh = Matrix::from_fn(2 * SH9, 3, |i, j| {
            f64::from((7 * i + 3 * j) as u32 % 11) - 5.0
        });
        let there = samples.from_sh(&sh, 0.5);
        // Sums of 26 products.
        assert!((there.frobenius_norm() - 0.5 * sh.frobenius_norm()).abs() < 1e-12);
        let back = samples.to_sh(&there, 0.5);
        for (a, b) in back.data().iter().zip(sh.data()) {
            assert!((a - b).abs() < 1e-12, "{a} against {b}");
        }
    }

    #[test]
    fn a_closed_room_of_even_light_is_the_same_from_everywhere() {
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
