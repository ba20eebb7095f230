//! Real spherical harmonics up to order five: evaluation, projection, rotation, and the step from radiance
//! to irradiance.
//!
//! Order n means the bands l = 0 .. n-1, which have n² functions. Function (l, m), with m from -l to l, has
//! index l² + l + m. The first nine are 1, y, z, x, xy, yz, 3z²-1, xz, x²-y², each with a positive factor,
//! since there is no Condon-Shortley sign. All functions are orthonormal over the sphere. Every function here
//! reads the order from the length of a slice: 1, 4, 9, 16 or 25.
//!
//! Sources: P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", 2008, appendix A1 (recurrences);
//! R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps", 2001,
//! equations 7 to 9 (irradiance); J. Ivanic and K. Ruedenberg, J. Phys. Chem. 1996, 100, 6342, with the
//! correction of 1998, 102, 9099 (rotation).

use crate::linalg::matrix::{Matrix, Real};
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::PI;

/// Highest order.
pub const MAX_ORDER: usize = 5;

/// Number of functions of the highest order.
pub const MAX_COEFFICIENTS: usize = MAX_ORDER * MAX_ORDER;

/// The factor of each band in a convolution with the clamped cosine, which turns coefficients of radiance
/// into those of irradiance as a function of the normal.
pub const COSINE_LOBE: [f64; MAX_ORDER] = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0];

/// Index of function (l, m), with m from -l to l.
pub const fn index(l: usize, m: isize) -> usize {
    (l * l + l).wrapping_add_signed(m)
}

/// The order n of a slice of n² coefficients, 1 to [`MAX_ORDER`].
///
/// # Panics
/// If the number is not 1, 4, 9, 16 or 25.
pub fn order_of(coefficient_count: usize) -> usize {
    (1..=MAX_ORDER)
        .find(|n| n * n == coefficient_count)
        .unwrap_or_else(|| panic!("{coefficient_count} coefficients; expected 1, 4, 9, 16 or 25"))
}

/// Values of the first `basis.len()` functions in a unit direction.
///
/// # Panics
/// If the length of `basis` is not 1, 4, 9, 16 or 25.
pub fn evaluate(direction: DVec3, basis: &mut [f64]) {
    let order = order_of(basis.len());
    let DVec3 { x, y, z } = direction;
    // Real and imaginary part of (x + i y)^m, which are sin^m θ times cos(m φ) and sin(m φ).
    let (mut cosine, mut sine) = (1.0, 0.0);
    // The Legendre function P_m^m without its factor sin^m θ and its sign: (2m - 1)!!.
    let mut sectoral = 1.0;
    for m in 0..order {
        let (mut previous, mut legendre) = (0.0, sectoral);
        for l in m..order {
            let scaled = NORM[l][m] * legendre;
            basis[index(l, m as isize)] = scaled * cosine;
            if m > 0 {
                basis[index(l, -(m as isize))] = scaled * sine;
            }
            let next = ((2 * l + 1) as f64 * z * legendre - (l + m) as f64 * previous)
                / (l + 1 - m) as f64;
            (previous, legendre) = (legendre, next);
        }
        sectoral *= (2 * m + 1) as f64;
        (cosine, sine) = (x * cosine - y * sine, x * sine + y * cosine);
    }
}

/// [`evaluate`] for `f32`: computed in `f64` and rounded once.
///
/// # Panics
/// If the length of `basis` is not 1, 4, 9, 16 or 25.
pub fn evaluate_f32(direction: Vec3, basis: &mut [f32]) {
    let mut wide = [0.0; MAX_COEFFICIENTS];
    let wide = &mut wide[..basis.len().min(MAX_COEFFICIENTS)];
    evaluate(direction.as_dvec3(), wide);
    for (narrow, &value) in basis.iter_mut().zip(wide.iter()) {
        *narrow = value as f32;
    }
}

/// Value of the function with the given `coefficients` in a unit direction.
///
/// # Panics
/// If their number is not 1, 4, 9, 16 or 25.
pub fn value<T: Real>(coefficients: &[T], direction: DVec3) -> f64 {
    with_basis(coefficients.len(), direction, |basis| {
        let terms = coefficients.iter().zip(basis);
        terms.map(|(c, b)| c.to_f64() * b).sum()
    })
}

