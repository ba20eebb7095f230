//! Singular value decomposition and eigenvectors in `f64`, through nalgebra, and the energy that a
//! truncation drops.
//!
//! A decomposition has the same bits on every machine: nalgebra is built without its run-time choice of
//! instruction set, vectors are ordered by falling singular value, and signs are fixed.

mod jacobi;

use crate::linalg::matrix::{Matrix, MatrixView, Real, dot, multiply};
use jacobi::{Factors, one_sided_jacobi};
use nalgebra::DMatrix;

/// Number of iterations for each row or column after which nalgebra's methods are given up.
///
/// They take two or three. On some matrices of low rank, where rotations underflow, they never end or
/// give NaN.
const MAX_ITERATIONS: usize = 30;

/// A thin decomposition `a = u * diag(singular_values) * vᵀ`, largest value first.
#[derive(Clone, Debug)]
pub struct Svd {
    /// Left singular vectors, as columns.
    pub u: Matrix<f64>,
    /// Singular values: falling, not negative.
    pub singular_values: Vec<f64>,
    /// Right singular vectors, as columns.
    pub v: Matrix<f64>,
}

/// Thin singular value decomposition of any matrix.
///
/// In each column of `u` the entry of largest magnitude is positive (the first one, of equals). Errors
/// are near 1e-15 of the largest singular value. Cost: about `20 * m * n * min(m, n)` operations for an
/// m x n matrix.
pub fn svd(a: MatrixView<f64>) -> Svd {
    let (rows, columns) = (a.rows(), a.columns());
    let rank = rows.min(columns);
    if rank == 0 {
        return Svd {
            u: Matrix::zeros(rows, 0),
            singular_values: Vec::new(),
            v: Matrix::zeros(columns, 0),
        };
    }
    let Factors {
        left: u,
        values,
        right: v,
    } = decompose(a);
    let mut order: Vec<usize> = (0..rank).collect();
    order.sort_by(|&i, &j| values[j].total_cmp(&values[i]));
    let signs: Vec<f64> = order
        .iter()
        .map(|&k| largest_entry_sign(u.column(k)))
        .collect();
    Svd {
        u: Matrix::from_fn(rows, rank, |i, j| u[(i, order[j])] * signs[j]),
        singular_values: order.iter().map(|&k| values[k]).collect(),
        v: Matrix::from_fn(columns, rank, |i, j| v[(i, order[j])] * signs[j]),
    }
}

/// Decomposes by nalgebra, or by Jacobi rotations if nalgebra gives up.
fn decompose(a: MatrixView<f64>) -> Factors {
    let (rows, columns) = (a.rows(), a.columns());
    let epsilon = 5.0 * f64::EPSILON;
    let limit = MAX_ITERATIONS * rows.min(columns);
    let full = DMatrix::from_column_slice(rows, columns, a.data());
    if let Some(nalgebra::SVD {
        u: Some(u),
        v_t: Some(v_t),
        singular_values,
    }) = full.try_svd(true, true, epsilon, limit)
    {
        let values = singular_values.as_slice().to_vec();
        let parts = [u.as_slice(), v_t.as_slice(), &values];
        if parts.iter().all(|part| part.iter().all(|x| x.is_finite())) {
            return Factors {
                left: Matrix::from_column_major(rows, values.len(), u.as_slice().to_vec()),
                values,
                right: Matrix::from_fn(columns, v_t.nrows(), |i, j| v_t[(j, i)]),
            };
        }
    }
    if rows >= columns {
        return one_sided_jacobi(a);
    }
    let transposed = Matrix::from_fn(columns, rows, |i, j| a.column(i)[j]);
    let of_transposed = one_sided_jacobi(transposed.view());
    Factors {
        left: of_transposed.right,
        values: of_transposed.values,
        right: of_transposed.left,
    }
}

/// Falling eigenvalues of a symmetric matrix, and its eigenvectors as columns. Only the lower triangle is
/// read.
///
/// For a tall matrix `a` this is a cheap way to its right singular vectors (method of snapshots): the
/// eigenvalues of `aᵀa` are squared singular values, good down to 1e-7 of the largest.
///
/// # Panics
/// If the matrix is not square.
pub fn symmetric_eigen(a: MatrixView<f64>) -> (Vec<f64>, Matrix<f64>) {
    let size = a.rows();
    assert_eq!(size, a.columns(), "a symmetric matrix is square");
    if size == 0 {
        return (Vec::new(), Matrix::zeros(0, 0));
    }
    let (values, vectors) = decompose_symmetric(a);
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&i, &j| values[j].total_cmp(&values[i]));
    let vectors = Matrix::from_fn(size, size, |i, j| vectors[(i, order[j])]);
    (order.iter().map(|&k| values[k]).collect(), vectors)
}

