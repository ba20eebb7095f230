//! Products of large matrices, spread over the threads. They have the bits of the products of
//! [`mrt_core::linalg::matrix`].

use mrt_core::linalg::matrix::{Matrix, multiply_add, transpose_multiply};
use rayon::prelude::*;

/// Columns of `a` that stay in a core's cache while all columns of a product are advanced by them.
const BLOCK: usize = 32;
/// Columns of a product that one thread computes.
const CHUNK: usize = 16;

/// `a * b`, each element summed in the order of `a`'s columns, as by [`mrt_core::linalg::matrix::multiply`].
pub fn parallel_multiply(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    let rows = a.rows();
    let mut data = vec![0.0; rows * b.columns()];
    if rows > 0 {
        data.par_chunks_mut(rows * CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| {
                let columns = out.len() / rows;
                for start in (0..a.columns()).step_by(BLOCK) {
                    let end = (start + BLOCK).min(a.columns());
                    let part = Matrix::from_fn(end - start, columns, |i, j| {
                        b[(start + i, chunk * CHUNK + j)]
                    });
                    multiply_add(a.columns_view(start..end), part.view(), out);
                }
            });
    }
    Matrix::from_column_major(rows, b.columns(), data)
}

/// `aᵀ * b`, as by [`transpose_multiply`].
pub fn parallel_transpose_multiply(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    let columns: Vec<Matrix<f64>> = (0..b.columns())
        .into_par_iter()
        .map(|j| transpose_multiply(a.view(), b.columns_view(j..j + 1)))
        .collect();
    let columns: Vec<&[f64]> = columns.iter().map(|m| m.data()).collect();
    Matrix::from_columns(a.columns(), &columns)
}