/// Adds one sample of a projection: `weighted_value` times each function. The value is weighted by the solid
/// angle, in steradians, that the sample stands for.
///
/// # Panics
/// If the number of coefficients is not 1, 4, 9, 16 or 25.
pub fn add_sample(direction: DVec3, weighted_value: f64, coefficients: &mut [f64]) {
    with_basis(coefficients.len(), direction, |basis| {
        for (c, b) in coefficients.iter_mut().zip(basis) {
            *c += weighted_value * b;
        }
    });
}

/// Coefficients of `f` up to `order`, by a quadrature that is exact if `f` is a polynomial in x, y and z of at
/// most the given `degree`.
///
/// Cost: about (`degree` + `order`)² / 2 calls of `f`.
///
/// # Panics
/// If `order` is not 1 to [`MAX_ORDER`].
pub fn project(order: usize, degree: usize, mut f: impl FnMut(DVec3) -> f64) -> Vec<f64> {
    let mut coefficients = vec![0.0; order * order];
    for (direction, weight) in sphere_quadrature(degree + order.saturating_sub(1)) {
        add_sample(direction, weight * f(direction), &mut coefficients);
    }
    coefficients
}

/// Unit directions and weights, in steradians, of a quadrature over the sphere that is exact for polynomials
/// in x, y and z of at most the given `degree`. The weights add up to 4π.
///
/// It is the product of a Gauss-Legendre rule in z and equal steps of azimuth.
pub fn sphere_quadrature(degree: usize) -> Vec<(DVec3, f64)> {
    let (rings, azimuths) = (degree / 2 + 1, degree + 1);
    let mut points = Vec::with_capacity(rings * azimuths);
    for ring in 0..rings {
        let (z, ring_weight) = gauss_legendre(rings, ring);
        let radius = (1.0 - z * z).max(0.0).sqrt();
        for step in 0..azimuths {
            let azimuth = 2.0 * PI * step as f64 / azimuths as f64;
            let (sine, cosine) = libm::sincos(azimuth);
            let direction = DVec3::new(radius * cosine, radius * sine, z);
            points.push((direction, ring_weight * 2.0 * PI / azimuths as f64));
        }
    }
    points
}

/// The matrices that rotate coefficients: one square matrix of 2l + 1 rows for each band.
///
/// Let g(ω) = f(R⁻¹ω) be the rotated function. Then band l of g is `bands[l]` times band l of f, exact to
/// rounding. `rotation` may be any orthogonal matrix, mirrors included.
///
/// # Panics
/// If `order` is not 1 to [`MAX_ORDER`].
pub fn rotation_matrices(order: usize, rotation: &DMat3) -> Vec<Matrix<f64>> {
    assert!((1..=MAX_ORDER).contains(&order), "order {order}");
    let mut bands = vec![Matrix::identity(1)];
    if order > 1 {
        // Band 1 is y, z, x: the rotation itself with its axes in that order.
        const AXES: [usize; 3] = [1, 2, 0];
        bands.push(Matrix::from_fn(3, 3, |i, j| rotation.col(AXES[j])[AXES[i]]));
    }
    for l in 2..order {
        let next = next_band(l as isize, &bands[1], &bands[l - 1]);
        bands.push(next);
    }
    bands
}

/// Multiplies each band of `coefficients` by its matrix from [`rotation_matrices`].
///
/// # Panics
/// If there are fewer bands than the coefficients have, or the number of these is not 1, 4, 9, 16 or 25.
pub fn rotate(bands: &[Matrix<f64>], coefficients: &mut [f64]) {
    for (l, band) in bands[..order_of(coefficients.len())].iter().enumerate() {
        let mut rotated = [0.0; 2 * MAX_ORDER - 1];
        let of_band = &mut coefficients[l * l..(l + 1) * (l + 1)];
        for (j, &c) in of_band.iter().enumerate() {
            for (out, &r) in rotated.iter_mut().zip(band.column(j)) {
                *out += r * c;
            }
        }
        of_band.copy_from_slice(&rotated[..2 * l + 1]);
    }
}

/// Turns the coefficients of incident radiance into those of irradiance as a function of the normal.
///
/// # Panics
/// If their number is not 1, 4, 9, 16 or 25.
pub fn irradiance_from_radiance(coefficients: &mut [f64]) {
    for (l, lobe) in COSINE_LOBE[..order_of(coefficients.len())]
        .iter()
        .enumerate()
    {
        for c in &mut coefficients[l * l..(l + 1) * (l + 1)] {
            *c *= lobe;
        }
    }
}

