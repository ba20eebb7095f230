//! Dense column-major matrices, views into borrowed storage, and the products between them.
//!
//! Every product here is a reference: each output element is summed in one fixed order, so the bits
//! depend neither on the instruction set nor on how callers split the columns over threads. Bakes use
//! these products; frames have kernels of their own ([`tiles`](crate::simd::tiles)).

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Mul, Range};

/// The number types of matrices: `f32` at run time, `f64` in bakes.
pub trait Real:
    Copy
    + Default
    + PartialEq
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Mul<Output = Self>
    + AddAssign
    + 'static
{
    /// Rounds to this type.
    fn from_f64(value: f64) -> Self;
    /// Widens to `f64`, exactly.
    fn to_f64(self) -> f64;
}

impl Real for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}

/// An owned column-major matrix: element (row, column) is `data[column * rows + row]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrix<T> {
    rows: usize,
    columns: usize,
    data: Vec<T>,
}

/// A borrowed column-major matrix with no gap between columns.
#[derive(Clone, Copy, Debug)]
pub struct MatrixView<'a, T> {
    rows: usize,
    columns: usize,
    data: &'a [T],
}

impl<T: Real> Matrix<T> {
    /// A rows x columns matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            data: vec![T::default(); rows * columns],
        }
    }

    /// The identity of the given size.
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |i, j| {
            T::from_f64(if i == j { 1.0 } else { 0.0 })
        })
    }

    /// The rows x columns matrix whose elements are `f(row, column)`.
    pub fn from_fn(rows: usize, columns: usize, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(rows * columns);
        for j in 0..columns {
            for i in 0..rows {
                data.push(f(i, j));
            }
        }
        Self {
            rows,
            columns,
            data,
        }
    }

    /// Takes ownership of column-major elements.
    ///
    /// # Panics
    /// If `data.len() != rows * columns`.
    pub fn from_column_major(rows: usize, columns: usize, data: Vec<T>) -> Self {
        assert_eq!(data.len(), rows * columns, "storage of {rows} x {columns}");
        Self {
            rows,
            columns,
            data,
        }
    }

    /// Places columns side by side.
    ///
    /// # Panics
    /// If a column does not have `rows` entries.
    pub fn from_columns<C: AsRef<[T]>>(rows: usize, columns: &[C]) -> Self {
        let mut data = Vec::with_capacity(rows * columns.len());
        for column in columns {
            assert_eq!(column.as_ref().len(), rows, "column length");
            data.extend_from_slice(column.as_ref());
        }
        Self {
            rows,
            columns: columns.len(),
            data,
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }
    /// Column-major elements.
    pub fn data(&self) -> &[T] {
        &self.data
    }
    /// Column-major elements, mutable.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }
    /// Column `j`.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn column(&self, j: usize) -> &[T] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }
    /// The whole matrix, borrowed.
    pub fn view(&self) -> MatrixView<'_, T> {
        MatrixView {
            rows: self.rows,
            columns: self.columns,
            data: &self.data,
        }
    }
    /// A range of columns, borrowed.
    ///
    /// # Panics
    /// If the range ends beyond the last column.
    pub fn columns_view(&self, range: Range<usize>) -> MatrixView<'_, T> {
        MatrixView {
            rows: self.rows,
            columns: range.len(),
            data: &self.data[range.start * self.rows..range.end * self.rows],
        }
    }
    /// The transpose, as a copy.
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self[(j, i)])
    }
    /// A copy of the first `count` columns.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn leading_columns(&self, count: usize) -> Self {
        Self::from_column_major(self.rows, count, self.data[..count * self.rows].to_vec())
    }
    /// A copy with column j multiplied by `scales[j]`.
    ///
    /// # Panics
    /// If there is not one scale for each column.
    pub fn scaled_columns(&self, scales: &[T]) -> Self {
        assert_eq!(scales.len(), self.columns, "one scale a column");
        Self::from_fn(self.rows, self.columns, |i, j| self[(i, j)] * scales[j])
    }
    /// A copy of the rows with the given indices, in the given order.
    ///
    /// # Panics
    /// If a row does not exist.
    pub fn selected_rows(&self, rows: &[usize]) -> Self {
        Self::from_fn(rows.len(), self.columns, |i, j| self[(rows[i], j)])
    }
    /// A copy with every element converted to another number type.
    pub fn cast<S: Real>(&self) -> Matrix<S> {
        Matrix {
            rows: self.rows,
            columns: self.columns,
            data: self.data.iter().map(|x| S::from_f64(x.to_f64())).collect(),
        }
    }
    /// Root of the sum of squares of all elements.
    pub fn frobenius_norm(&self) -> f64 {
        self.data
            .iter()
            .map(|x| x.to_f64() * x.to_f64())
            .sum::<f64>()
            .sqrt()
    }
}

impl<T> std::ops::Index<(usize, usize)> for Matrix<T> {
    type Output = T;
    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.data[j * self.rows + i]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Matrix<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        &mut self.data[j * self.rows + i]
    }
}

