//! Irradiance as a function of the normal in four coefficients, for surfaces whose normal varies within a
//! texel: linear spherical harmonics, optimal for the normals around that of the surface.
//!
//! Source: B. Loos et al., "Modular Radiance Transfer", 2011, section 6.4 and appendix B (OHLSH).
//! Irradiance is nearly quadratic in the normal. [`ohlsh_from_sh9`] replaces its nine coefficients by four
//! whose function is nearest to theirs over the hemisphere. Truncating the nine to four would be optimal
//! over the whole sphere, half of which no normal points to.
//!
//! [`ohlsh_from_moments`] departs from that in three ways. It fits the normals within 60 degrees. It fits
//! irradiance itself instead of its first three bands, knowing that no light comes from below the surface.
//! And it is exact for the surface's own normal.
//!
//! All directions are in the frame of the surface, whose normal is +z. The coefficients belong to the first
//! four functions of [`sh`]: 1, y, z, x. They have the unit of irradiance.
//!
//! The table gives errors on a wall of a cube whose other walls emit, in percent, as measured by the test
//! below. They are relative L2 errors over the normals within 60 degrees: mean and worst over 36 points of
//! the wall and five lightings of a kind. Kinds of lighting: one wall alone; all walls, with brightness
//! from 1 to 100 and gradients; one wall, with a quarter of its brightness on the others. The last column
//! is over these and a fourth kind: 1 to 100 without gradients.
//!
//! | coefficients | one wall | 1 to 100 | one and 1/4 | all |
//! | --- | --- | --- | --- | --- |
//! | linear harmonics, truncated | 20.3, 25.2 | 12.3, 20.8 | 7.9, 9.5 | 13.0, 25.2 |
//! | [`ohlsh_from_sh9`] | 10.7, 16.7 | 6.7, 12.4 | 4.1, 5.2 | 6.9, 16.7 |
//! | [`ohlsh_from_moments`] | 7.3, 14.0 | 4.2, 10.7 | 2.7, 3.8 | 4.6, 14.0 |
//! | nearest linear function | 7.2, 14.0 | 4.2, 10.6 | 2.7, 3.8 | 4.5, 14.0 |
//! | nine of irradiance | 2.1, 3.8 | 1.1, 2.8 | 0.8, 1.0 | 1.2, 3.8 |
//!
//! So no four linear coefficients stay within 3 % where one wall outshines the others. About half of the
//! remaining error is curvature in xy and x² - y².

use crate::geometry::polygon_moments::Moments;
use crate::lighting::sh;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Slope of irradiance along z, as a polynomial 1, z, z² of the direction that the light comes from.
const SLOPE_ALONG_NORMAL: [f64; 3] = [-0.724_885_4, 2.334_805_2, -0.577_551_8];

/// Slope along x divided by x, as a polynomial 1, z of the direction that the light comes from.
const SLOPE_ACROSS: [f64; 2] = [0.512_249_7, 0.609_844_3];

/// The four coefficients from the nine of irradiance as a function of the normal (order 3 of [`sh`]), by
/// least squares over the hemisphere of normals z > 0. Appendix B of the paper.
pub fn ohlsh_from_sh9(irradiance: &[f64; 9]) -> [f64; 4] {
    let b = irradiance;
    // Over the hemisphere the nearest linear function to 3z² - 1 is 3z - 3/2, and those to yz and xz are
    // 3/8 of y and x; xy and x² - y² are orthogonal to all linear functions.
    let (root_5, root_15) = (5f64.sqrt(), 15f64.sqrt());
    [
        b[0] - 0.75 * root_5 * b[6],
        b[1] + 0.375 * root_5 * b[5],
        b[2] + 0.5 * root_15 * b[6],
        b[3] + 0.375 * root_5 * b[7],
    ]
}

