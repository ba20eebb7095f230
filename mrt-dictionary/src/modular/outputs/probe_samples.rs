//! Light at probes as samples in [`DIRECTIONS`], weighted so that samples and SH coefficients have the same norm.

use crate::modular::outputs::polygon_light::SH9;
use crate::modular::surface::probes::{DIRECTIONS, lebedev_weight};
use glam::DVec3;
use mrt_core::lighting::sh;
use mrt_core::linalg::matrix::Matrix;

/// Weight of a probe's values against a texel's irradiance where a basis is chosen for the light of other blocks.
///
/// This and [`OWN_PROBE_WEIGHT`] were tuned on the reference files: without probes, modes for the walls err by 9 % at
/// probes, and with larger weights the light on the walls of the next blocks gets worse.
pub const PROBE_WEIGHT: f64 = 0.15;

/// Weight of a probe's values against a texel's irradiance where a shape's own modes are chosen.
pub const OWN_PROBE_WEIGHT: f64 = 0.3;

/// Converts between SH coefficients and samples of probes.
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
        apply_to_probes(sh, [DIRECTIONS.len(), SH9], |out, k| {
            weight * self.samples_from_sh[(out, k)]
        })
    }

    /// Rows of coefficients (9 a probe) from rows of samples that were given `weight` (26 a probe).
    pub fn to_sh(&self, samples: &Matrix<f64>, weight: f64) -> Matrix<f64> {
        apply_to_probes(samples, [SH9, DIRECTIONS.len()], |out, k| {
            self.samples_from_sh[(k, out)] / weight
        })
    }
}

/// Applies an `outputs` x `inputs` matrix to the rows of each probe.
fn apply_to_probes(
    rows: &Matrix<f64>,
    [outputs, inputs]: [usize; 2],
    element: impl Fn(usize, usize) -> f64,
) -> Matrix<f64> {
    let probes = rows.rows() / inputs;
    let by_output: Vec<f64> = (0..outputs * inputs)
        .map(|k| element(k / inputs, k % inputs))
        .collect();
    let mut out = Matrix::zeros(probes * outputs, rows.columns());
    for j in 0..rows.columns() {
        let column = rows.column(j);
        let out = &mut out.data_mut()[j * probes * outputs..][..probes * outputs];
        for (input, output) in column
            .chunks_exact(inputs)
            .zip(out.chunks_exact_mut(outputs))
        {
            for (value, weights) in output.iter_mut().zip(by_output.chunks_exact(inputs)) {
                *value = weights.iter().zip(input).map(|(w, x)| w * x).sum();
            }
        }
    }
    out
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
}
