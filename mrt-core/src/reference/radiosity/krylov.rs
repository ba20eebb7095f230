//! Solves x - G x = b by the generalised minimal residual method (GMRES, Saad and Schultz 1986).
//!
//! It takes a few dozen products with G where the plain series, at albedo 0.95, takes hundreds.

use super::error::ExactError;
use crate::linalg::matrix::dot;

/// Number of products after which the method gives up; mazes at albedo 0.95 take about forty.
const MAX_STEPS: usize = 200;

/// The x for which x - `gain`(x) = b. The residual is at most `tolerance` times |b|.
///
/// # Errors
/// [`ExactError::NotConverged`], or what `gain` returns.
pub(super) fn solve_gain(
    gain: impl Fn(&[f64]) -> Result<Vec<f64>, ExactError>,
    b: &[f64],
    tolerance: f64,
) -> Result<Vec<f64>, ExactError> {
    let size = norm(b);
    if size == 0.0 {
        return Ok(vec![0.0; b.len()]);
    }
    let mut basis = vec![scaled(b, 1.0 / size)];
    // Columns of the Hessenberg matrix after its rotations, which make it upper triangular.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut right = vec![size];
    for step in 0..MAX_STEPS {
        let newest = &basis[step];
        let gained = gain(newest)?;
        let mut next: Vec<f64> = newest.iter().zip(&gained).map(|(x, g)| x - g).collect();
        let mut column = Vec::with_capacity(step + 2);
        for vector in &basis {
            let along = dot(vector, &next);
            add_scaled(&mut next, vector, -along);
            column.push(along);
        }
        let rest = norm(&next);
        for (k, &(cosine, sine)) in rotations.iter().enumerate() {
            let (x, y) = (column[k], column[k + 1]);
            column[k] = cosine * x + sine * y;
            column[k + 1] = cosine * y - sine * x;
        }
        let length = column[step].hypot(rest);
        let (cosine, sine) = (column[step] / length, rest / length);
        column[step] = length;
        rotations.push((cosine, sine));
        right.push(-sine * right[step]);
        right[step] *= cosine;
        triangle.push(column);
        if right[step + 1].abs() <= tolerance * size {
            return Ok(combine(&basis, &triangle, &right));
        }
        basis.push(scaled(&next, 1.0 / rest));
    }
    Err(ExactError::NotConverged {
        expected: tolerance,
        found: right[MAX_STEPS].abs() / size,
        steps: MAX_STEPS,
    })
}

/// The combination of `basis` whose weights solve the triangular system.
fn combine(basis: &[Vec<f64>], triangle: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let count = triangle.len();
    let mut weights = right[..count].to_vec();
    for k in (0..count).rev() {
        weights[k] /= triangle[k][k];
        for row in 0..k {
            weights[row] -= triangle[k][row] * weights[k];
        }
    }
    let mut sum = vec![0.0; basis[0].len()];
    for (vector, &weight) in basis.iter().zip(&weights) {
        add_scaled(&mut sum, vector, weight);
    }
    sum
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn scaled(a: &[f64], factor: f64) -> Vec<f64> {
    a.iter().map(|x| x * factor).collect()
}

fn add_scaled(sum: &mut [f64], a: &[f64], factor: f64) {
    for (s, x) in sum.iter_mut().zip(a) {
        *s += x * factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_residual_meets_its_tolerance() {
        // The operator turns by 90 degrees and shrinks, so its eigenvalues are not real.
        let gain = |x: &[f64]| Ok(vec![-0.9 * x[1], 0.9 * x[0], 0.5 * x[2] + 0.1 * x[0]]);
        let b = [1.0, 2.0, -3.0];
        let x = solve_gain(gain, &b, 1e-12).unwrap();
        let g = gain(&x).unwrap();
        for k in 0..3 {
            assert!((x[k] - g[k] - b[k]).abs() < 1e-11);
        }
    }
}