/// The four coefficients from the moments of the incident radiance in the frame of the surface, by least
/// squares over the normals within 60 degrees. Exact for the normal +z. Not from the paper.
///
/// All light must come from z >= 0. With M the first moment, E(n) is
/// `Mz + S (nz - 1) + Tx nx + Ty ny`. The slopes S and T are those that fit the clamped cosine of a single
/// light best. As functions of the light's direction they are themselves fitted over the hemisphere, by
/// functions that the moments can integrate: S by 1, z, z²; Tx by x, xz; Ty by y, yz.
pub fn ohlsh_from_moments(local: &Moments) -> [f64; 4] {
    let [_, _, zz, _, yz, zx] = local.second;
    let DVec3 { x, y, z } = local.first;
    let [s0, s1, s2] = SLOPE_ALONG_NORMAL;
    let [t0, t1] = SLOPE_ACROSS;
    let along = s0 * local.solid_angle + s1 * z + s2 * zz;
    let constant = (4.0 * PI).sqrt();
    let linear = (4.0 * PI / 3.0).sqrt();
    [
        constant * (z - along),
        linear * (t0 * y + t1 * yz),
        linear * along,
        linear * (t0 * x + t1 * zx),
    ]
}

/// The nine coefficients of irradiance as a function of the normal (order 3 of [`sh`]), from the moments of
/// the incident radiance. `axes` are the orthonormal x, y and z of the surface's frame, in the frame of the
/// moments.
///
/// Radiance 1 from everywhere gives the irradiance π.
pub fn local_irradiance_sh(radiance: &Moments, axes: &[DVec3; 3]) -> [f64; 9] {
    let mut coefficients = radiance.in_frame(axes).sh9();
    sh::irradiance_from_radiance(&mut coefficients);
    coefficients
}

/// Irradiance on a unit `normal` in the frame of the surface. It may be slightly negative.
pub fn evaluate(coefficients: &[f64; 4], normal: DVec3) -> f64 {
    sh::value(coefficients, normal)
}