/// Eigenvalues and eigenvectors in any order.
fn decompose_symmetric(a: MatrixView<f64>) -> (Vec<f64>, Matrix<f64>) {
    let size = a.rows();
    let full = DMatrix::from_column_slice(size, size, a.data());
    if let Some(eigen) = full.try_symmetric_eigen(f64::EPSILON, MAX_ITERATIONS * size) {
        let (values, vectors) = (eigen.eigenvalues.as_slice(), eigen.eigenvectors.as_slice());
        if values.iter().chain(vectors).all(|x| x.is_finite()) {
            let vectors = Matrix::from_column_major(size, size, vectors.to_vec());
            return (values.to_vec(), vectors);
        }
    }
    // The right singular vectors of a symmetric matrix are its eigenvectors. A value and its negative,
    // if both occurred, would have mixed vectors. But matrices of scalar products, which come here, have
    // no negative eigenvalues.
    let symmetric = Matrix::from_fn(size, size, |i, j| a.column(i.min(j))[i.max(j)]);
    let Factors {
        left,
        values,
        right,
    } = one_sided_jacobi(symmetric.view());
    let signed = (0..size)
        .map(|k| {
            let sign = dot(left.column(k), right.column(k));
            if sign < 0.0 { -values[k] } else { values[k] }
        })
        .collect();
    (signed, right)
}

/// Number of squarings in [`spectral_radius`]. For a matrix of condition 1e300, the power 2^40 errs by
/// one part in 1e9.
const RADIUS_SQUARINGS: i32 = 40;

/// Largest magnitude of the eigenvalues of a square matrix: the limit of `‖Aᵖ‖^(1/p)` (Gelfand), where p
/// is doubled by squaring.
///
/// This always ends. Eigenvalue solvers iterate until they converge, and nalgebra's does not converge for
/// some nearly diagonal matrices.
///
/// # Panics
/// If the matrix is not square.
pub fn spectral_radius(a: MatrixView<f64>) -> f64 {
    assert_eq!(a.rows(), a.columns(), "a square matrix has eigenvalues");
    let mut power = Matrix::from_column_major(a.rows(), a.columns(), a.data().to_vec());
    // The log of the radius is the sum, over squarings k, of log(norm before the squaring) / 2^k.
    let mut log_radius = 0.0;
    let mut share = 1.0;
    for _ in 0..RADIUS_SQUARINGS {
        let norm = power.frobenius_norm();
        if norm == 0.0 {
            return 0.0;
        }
        log_radius += libm::log(norm) * share;
        share *= 0.5;
        let scaled = power.scaled_columns(&vec![1.0 / norm; power.columns()]);
        power = multiply(scaled.view(), scaled.view());
    }
    libm::exp(log_radius)
}

/// Smallest number of leading singular values whose squares make at least `fraction` of the sum of all
/// squares.
pub fn energy_rank(singular_values: &[f64], fraction: f64) -> usize {
    let total: f64 = singular_values.iter().map(|s| s * s).sum();
    let mut held = 0.0;
    for (k, s) in singular_values.iter().enumerate() {
        held += s * s;
        if held >= fraction * total {
            return k + 1;
        }
    }
    singular_values.len()
}

/// Fraction of the sum of squares that lies beyond the first `kept` values, in [0, 1].
pub fn dropped_energy(singular_values: &[f64], kept: usize) -> f64 {
    let total: f64 = singular_values.iter().map(|s| s * s).sum();
    let dropped: f64 = singular_values.iter().skip(kept).map(|s| s * s).sum();
    // Adding 0 turns -0, the empty sum of floats, into 0.
    if total > 0.0 {
        dropped / total + 0.0
    } else {
        0.0
    }
}

/// [`dropped_energy`] without the first value, for spectra whose first mode is prescribed. The size of
/// that mode is arbitrary, and would make every other share look small.
pub fn dropped_energy_beyond_first(singular_values: &[f64], kept: usize) -> f64 {
    dropped_energy(
        singular_values.get(1..).unwrap_or(&[]),
        kept.saturating_sub(1),
    )
}

