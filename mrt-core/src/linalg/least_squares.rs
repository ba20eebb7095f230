//! Inverses for least-squares fits whose normal equations may be singular.

use crate::linalg::matrix::{Matrix, multiply};
use crate::linalg::parity_modes::GRAM_FLOOR;
use crate::linalg::svd::symmetric_eigen;

/// The inverse of a symmetric positive semidefinite matrix on the space where it is not lost in rounding (eigenvalues
/// above [`GRAM_FLOOR`] of the largest), and zero elsewhere.
pub fn pseudo_inverse(matrix: &Matrix<f64>) -> Matrix<f64> {
    let (values, vectors) = symmetric_eigen(matrix.view());
    let largest = values.first().copied().unwrap_or(0.0);
    let inverse: Vec<f64> = values
        .iter()
        .map(|&value| {
            if value > GRAM_FLOOR * largest {
                1.0 / value
            } else {
                0.0
            }
        })
        .collect();
    multiply(
        vectors.scaled_columns(&inverse).view(),
        vectors.transposed().view(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::matrix::transpose_multiply;

    #[test]
    fn a_regular_matrix_times_its_inverse_is_one() {
        let a = Matrix::from_fn(5, 3, |i, j| ((i * i + 2 * j * i + j) % 7) as f64 - 2.0);
        let gram = transpose_multiply(a.view(), a.view());
        let product = multiply(pseudo_inverse(&gram).view(), gram.view());
        for (x, y) in product.data().iter().zip(Matrix::<f64>::identity(3).data()) {
            assert!((x - y).abs() < 1e-12);
        }
    }

    #[test]
    fn dependent_columns_give_the_shortest_solution() {
        // Two equal columns share the weight.
        let gram = Matrix::from_column_major(2, 2, vec![4.0, 4.0, 4.0, 4.0]);
        let right = Matrix::from_column_major(2, 1, vec![8.0, 8.0]);
        let found = multiply(pseudo_inverse(&gram).view(), right.view());
        for x in found.data() {
            assert!((x - 1.0).abs() < 1e-12, "{x}");
        }
    }
}
