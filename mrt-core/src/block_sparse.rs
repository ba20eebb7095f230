//! A block-sparse linear operator: dense blocks at (row part, column part) of a large matrix.

use crate::matrix::{Matrix, MatrixView, Scalar, multiply_add};

/// Where one dense block stands, in elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Entry {
    row_part: u32,
    column_part: u32,
    /// Start of the block's column-major elements in the shared storage.
    start: usize,
}

/// A sparse matrix of dense blocks; rows and columns are divided into parts of given sizes.
///
/// Blocks are kept sorted by row part, then column part, and stored in that order, so a product
/// reads its storage once from front to back.
#[derive(Clone, Debug)]
pub struct BlockSparse<T> {
    row_offsets: Vec<usize>,
    column_offsets: Vec<usize>,
    entries: Vec<Entry>,
    data: Vec<T>,
}

impl<T: Scalar> BlockSparse<T> {
    /// Assembles from (row part, column part, block) in any order; blocks at one place are added in
    /// the order given.
    ///
    /// # Panics
    /// If a block's shape differs from its parts' sizes or a part does not exist.
    pub fn from_blocks(
        row_sizes: &[usize],
        column_sizes: &[usize],
        mut blocks: Vec<(usize, usize, Matrix<T>)>,
    ) -> Self {
        blocks.sort_by_key(|&(row, column, _)| (row, column));
        let mut entries: Vec<Entry> = Vec::with_capacity(blocks.len());
        let mut data: Vec<T> = Vec::new();
        for (row, column, block) in &blocks {
            assert_eq!(
                block.rows(),
                row_sizes[*row],
                "rows of block {row},{column}"
            );
            assert_eq!(
                block.columns(),
                column_sizes[*column],
                "columns of block {row},{column}"
            );
            let (row_part, column_part) = (*row as u32, *column as u32);
            match entries.last() {
                Some(e) if e.row_part == row_part && e.column_part == column_part => {
                    for (sum, &x) in data[e.start..].iter_mut().zip(block.data()) {
                        *sum += x;
                    }
                }
                _ => {
                    entries.push(Entry {
                        row_part,
                        column_part,
                        start: data.len(),
                    });
                    data.extend_from_slice(block.data());
                }
            }
        }
        Self {
            row_offsets: offsets(row_sizes),
            column_offsets: offsets(column_sizes),
            entries,
            data,
        }
    }

    /// Rows of the whole matrix.
    pub fn rows(&self) -> usize {
        self.row_offsets.last().copied().unwrap_or(0)
    }
    /// Columns of the whole matrix.
    pub fn columns(&self) -> usize {
        self.column_offsets.last().copied().unwrap_or(0)
    }
    /// Number of dense blocks stored.
    pub fn block_count(&self) -> usize {
        self.entries.len()
    }
    /// Bytes of the dense blocks.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.data.as_slice())
    }

    /// The dense blocks as (row part, column part, block).
    pub fn blocks(&self) -> impl Iterator<Item = (usize, usize, MatrixView<'_, T>)> {
        self.entries.iter().map(|entry| {
            let (row, column) = (entry.row_part as usize, entry.column_part as usize);
            let rows = self.row_offsets[row + 1] - self.row_offsets[row];
            let columns = self.column_offsets[column + 1] - self.column_offsets[column];
            let block = &self.data[entry.start..entry.start + rows * columns];
            (row, column, MatrixView::new(rows, columns, block))
        })
    }

    /// `y = self * x` for `channels` right-hand sides.
    ///
    /// Storage of `x` and `y` is part by part; within a part, channel by channel. So part p of x is the
    /// column-major matrix `column size x channels` that starts at element `offset(p) * channels`.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn multiply(&self, x: &[T], channels: usize, y: &mut [T]) {
        assert_eq!(y.len(), self.rows() * channels, "output length");
        y.fill(T::default());
        self.multiply_add(x, channels, y);
    }

    /// `y += self * x`, as [`BlockSparse::multiply`].
    fn multiply_add(&self, x: &[T], channels: usize, y: &mut [T]) {
        assert_eq!(x.len(), self.columns() * channels, "input length");
        for (row, column, block) in self.blocks() {
            let from = self.column_offsets[column] * channels;
            let to = self.row_offsets[row] * channels;
            let part = MatrixView::new(
                block.columns(),
                channels,
                &x[from..from + block.columns() * channels],
            );
            multiply_add(block, part, &mut y[to..to + block.rows() * channels]);
        }
    }

    /// `y += factor * self * x`, as [`BlockSparse::multiply`].
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn multiply_add_scaled(&self, x: &[T], channels: usize, factor: T, y: &mut [T]) {
        assert_eq!(x.len(), self.columns() * channels, "input length");
        assert_eq!(y.len(), self.rows() * channels, "output length");
        for (row, column, block) in self.blocks() {
            let from = self.column_offsets[column] * channels;
            let to = self.row_offsets[row] * channels;
            for channel in 0..channels {
                let part = &x[from + channel * block.columns()..][..block.columns()];
                let out = &mut y[to + channel * block.rows()..][..block.rows()];
                for (k, &weight) in part.iter().enumerate() {
                    let weight = factor * weight;
                    for (y, &a) in out.iter_mut().zip(block.column(k)) {
                        *y += a * weight;
                    }
                }
            }
        }
    }
}

fn offsets(sizes: &[usize]) -> Vec<usize> {
    let mut sum = 0;
    std::iter::once(0)
        .chain(sizes.iter().map(|size| {
            sum += size;
            sum
        }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_dense_product() {
        let (row_sizes, column_sizes) = ([2, 3], [1, 2, 2]);
        let block = |rows, columns, seed: usize| {
            Matrix::from_fn(rows, columns, |i, j| (seed + 3 * i + 5 * j) as f64)
        };
        let blocks = vec![
            (1, 2, block(3, 2, 4)),
            (0, 0, block(2, 1, 1)),
            (1, 2, block(3, 2, 9)),
        ];
        let mut dense: Matrix<f64> = Matrix::zeros(5, 5);
        for (row, column, part) in &blocks {
            for i in 0..part.rows() {
                for j in 0..part.columns() {
                    dense[([0, 2][*row] + i, [0, 1, 3][*column] + j)] += part[(i, j)];
                }
            }
        }
        let sparse = BlockSparse::from_blocks(&row_sizes, &column_sizes, blocks);
        assert_eq!(sparse.block_count(), 2);
        let x: Vec<f64> = (0..5).map(|k| f64::from(k) - 1.5).collect();
        let mut y = vec![f64::NAN; 5];
        sparse.multiply(&x, 1, &mut y);
        for i in 0..5 {
            let sum: f64 = (0..5).map(|j| dense[(i, j)] * x[j]).sum();
            assert_eq!(y[i], sum);
        }
    }
}