/// Irradiance on a surface with unit `normal`, from the coefficients of the incident radiance. Its unit is
/// that of radiance times steradian.
///
/// With nine coefficients, the irradiance of a distant light errs by at most 9.4 % of its maximum, where the
/// light grazes the surface. On the far side it may be as low as -4 % of the maximum. Broad light errs far
/// less. The fourth band adds nothing.
///
/// # Panics
/// If the number of coefficients is not 1, 4, 9, 16 or 25.
pub fn irradiance<T: Real>(radiance: &[T], normal: DVec3) -> f64 {
    with_basis(radiance.len(), normal, |basis| {
        let mut sum = 0.0;
        for (l, lobe) in COSINE_LOBE[..order_of(basis.len())].iter().enumerate() {
            let band = l * l..(l + 1) * (l + 1);
            let terms = radiance[band.clone()].iter().zip(&basis[band]);
            sum += lobe * terms.map(|(c, b)| c.to_f64() * b).sum::<f64>();
        }
        sum
    })
}

/// Calls `f` with the first `count` functions in a direction.
fn with_basis<R>(count: usize, direction: DVec3, f: impl FnOnce(&[f64]) -> R) -> R {
    let mut basis = [0.0; MAX_COEFFICIENTS];
    let basis = &mut basis[..count.min(MAX_COEFFICIENTS)];
    evaluate(direction, basis);
    f(basis)
}

/// Factors that make the functions orthonormal, by band and |m|.
const NORM: [[f64; MAX_ORDER]; MAX_ORDER] = {
    let mut norm = [[0.0; MAX_ORDER]; MAX_ORDER];
    let mut l = 0;
    while l < MAX_ORDER {
        let mut m = 0;
        while m <= l {
            // The square is (2l + 1) / 4π * (l - m)! / (l + m)!, and twice that for m > 0.
            let mut square = (2 * l + 1) as f64 / (4.0 * PI);
            let mut k = l - m + 1;
            while k <= l + m {
                square /= k as f64;
                k += 1;
            }
            norm[l][m] = constant_sqrt(if m > 0 { 2.0 * square } else { square });
            m += 1;
        }
        l += 1;
    }
    norm
};

/// Square root of an argument in [1e-8, 4] by Newton's iteration, for constants: `f64::sqrt` is not `const`.
const fn constant_sqrt(x: f64) -> f64 {
    let mut root = 2.0;
    let mut step = 0;
    while step < 40 {
        root = 0.5 * (root + x / root);
        step += 1;
    }
    root
}

/// Point and weight k of the Gauss-Legendre rule of `count` points on [-1, 1], in falling order of points.
fn gauss_legendre(count: usize, k: usize) -> (f64, f64) {
    let mut z = libm::cos(PI * (k as f64 + 0.75) / (count as f64 + 0.5));
    let mut slope = 1.0;
    // Each Newton step squares the error of Tricomi's estimate. Seven leave only rounding.
    for _ in 0..7 {
        let (mut previous, mut legendre) = (0.0, 1.0);
        for l in 0..count {
            let next = ((2 * l + 1) as f64 * z * legendre - l as f64 * previous) / (l + 1) as f64;
            (previous, legendre) = (legendre, next);
        }
        slope = count as f64 * (previous - z * legendre) / (1.0 - z * z);
        z -= legendre / slope;
    }
    (z, 2.0 / ((1.0 - z * z) * slope * slope))
}

