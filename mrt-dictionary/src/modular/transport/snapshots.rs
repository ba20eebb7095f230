//! Decomposition of matrices that are too large for the SVD of a few seconds, through the products of their
//! rows or columns (method of snapshots), and a product of such matrices over the threads.

use mrt_core::linalg::matrix::{Matrix, dot, multiply_add};
use mrt_core::linalg::svd::{largest_entry_sign, symmetric_eigen};
use rayon::prelude::*;

/// Modes below this fraction of the largest singular value are left out: squared, they
/// are rounding to the Gram matrix that they are taken from.
const SMALLEST_MODE: f64 = 1e-6;

/// Added to the diagonal of the Gram matrix, in units of its largest entry, and taken from the eigenvalues again.
/// A prior has more lights than a symmetry class has signals. Where that leaves eigenvalues of exactly zero,
/// nalgebra's iteration turns by angles that underflow, and gives NaN.
const SHIFT: f64 = 1e-6;

/// The singular values of a matrix, and its singular vectors on its shorter side.
pub(crate) struct Snapshots {
    /// Falling.
    pub singular_values: Vec<f64>,
    vectors: Matrix<f64>,
    is_left: bool,
}

impl Snapshots {
    /// Decomposes the smaller of `a aᵀ` and `aᵀ a`.
    pub fn of(a: &Matrix<f64>) -> Self {
        let is_left = a.rows() <= a.columns();
        let flipped;
        let tall = if is_left {
            flipped = a.transposed();
            &flipped
        } else {
            a
        };
        let size = tall.columns();
        let lower: Vec<Vec<f64>> = (0..size)
            .into_par_iter()
            .map(|j| {
                (j..size)
                    .map(|i| dot(tall.column(i), tall.column(j)))
                    .collect()
            })
            .collect();
        let largest = (0..size).map(|j| lower[j][0]).fold(0.0, f64::max);
        let shift = SHIFT * largest;
        // Only the lower triangle is read.
        let gram = Matrix::from_fn(size, size, |i, j| {
            let product = if i < j { 0.0 } else { lower[j][i - j] };
            product + if i == j { shift } else { 0.0 }
        });
        let (mut values, vectors) = symmetric_eigen(gram.view());
        values.iter_mut().for_each(|v| *v -= shift);
        let floor = SMALLEST_MODE * SMALLEST_MODE * values.first().copied().unwrap_or(0.0);
        Self {
            singular_values: values
                .iter()
                .take_while(|&&v| v > floor)
                .map(|v| v.sqrt())
                .collect(),
            vectors,
            is_left,
        }
    }

    /// Left and right singular vector of mode `k`; the left one's largest entry is positive.
    pub fn pair(&self, a: &Matrix<f64>, k: usize) -> (Vec<f64>, Vec<f64>) {
        let known = self.vectors.column(k);
        let scale = 1.0 / self.singular_values[k];
        let mut other = if self.is_left {
            (0..a.columns()).map(|j| dot(a.column(j), known)).collect()
        } else {
            combined(a, known)
        };
        other.iter_mut().for_each(|x| *x *= scale);
        let (mut u, mut v) = if self.is_left {
            (known.to_vec(), other)
        } else {
            (other, known.to_vec())
        };
        let sign = largest_entry_sign(&u);
        u.iter_mut().chain(&mut v).for_each(|x| *x *= sign);
        (u, v)
    }
}

/// The sum of the columns of `a` with the given weights.
pub(crate) fn combined(a: &Matrix<f64>, weights: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.rows()];
    let weights = Matrix::from_columns(weights.len(), &[weights]);
    multiply_add(a.view(), weights.view(), &mut out);
    out
}

/// Columns of `a` that stay in a core's cache while all columns of a product are advanced by them.
const BLOCK: usize = 32;
/// Columns of a product that one thread computes.
const CHUNK: usize = 16;

/// `a * b`, each element summed in the order of `a`'s columns, as by [`mrt_core::linalg::matrix::multiply`].
pub(crate) fn parallel_multiply(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snapshots_of_either_side_give_the_same_modes() {
        let wide = Matrix::from_fn(4, 9, |i, j| ((3 * i + 5 * j + i * j) % 7) as f64 - 2.0);
        let tall = wide.transposed();
        let (a, b) = (Snapshots::of(&wide), Snapshots::of(&tall));
        for (k, (x, y)) in a.singular_values.iter().zip(&b.singular_values).enumerate() {
            // Roots of eigenvalues that err by a rounding of the largest.
            assert!((x - y).abs() < 1e-9);
            let ((u, v), (v_too, u_too)) = (a.pair(&wide, k), b.pair(&tall, k));
            assert!((dot(&u, &u_too).abs() - 1.0).abs() < 1e-9);
            assert!((dot(&v, &v_too).abs() - 1.0).abs() < 1e-9);
            let image = combined(&wide, &v);
            assert!((dot(&image, &u) - x).abs() < 1e-9);
        }
        assert_eq!(a.singular_values.len(), 4);
        assert_eq!(b.singular_values.len(), 4);
    }
}
