//! Singular value decomposition by one-sided Jacobi rotations (Hestenes 1958), for matrices on which
//! nalgebra's iteration does not end.
//!
//! Pairs of columns are rotated until all are orthogonal. This always ends, and finds small singular
//! values to high relative accuracy, but takes several times as long as bidiagonalisation.

use crate::linalg::matrix::{Matrix, MatrixView, dot};

/// Two columns count as orthogonal if the cosine of their angle is at most this.
const ORTHOGONAL: f64 = 1e-15;

/// Columns of at most this fraction of the longest one's length are rounding, and become zero.
const NEGLIGIBLE: f64 = 1e-16;

/// Most sweeps over all pairs of columns. Ten are usual: each one squares the cosines.
const MAX_SWEEPS: usize = 40;

/// A decomposition `a = left * diag(values) * rightᵀ`, in any order of the values.
pub(super) struct Factors {
    pub(super) left: Matrix<f64>,
    pub(super) values: Vec<f64>,
    pub(super) right: Matrix<f64>,
}

/// Decomposes a matrix that has at least as many rows as columns. The left vector of a zero value is zero.
pub(super) fn one_sided_jacobi(a: MatrixView<f64>) -> Factors {
    let (rows, columns) = (a.rows(), a.columns());
    let mut rotated: Vec<Vec<f64>> = (0..columns).map(|j| a.column(j).to_vec()).collect();
    let mut right: Vec<Vec<f64>> = (0..columns)
        .map(|j| (0..columns).map(|i| f64::from(u8::from(i == j))).collect())
        .collect();
    let longest = |columns: &[Vec<f64>]| {
        columns
            .iter()
            .map(|column| dot(column, column))
            .fold(0.0, f64::max)
    };
    let negligible = NEGLIGIBLE * NEGLIGIBLE * longest(&rotated);
    for _ in 0..MAX_SWEEPS {
        let mut is_done = true;
        for q in 1..columns {
            for p in 0..q {
                let alpha = dot(&rotated[p], &rotated[p]);
                let beta = dot(&rotated[q], &rotated[q]);
                if alpha <= negligible || beta <= negligible {
                    continue;
                }
                let gamma = dot(&rotated[p], &rotated[q]);
                if gamma.abs() <= ORTHOGONAL * (alpha * beta).sqrt() {
                    continue;
                }
                is_done = false;
                let zeta = (beta - alpha) / (2.0 * gamma);
                let tangent = 1.0 / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let tangent = if zeta < 0.0 { -tangent } else { tangent };
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                rotate(&mut rotated, p, q, cosine, cosine * tangent);
                rotate(&mut right, p, q, cosine, cosine * tangent);
            }
        }
        if is_done {
            break;
        }
    }
    let mut values = Vec::with_capacity(columns);
    for column in &mut rotated {
        let square = dot(column, column);
        let value = if square > negligible {
            square.sqrt()
        } else {
            0.0
        };
        let scale = if value > 0.0 { 1.0 / value } else { 0.0 };
        column.iter_mut().for_each(|x| *x *= scale);
        values.push(value);
    }
    Factors {
        left: Matrix::from_columns(rows, &rotated),
        values,
        right: Matrix::from_columns(columns, &right),
    }
}

/// Rotates columns `p < q` in the plane that they span.
fn rotate(columns: &mut [Vec<f64>], p: usize, q: usize, cosine: f64, sine: f64) {
    let (before, from_q) = columns.split_at_mut(q);
    for (x, y) in before[p].iter_mut().zip(from_q[0].iter_mut()) {
        let (a, b) = (*x, *y);
        *x = cosine * a - sine * b;
        *y = sine * a + cosine * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::matrix::multiply;

    #[test]
    fn the_factors_multiply_to_the_matrix() {
        // Rank 3 of 5 columns, two of them equal.
        let a = Matrix::from_fn(9, 5, |i, j| {
            let (x, y) = (i as f64 / 8.0, (j % 4) as f64);
            1.0 + x * y + 1e-3 * x * x * y * y
        });
        let Factors {
            left,
            values,
            right,
        } = one_sided_jacobi(a.view());
        let back = multiply(
            left.scaled_columns(&values).view(),
            right.transposed().view(),
        );
        for (x, y) in back.data().iter().zip(a.data()) {
            // A few rotations of numbers of order 10.
            assert!((x - y).abs() < 1e-13, "{x} against {y}");
        }
        assert_eq!(values.iter().filter(|&&s| s > 1e-12).count(), 3);
    }
}
