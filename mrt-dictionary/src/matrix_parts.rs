//! Matrices put together from parts and taken apart.

use mrt_core::linalg::matrix::Matrix;
use std::ops::Range;

/// Matrices of equally many columns, one above the other.
///
/// # Panics
/// If a matrix has fewer columns than the first.
pub fn stack(parts: &[&Matrix<f64>]) -> Matrix<f64> {
    let columns = parts.first().map_or(0, |part| part.columns());
    let rows: usize = parts.iter().map(|part| part.rows()).sum();
    let mut data = Vec::with_capacity(rows * columns);
    for j in 0..columns {
        for part in parts {
            data.extend_from_slice(part.column(j));
        }
    }
    Matrix::from_column_major(rows, columns, data)
}

/// Matrices of equally many rows, one to the right of the other.
///
/// # Panics
/// If the matrices differ in their number of rows.
pub fn side_by_side(parts: &[&Matrix<f64>]) -> Matrix<f64> {
    let rows = parts.first().map_or(0, |part| part.rows());
    let columns: usize = parts.iter().map(|part| part.columns()).sum();
    let data: Vec<f64> = parts.iter().flat_map(|part| part.data()).copied().collect();
    Matrix::from_column_major(rows, columns, data)
}

/// The matrix whose rows are given in groups: each group holds `rows_per_group` rows of `columns` elements, one row after
/// the other.
pub fn from_row_groups(groups: &[Vec<f64>], rows_per_group: usize, columns: usize) -> Matrix<f64> {
    Matrix::from_fn(rows_per_group * groups.len(), columns, |i, j| {
        groups[i / rows_per_group][i % rows_per_group * columns + j]
    })
}

/// A copy of a run of rows.
pub fn rows(matrix: &Matrix<f64>, range: Range<usize>) -> Matrix<f64> {
    Matrix::from_fn(range.len(), matrix.columns(), |i, j| {
        matrix[(range.start + i, j)]
    })
}

/// A copy with row i multiplied by `scales[i]`.
pub fn scaled_rows(matrix: &Matrix<f64>, scales: &[f64]) -> Matrix<f64> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| {
        scales[i] * matrix[(i, j)]
    })
}

/// A copy with every element multiplied by one factor.
pub fn scaled(matrix: &Matrix<f64>, factor: f64) -> Matrix<f64> {
    matrix.scaled_columns(&vec![factor; matrix.columns()])
}

/// `a - b`, for matrices of one size.
pub fn difference(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)] - b[(i, j)])
}

/// `sum += term`, for matrices of one size.
pub fn add_to(sum: &mut Matrix<f64>, term: &Matrix<f64>) {
    for (s, &x) in sum.data_mut().iter_mut().zip(term.data()) {
        *s += x;
    }
}

/// The Frobenius norm of a matrix whose parts have the given norms.
pub fn root_sum_of_squares(norms: impl Iterator<Item = f64>) -> f64 {
    norms.map(|norm| norm * norm).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_found_where_they_were_put() {
        let a = Matrix::from_fn(2, 3, |i, j| (10 * i + j) as f64);
        let b = Matrix::from_fn(1, 3, |_, j| 100.0 + j as f64);
        let stacked = stack(&[&a, &b]);
        assert_eq!(rows(&stacked, 0..2), a);
        assert_eq!(rows(&stacked, 2..3), b);
        let beside = side_by_side(&[&a.transposed(), &b.transposed()]);
        assert_eq!(beside, stacked.transposed());
    }
}