impl<'a, T: Real> MatrixView<'a, T> {
    /// Borrows column-major elements.
    ///
    /// # Panics
    /// If `data.len() != rows * columns`.
    pub fn new(rows: usize, columns: usize, data: &'a [T]) -> Self {
        assert_eq!(data.len(), rows * columns, "storage of {rows} x {columns}");
        Self {
            rows,
            columns,
            data,
        }
    }
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }
    /// Column `j`.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn column(&self, j: usize) -> &'a [T] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }
    /// Column-major elements.
    pub fn data(&self) -> &'a [T] {
        self.data
    }
}

/// `out += a * b`, where `out` is column-major and `a.rows()` x `b.columns()`.
///
/// Each element adds its products in the order of `a`'s columns.
///
/// # Panics
/// If the shapes do not fit.
pub fn multiply_add<T: Real>(a: MatrixView<T>, b: MatrixView<T>, out: &mut [T]) {
    assert_eq!(a.columns, b.rows, "inner dimensions");
    assert_eq!(out.len(), a.rows * b.columns, "output storage");
    if a.rows == 0 {
        return;
    }
    for (j, out_column) in out.chunks_exact_mut(a.rows).enumerate() {
        let weights = b.column(j);
        let mut k = 0;
        while k + 4 <= a.columns {
            let (a0, a1) = (a.column(k), a.column(k + 1));
            let (a2, a3) = (a.column(k + 2), a.column(k + 3));
            let (w0, w1, w2, w3) = (weights[k], weights[k + 1], weights[k + 2], weights[k + 3]);
            for ((((o, &x0), &x1), &x2), &x3) in
                out_column.iter_mut().zip(a0).zip(a1).zip(a2).zip(a3)
            {
                *o = (((*o + x0 * w0) + x1 * w1) + x2 * w2) + x3 * w3;
            }
            k += 4;
        }
        for (k, &w) in weights.iter().enumerate().skip(k) {
            for (o, &x) in out_column.iter_mut().zip(a.column(k)) {
                *o += x * w;
            }
        }
    }
}

/// The product `a * b`.
///
/// # Panics
/// If the shapes do not fit.
pub fn multiply<T: Real>(a: MatrixView<T>, b: MatrixView<T>) -> Matrix<T> {
    let mut out = Matrix::zeros(a.rows, b.columns);
    multiply_add(a, b, &mut out.data);
    out
}

/// The product `aᵀ * b`: a matrix of [`dot`] products of columns.
///
/// # Panics
/// If the shapes do not fit.
pub fn transpose_multiply<T: Real>(a: MatrixView<T>, b: MatrixView<T>) -> Matrix<T> {
    assert_eq!(a.rows, b.rows, "inner dimensions");
    Matrix::from_fn(a.columns, b.columns, |i, j| dot(a.column(i), b.column(j)))
}

/// Scalar product, in eight interleaved partial sums that are then added pairwise. The order is part of
/// the definition; a vector unit of any width can follow it.
///
/// # Panics
/// If the lengths differ.
pub fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    const LANES: usize = 8;
    assert_eq!(a.len(), b.len(), "vector lengths");
    let mut sums = [T::default(); LANES];
    let (a_lanes, b_lanes) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let tails = a_lanes.remainder().iter().zip(b_lanes.remainder());
    for (x, y) in a_lanes.zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += x[lane] * y[lane];
        }
    }
    for (lane, (&x, &y)) in tails.enumerate() {
        sums[lane] += x * y;
    }
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two matrices of small integers that can be multiplied.
    fn small() -> impl Strategy<Value = (Matrix<f64>, Matrix<f64>)> {
        (1usize..12, 1usize..12, 1usize..12).prop_flat_map(|(m, k, n)| {
            let entries = |count| prop::collection::vec(-8i32..8, count);
            (entries(m * k), entries(k * n)).prop_map(move |(a, b)| {
                let of = |v: Vec<i32>| v.into_iter().map(f64::from).collect();
                (
                    Matrix::from_column_major(m, k, of(a)),
                    Matrix::from_column_major(k, n, of(b)),
                )
            })
        })
    }

    proptest! {
        /// Small integers multiply and add exactly, so equality needs no tolerance.
        #[test]
        fn products_equal_the_definition((a, b) in small()) {
            let product = multiply(a.view(), b.view());
            for i in 0..a.rows() {
                for j in 0..b.columns() {
                    let sum: f64 = (0..a.columns()).map(|k| a[(i, k)] * b[(k, j)]).sum();
                    prop_assert_eq!(product[(i, j)], sum);
                }
            }
            prop_assert_eq!(&transpose_multiply(a.transposed().view(), b.view()), &product);
        }
    }

    #[test]
    fn splitting_columns_keeps_the_bits() {
        let a = Matrix::from_fn(7, 9, |i, j| ((i * 31 + j * 17) % 13) as f32 * 0.37);
        let b = Matrix::from_fn(9, 5, |i, j| ((i * 7 + j * 3) % 11) as f32 * 0.11);
        let whole = multiply(a.view(), b.view());
        for j in 0..b.columns() {
            let part = multiply(a.view(), b.columns_view(j..j + 1));
            assert_eq!(part.data(), whole.column(j));
        }
    }
}