/// The rotation of band l from those of bands 1 and l - 1: equations 8.1 and tables 1 and 2 of Ivanic and
/// Ruedenberg, as corrected.
fn next_band(l: isize, first: &Matrix<f64>, below: &Matrix<f64>) -> Matrix<f64> {
    let entry = |band: &Matrix<f64>, m: isize, n: isize| {
        let center = (band.rows() / 2) as isize;
        band[((m + center) as usize, (n + center) as usize)]
    };
    let product = |i: isize, m: isize, n: isize| {
        if n.abs() < l {
            return entry(first, i, 0) * entry(below, m, n);
        }
        let sign = n.signum() as f64;
        entry(first, i, 1) * entry(below, m, sign as isize * (l - 1))
            - sign * entry(first, i, -1) * entry(below, m, -(sign as isize) * (l - 1))
    };
    let root_two_if = |condition: bool| if condition { 2f64.sqrt() } else { 1.0 };
    // The terms with factors v and w take m to its neighbours towards zero and away from zero.
    let towards_zero = |m: isize, n: isize| match m {
        0 => product(1, 1, n) + product(-1, -1, n),
        1 => root_two_if(true) * product(1, 0, n),
        -1 => root_two_if(true) * product(-1, 0, n),
        m if m > 0 => product(1, m - 1, n) - product(-1, 1 - m, n),
        m => product(1, m + 1, n) + product(-1, -m - 1, n),
    };
    let away_from_zero = |m: isize, n: isize| match m {
        m if m > 0 => product(1, m + 1, n) + product(-1, -m - 1, n),
        m => product(1, m - 1, n) - product(-1, 1 - m, n),
    };
    let size = (2 * l + 1) as usize;
    Matrix::from_fn(size, size, |row, column| {
        let (m, n) = (row as isize - l, column as isize - l);
        let a = m.abs();
        let denominator = if n.abs() == l {
            (2 * l * (2 * l - 1)) as f64
        } else {
            ((l + n) * (l - n)) as f64
        };
        let root = |numerator: isize| (numerator as f64 / denominator).sqrt();
        let u = root((l + m) * (l - m));
        let v = if m == 0 {
            -0.5 * root(2 * (l - 1) * l)
        } else {
            0.5 * root((l + a - 1) * (l + a))
        };
        let w = if m == 0 {
            0.0
        } else {
            -0.5 * root((l - a - 1) * (l - a))
        };
        // Where a factor is zero, its term would lie outside the lower band.
        let mut sum = v * towards_zero(m, n);
        if u != 0.0 {
            sum += u * product(0, m, n);
        }
        if w != 0.0 {
            sum += w * away_from_zero(m, n);
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// Some hundred roundings of numbers near 1.
    const ROUNDING: f64 = 1e-13;

    fn a_rotation(k: usize) -> DMat3 {
        let axis = DVec3::new(1.0, 0.3 * k as f64, -0.7).normalize();
        DMat3::from_quat(DQuat::from_axis_angle(axis, 0.9 + 1.1 * k as f64))
    }

    /// Fixed coefficients with no symmetry.
    fn some_coefficients() -> Vec<f64> {
        (0..MAX_COEFFICIENTS)
            .map(|k| ((k * 37 + 11) % 25) as f64 / 25.0 - 0.4)
            .collect()
    }

    fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
        assert_eq!(a.len(), b.len());
        for (k, (x, y)) in a.iter().zip(b).enumerate() {
            assert!((x - y).abs() <= tolerance, "coefficient {k}: {x} and {y}");
        }
    }

    #[test]
    fn the_first_nine_are_in_order_and_positive() {
        let d = DVec3::new(0.48, 0.6, 0.64);
        let DVec3 { x, y, z } = d;
        let polynomials = [
            1.0,
            y,
            z,
            x,
            x * y,
            y * z,
            3.0 * z * z - 1.0,
            x * z,
            x * x - y * y,
        ];
        let (first, second) = ((3.0 / (4.0 * PI)).sqrt(), (15.0 / (4.0 * PI)).sqrt());
        let zonal = (5.0 / (16.0 * PI)).sqrt();
        let factors = [
            (1.0 / (4.0 * PI)).sqrt(),
            first,
            first,
            first,
            second,
            second,
            zonal,
            second,
            second / 2.0,
        ];
        let mut basis = [0.0; 9];
        evaluate(d, &mut basis);
        let expected: Vec<f64> = (0..9).map(|k| polynomials[k] * factors[k]).collect();
        assert_close(&basis, &expected, 1e-15);
        let mut narrow = [0.0f32; 9];
        evaluate_f32(d.as_vec3(), &mut narrow);
        for (k, &value) in narrow.iter().enumerate() {
            // The direction is rounded too.
            assert!((f64::from(value) - basis[k]).abs() < 3e-7);
        }
    }

    #[test]
    fn functions_are_orthonormal() {
        for k in 0..MAX_COEFFICIENTS {
            let function = |d| {
                let mut basis = [0.0; MAX_COEFFICIENTS];
                evaluate(d, &mut basis);
                basis[k]
            };
            let mut unit = vec![0.0; MAX_COEFFICIENTS];
            unit[k] = 1.0;
            let degree = MAX_ORDER - 1;
            assert_close(&project(MAX_ORDER, degree, function), &unit, ROUNDING);
        }
    }

    #[test]
    fn a_lower_order_is_a_prefix() {
        let d = DVec3::new(-0.36, 0.48, -0.8);
        let mut all = [0.0; MAX_COEFFICIENTS];
        evaluate(d, &mut all);
        for order in 1..MAX_ORDER {
            let mut basis = vec![0.0; order * order];
            evaluate(d, &mut basis);
            assert_eq!(basis, all[..order * order]);
        }
    }

    #[test]
    fn rotating_equals_projecting_again() {
        let f = some_coefficients();
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        let mut matrices: Vec<DMat3> = (0..4).map(a_rotation).collect();
        matrices.extend([DMat3::IDENTITY, mirror, mirror * a_rotation(2)]);
        for rotation in matrices {
            let mut rotated = f.clone();
            rotate(&rotation_matrices(MAX_ORDER, &rotation), &mut rotated);
            let inverse = rotation.transpose();
            let again = project(MAX_ORDER, MAX_ORDER - 1, |d| value(&f, inverse * d));
            assert_close(&rotated, &again, ROUNDING);
        }
    }

    #[test]
    fn rotations_compose_and_keep_length() {
        let (first, second) = (a_rotation(1), a_rotation(3));
        let mut in_steps = some_coefficients();
        let mut at_once = in_steps.clone();
        rotate(&rotation_matrices(MAX_ORDER, &first), &mut in_steps);
        rotate(&rotation_matrices(MAX_ORDER, &second), &mut in_steps);
        rotate(
            &rotation_matrices(MAX_ORDER, &(second * first)),
            &mut at_once,
        );
        assert_close(&in_steps, &at_once, ROUNDING);
        let length = |c: &[f64]| c.iter().map(|x| x * x).sum::<f64>();
        assert!((length(&at_once) - length(&some_coefficients())).abs() < ROUNDING);
    }

    #[test]
    fn irradiance_equals_the_numeric_integral() {
        let radiance = some_coefficients();
        let normal = DVec3::new(0.6, -0.48, 0.64);
        let mut coefficients = radiance.clone();
        irradiance_from_radiance(&mut coefficients);
        let folded = value(&coefficients, normal);
        assert!((folded - irradiance(&radiance, normal)).abs() < ROUNDING);
        // In the frame of the normal, the kink of the clamped cosine is the edge of the upper hemisphere,
        // where z = cos θ runs from 0 to 1.
        let frame = DQuat::from_rotation_arc(DVec3::Z, normal);
        let (rings, azimuths) = (12, 16);
        let mut sum = 0.0;
        for ring in 0..rings {
            let (z, weight) = gauss_legendre(rings, ring);
            let (z, weight) = (0.5 * (z + 1.0), 0.5 * weight);
            for step in 0..azimuths {
                let azimuth = 2.0 * PI * step as f64 / azimuths as f64;
                let radius = (1.0 - z * z).sqrt();
                let local = DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), z);
                sum += value(&radiance, frame * local) * z * weight * 2.0 * PI / azimuths as f64;
            }
        }
        // Odd powers of the radius occur only in terms that the sum over azimuths cancels.
        assert!((sum - folded).abs() < 1e-12, "{sum} and {folded}");
    }

    #[test]
    fn uniform_radiance_gives_pi_times_it() {
        let radiance = project(3, 0, |_| 2.0);
        let got = irradiance(&radiance, DVec3::new(0.0, 0.6, 0.8));
        assert!((got - 2.0 * PI).abs() < ROUNDING);
    }

    #[test]
    fn the_cosine_lobe_has_its_closed_form() {
        // A_l is 2π times the integral of P_l(z) z over [0, 1].
        let legendre: [fn(f64) -> f64; 5] = [
            |_| 1.0,
            |z| z,
            |z| 0.5 * (3.0 * z * z - 1.0),
            |z| 0.5 * (5.0 * z * z - 3.0) * z,
            |z| (35.0 * z * z * z * z - 30.0 * z * z + 3.0) / 8.0,
        ];
        for (l, polynomial) in legendre.iter().enumerate() {
            let integral: f64 = (0..5)
                .map(|k| gauss_legendre(5, k))
                .map(|(z, weight)| (0.5 * (z + 1.0), 0.5 * weight))
                .map(|(z, weight)| weight * z * polynomial(z))
                .sum();
            assert!(
                (2.0 * PI * integral - COSINE_LOBE[l]).abs() < 1e-14,
                "band {l}"
            );
        }
    }

    #[test]
    fn quadrature_weights_cover_the_sphere() {
        for degree in [0, 1, 7, 20] {
            let sum: f64 = sphere_quadrature(degree).iter().map(|(_, w)| w).sum();
            assert!((sum - 4.0 * PI).abs() < ROUNDING);
        }
    }

    #[test]
    #[should_panic(expected = "10 coefficients")]
    fn a_number_of_coefficients_that_is_no_square_is_refused() {
        evaluate(DVec3::Z, &mut [0.0; 10]);
    }
}