/// The sign of the entry of largest magnitude, +1 or -1.
///
/// Symmetric vectors have many entries of equal magnitude. So entries within a millionth of the largest
/// magnitude tie, and the first of them decides.
pub fn largest_entry_sign<T: Real>(column: &[T]) -> f64 {
    let largest = column
        .iter()
        .fold(0.0f64, |largest, x| largest.max(x.to_f64().abs()));
    let threshold = largest * (1.0 - 1e-6);
    match column.iter().find(|x| x.to_f64().abs() >= threshold) {
        Some(x) if x.to_f64() < 0.0 => -1.0,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::matrix::transpose_multiply;

    fn sample(rows: usize, columns: usize) -> Matrix<f64> {
        // Rank two plus a small full-rank part: some singular values far apart, others close together.
        Matrix::from_fn(rows, columns, |i, j| {
            let (x, y) = (i as f64 + 1.0, j as f64 + 2.0);
            (x * 0.3).sin() * y + x * 0.01 * (y * 1.7).cos() + 1e-3 * ((i * 7 + j * 13) % 5) as f64
        })
    }

    fn assert_close(a: &Matrix<f64>, b: &Matrix<f64>, tolerance: f64) {
        for (x, y) in a.data().iter().zip(b.data()) {
            assert!((x - y).abs() <= tolerance, "{x} against {y}");
        }
    }

    #[test]
    fn repeating_every_column_doubles_the_eigenvalues_of_the_gram_matrix() {
        for size in [1, 5, 40] {
            let once = sample(60, size);
            let columns: Vec<&[f64]> = (0..2 * size).map(|j| once.column(j % size)).collect();
            let twice = Matrix::from_columns(60, &columns);
            let gram = |m: &Matrix<f64>| transpose_multiply(m.view(), m.view());
            let (expected, _) = symmetric_eigen(gram(&once).view());
            let (found, _) = symmetric_eigen(gram(&twice).view());
            for (k, value) in found.iter().enumerate() {
                let expected = expected.get(k).map_or(0.0, |v| 2.0 * v);
                // Rounding of the largest value, times the dimension.
                assert!(
                    (value - expected).abs() <= 1e-13 * found[0],
                    "{size} {k}: {value}"
                );
            }
        }
    }

    #[test]
    fn full_rank_equals_the_matrix() {
        for (rows, columns) in [(30, 12), (12, 30), (9, 9), (1, 5)] {
            let a = sample(rows, columns);
            let svd = svd(a.view());
            let us = svd.u.scaled_columns(&svd.singular_values);
            let back = multiply(us.view(), svd.v.transposed().view());
            // 1e-15 relative to the largest singular value, times the dimension.
            assert_close(&back, &a, 1e-13 * svd.singular_values[0]);
            let rank = rows.min(columns);
            let eye = Matrix::identity(rank);
            assert_close(&transpose_multiply(svd.u.view(), svd.u.view()), &eye, 1e-12);
            assert_close(&transpose_multiply(svd.v.view(), svd.v.view()), &eye, 1e-12);
            assert!(svd.singular_values.windows(2).all(|w| w[0] >= w[1]));
        }
    }

    #[test]
    fn gram_eigenvalues_are_squared_singular_values() {
        let a = sample(40, 8);
        let (values, _) = symmetric_eigen(transpose_multiply(a.view(), a.view()).view());
        let svd = svd(a.view());
        for (value, s) in values.iter().zip(&svd.singular_values) {
            assert!((value - s * s).abs() < 1e-13 * values[0]);
        }
    }

    #[test]
    fn the_spectral_radius_is_the_largest_magnitude_of_the_eigenvalues() {
        // A scaled rotation, a nilpotent matrix, and a triangular one with a large norm. After forty
        // squarings the norm counts for a part in 1e9.
        let cases = [
            (vec![0.0, 0.8, -0.8, 0.0], 0.8),
            (vec![0.0, 0.0, 5.0, 0.0], 0.0),
            (vec![0.5, 0.0, 100.0, -0.25], 0.5),
        ];
        for (data, expected) in cases {
            let a = Matrix::from_column_major(2, 2, data);
            assert!((spectral_radius(a.view()) - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn energy_is_the_sum_of_squares() {
        let s = [3.0, 2.0, 1.0];
        assert_eq!(energy_rank(&s, 9.0 / 14.0), 1);
        assert_eq!(energy_rank(&s, 0.9), 2);
        assert!((dropped_energy(&s, 2) - 1.0 / 14.0).abs() < 1e-15);
        assert!((dropped_energy_beyond_first(&s, 2) - 1.0 / 5.0).abs() < 1e-15);
    }
}