/// [`evaluate`] for `f32`: computed in `f64` and rounded once.
pub fn evaluate_f32(coefficients: &[f32; 4], normal: Vec3) -> f32 {
    sh::value(coefficients, normal.as_dvec3()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cube::Face;
    use crate::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
    use crate::geometry::polygon_moments::polygon_moments;

    const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

    /// Midpoints of cells of equal solid angle, with z from `lowest` to 1.
    fn directions(lowest: f64, rings: usize, azimuths: usize) -> Vec<DVec3> {
        let mut points = Vec::new();
        for ring in 0..rings {
            let z = lowest + (1.0 - lowest) * (ring as f64 + 0.5) / rings as f64;
            let r = (1.0 - z * z).sqrt();
            for step in 0..azimuths {
                let a = 2.0 * PI * (step as f64 + 0.5) / azimuths as f64;
                points.push(DVec3::new(r * a.cos(), r * a.sin(), z));
            }
        }
        points
    }

    /// The linear function nearest to the values at `normals`, which are symmetric about z.
    fn nearest_linear(normals: &[DVec3], values: &[f64]) -> [f64; 4] {
        let sum = |f: &dyn Fn(DVec3, f64) -> f64| -> f64 {
            normals.iter().zip(values).map(|(&n, &v)| f(n, v)).sum()
        };
        let count = normals.len() as f64;
        let (mean, mean_z) = (sum(&|_, v| v) / count, sum(&|n, _| n.z) / count);
        let z = sum(&|n, v| (n.z - mean_z) * (v - mean)) / sum(&|n, _| (n.z - mean_z).powi(2));
        let y = sum(&|n, v| n.y * v) / sum(&|n, _| n.y * n.y);
        let x = sum(&|n, v| n.x * v) / sum(&|n, _| n.x * n.x);
        let (constant, linear) = ((4.0 * PI).sqrt(), (4.0 * PI / 3.0).sqrt());
        [
            constant * (mean - z * mean_z),
            linear * y,
            linear * z,
            linear * x,
        ]
    }

    #[test]
    fn appendix_b_solves_the_least_squares_over_the_hemisphere() {
        let normals = directions(0.0, 400, 16);
        for k in 0..9 {
            let mut unit = [0.0; 9];
            unit[k] = 1.0;
            let values: Vec<f64> = normals.iter().map(|&n| sh::value(&unit, n)).collect();
            let expected = nearest_linear(&normals, &values);
            for (a, b) in ohlsh_from_sh9(&unit).iter().zip(expected) {
                // 400 midpoints in z leave 1 / 400² times a few.
                assert!((a - b).abs() < 2e-5, "{k}: {a} and {b}");
            }
        }
    }

    #[test]
    fn the_slopes_solve_their_least_squares() {
        // The residual of a fit is orthogonal to each of its functions.
        let normals = directions(0.5, 60, 120);
        let lights = directions(0.0, 60, 1);
        let mut residuals = [0.0; 5];
        for d in &lights {
            let clamped: Vec<f64> = normals.iter().map(|n| n.dot(*d).max(0.0)).collect();
            let slope = |f: &dyn Fn(DVec3) -> f64, offset: f64| {
                let pairs = || normals.iter().zip(&clamped);
                let product: f64 = pairs().map(|(&n, c)| f(n) * (c - offset)).sum();
                product / pairs().map(|(&n, _)| f(n) * f(n)).sum::<f64>()
            };
            let a = ohlsh_from_moments(&Moments::of_direction(*d));
            let linear = (0.75 / PI).sqrt();
            let across = d.truncate().length();
            let toward = |n: DVec3| (n.x * d.x + n.y * d.y) / across;
            let along_residual = slope(&|n| n.z - 1.0, d.z) - a[2] * linear;
            let got_across = (a[3] * d.x + a[1] * d.y) / across * linear;
            let across_residual = (slope(&toward, 0.0) - got_across) * across;
            for (k, power) in [1.0, d.z, d.z * d.z].into_iter().enumerate() {
                residuals[k] += along_residual * power / lights.len() as f64;
            }
            residuals[3] += across_residual / lights.len() as f64;
            residuals[4] += across_residual * d.z / lights.len() as f64;
        }
        // What 60 midpoints leave.
        assert!(residuals.iter().all(|r| r.abs() < 2e-4), "{residuals:?}");
    }

    #[test]
    fn the_fit_of_the_cone_is_exact_at_the_surface_normal() {
        for d in directions(0.0, 7, 5) {
            let a = ohlsh_from_moments(&Moments::of_direction(d));
            assert!((evaluate(&a, DVec3::Z) - d.z).abs() < 1e-14);
        }
        let narrow = [0.7f32, -0.2, 0.4, 0.1];
        let normal = Vec3::new(0.48, 0.6, 0.64);
        let wide = evaluate(&narrow.map(f64::from), normal.as_dvec3());
        assert!((f64::from(evaluate_f32(&narrow, normal)) - wide).abs() < 1e-7);
    }

    #[test]
    fn uniform_radiance_gives_pi_and_frames_agree_with_rotation() {
        let mut sphere = Moments::default();
        let mut lit = Moments::default();
        for (k, face) in Face::ALL.into_iter().enumerate() {
            let polygon = face.rectangle([0.0, 1.0], [0.0, 1.0]);
            let m = polygon_moments(DVec3::new(0.3, 0.6, 0.2), &polygon);
            sphere.add(&m, 1.0);
            lit.add(&m, k as f64);
        }
        let uniform = local_irradiance_sh(&sphere, &AXES);
        assert!((sh::value(&uniform, DVec3::new(0.48, 0.6, -0.64)) - PI).abs() < 1e-12);

        let axes = [
            DVec3::new(0.6, 0.8, 0.0),
            DVec3::new(-0.64, 0.48, 0.6),
            DVec3::new(0.48, -0.36, 0.8),
        ];
        let mut expected = local_irradiance_sh(&lit, &AXES);
        let to_local = glam::DMat3::from_cols_array_2d(&axes.map(|a| a.to_array())).transpose();
        sh::rotate(&sh::rotation_matrices(3, &to_local), &mut expected);
        for (a, b) in local_irradiance_sh(&lit, &axes).iter().zip(expected) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    /// Relative errors of one method.
    #[derive(Default)]
    struct Errors(Vec<f64>);

    impl Errors {
        /// Mean and worst, in percent.
        fn mean_and_worst(&self) -> [f64; 2] {
            let mean = self.0.iter().sum::<f64>() / self.0.len() as f64;
            let worst = self.0.iter().copied().fold(0.0, f64::max);
            [mean, worst].map(|error| 100.0 * error)
        }
    }

    const LIGHTINGS: usize = 20;

    /// Radiosity at (u, v) in [-1, 1]² of a wall, for a lighting of [`LIGHTINGS`]. Five each are of one
    /// kind: one bright wall; walls of very different brightness; the same with gradients; one bright wall
    /// with a quarter of its brightness on the others.
    fn radiosity(lighting: usize, wall: usize, u: f64, v: f64) -> f64 {
        let (kind, k) = (lighting / 5, lighting % 5);
        let bright = if wall == k { 1.0 } else { 0.0 };
        let spread = 10f64.powf(-2.0 * ((wall * (k + 2) + k) % 5) as f64 / 4.0);
        match kind {
            0 => bright,
            1 => spread,
            2 => spread * (1.0 + 0.5 * u * (k as f64 - 2.0) / 2.0 + 0.5 * v),
            _ => 0.25 + 0.75 * bright,
        }
    }

    /// What arrives at a point of the wall -z, for every lighting.
    struct Arriving {
        /// Exact irradiance for each normal.
        irradiance: Vec<Vec<f64>>,
        moments: [Moments; LIGHTINGS],
    }

    impl Arriving {
        /// From 6² patches of uniform radiosity on each of the other walls.
        fn at(point: DVec3, normals: &[DVec3]) -> Self {
            const PATCHES: usize = 6;
            let mut irradiance = vec![vec![0.0; normals.len()]; LIGHTINGS];
            let mut moments = [Moments::default(); LIGHTINGS];
            let mut scratch = Vec::new();
            let walls = Face::ALL.into_iter().filter(|&face| face != Face::NegZ);
            for (wall, face) in walls.enumerate() {
                for patch in 0..PATCHES * PATCHES {
                    let at = [patch % PATCHES, patch / PATCHES];
                    let [u, v] = at.map(|i| [i, i + 1].map(|i| i as f64 / PATCHES as f64));
                    let polygon = face.rectangle(u, v);
                    let [u, v] = [u, v].map(|[low, high]| low + high - 1.0);
                    let of_patch = polygon_moments(point, &polygon);
                    for (lighting, sum) in moments.iter_mut().enumerate() {
                        sum.add(&of_patch, radiosity(lighting, wall, u, v) / PI);
                    }
                    for (k, &normal) in normals.iter().enumerate() {
                        let mut above = polygon.to_vec();
                        let horizon = HalfSpace::through(point, normal);
                        clip_polygon(&mut above, &horizon, &mut scratch);
                        let factor = point_to_polygon(point, normal, &above);
                        for (lighting, values) in irradiance.iter_mut().enumerate() {
                            values[k] += radiosity(lighting, wall, u, v) * factor;
                        }
                    }
                }
            }
            Self {
                irradiance,
                moments,
            }
        }

        /// Relative errors for one lighting, in the order of the table's rows.
        fn errors(&self, normals: &[DVec3], lighting: usize) -> [f64; 5] {
            let values = &self.irradiance[lighting];
            let moments = &self.moments[lighting];
            let error = |approximate: &dyn Fn(DVec3) -> f64| {
                let square: f64 = normals
                    .iter()
                    .zip(values)
                    .map(|(&n, v)| (approximate(n) - v).powi(2))
                    .sum();
                (square / values.iter().map(|v| v * v).sum::<f64>()).sqrt()
            };
            let quadratic = local_irradiance_sh(moments, &AXES);
            let [b0, b1, b2, b3, ..] = quadratic;
            let [truncated, appendix_b, cone, nearest] = [
                [b0, b1, b2, b3],
                ohlsh_from_sh9(&quadratic),
                ohlsh_from_moments(moments),
                nearest_linear(normals, values),
            ]
            .map(|linear| error(&|n| evaluate(&linear, n)));
            [
                truncated,
                appendix_b,
                cone,
                nearest,
                error(&|n| sh::value(&quadratic, n)),
            ]
        }
    }

    #[test]
    fn errors_in_a_cube_are_those_of_the_table() {
        let normals = directions(0.5, 6, 16);
        let mut errors: [Errors; 5] = Default::default();
        for texel in 0..36 {
            let point = Face::NegZ.texel_center(6, texel / 6, texel % 6);
            let arriving = Arriving::at(point, &normals);
            for lighting in 0..LIGHTINGS {
                let found = arriving.errors(&normals, lighting);
                for (of_method, error) in errors.iter_mut().zip(found) {
                    of_method.0.push(error);
                }
            }
        }
        // The last column of the table.
        let table = [
            [13.0, 25.2],
            [6.9, 16.7],
            [4.6, 14.0],
            [4.5, 14.0],
            [1.2, 3.8],
        ];
        for (method, expected) in errors.iter().zip(table) {
            let measured = method.mean_and_worst();
            for (a, b) in measured.into_iter().zip(expected) {
                // Room for the rounding of the last digit.
                assert!((a - b).abs() < 0.06, "{measured:?} and {expected:?}");
            }
        }
    }
}
