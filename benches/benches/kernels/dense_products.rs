//! Dense products by the frame's kernels and by libraries.

use crate::instructions::run;
use crate::numbers::{ExactSum, exact_small, light, small};
use crate::tiles::tile_out;
use divan::{Bencher, black_box, counter::ItemsCount};
use mrt_benches::dense_product::{Library, Output, product};
use mrt_core::linalg::matrix::MatrixView;
use mrt_core::simd::rows::{DOT_ROWS, dot_rows};
use mrt_core::simd::tiles::{CHANNELS, ColumnLists, Rgb, TILE, Term, sum_tile};
use mrt_core::simd::{Aligned, Kernel, Lanes};
use std::fmt;

/// Rows, inner size, columns: folded and whole operators of a standard block, on one block and on 41.
const SIZES: [Size; 6] = [
    Size([32, 192, 3]),
    Size([192, 8, 3]),
    Size([32, 1536, 3]),
    Size([32, 1536, 123]),
    Size([1536, 32, 3]),
    Size([1536, 32, 123]),
];

#[derive(Clone, Copy)]
struct Size([usize; 3]);

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [m, k, n] = self.0;
        write!(f, "{m} x {k} x {n}")
    }
}

/// Checks and times `out = a b`, all column-major.
fn bench_product(
    bencher: Bencher,
    Size([m, k, n]): Size,
    multiply: impl Fn(&[f32], &[f32], &mut [f32]),
) {
    let a: Vec<f32> = (0..m * k).map(|at| f32::from(small(at))).collect();
    let b = light(k * n);
    let mut out = vec![0.0; m * n];
    multiply(&a, &b, &mut out);
    for (at, &found) in out.iter().enumerate() {
        let (column, row) = (at / m, at % m);
        let b = &b[column * k..(column + 1) * k];
        let term = |(inner, &b): (usize, &f32)| exact_small(inner * m + row) * f64::from(b);
        ExactSum::of(b.iter().enumerate().map(term)).check(found);
    }
    bencher
        .counter(ItemsCount::new(m * k * n))
        .bench_local(|| multiply(black_box(&a), black_box(&b), black_box(&mut out)));
}

/// All tiles of a matrix, for each triple of columns.
struct TiledProduct<'a> {
    panels: &'a [f32],
    lists: &'a ColumnLists,
    size: Size,
    b: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for TiledProduct<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let Size([m, k, n]) = self.size;
        let columns = self.lists.get(0..k);
        for first in (0..n).step_by(CHANNELS) {
            let x = Rgb::new(&self.b[first * k..(first + CHANNELS) * k], k);
            for row in (0..m).step_by(TILE) {
                let mut sums = [[0.0; TILE]; CHANNELS];
                let term = Term {
                    panel: &self.panels[row * k..(row + TILE) * k],
                    columns,
                    x,
                    scales: &[],
                };
                sum_tile(l, std::iter::once(term), None, tile_out(&mut sums));
                for (channel, sums) in sums.iter().enumerate() {
                    let at = (first + channel) * m + row;
                    self.out[at..at + TILE].copy_from_slice(sums);
                }
            }
        }
    }
}

/// The kernels of tiles, on a matrix that was packed beforehand.
#[divan::bench(args = SIZES)]
fn product_tiles(bencher: Bencher, size: Size) {
    let Size([m, k, _]) = size;
    // Rows of a tile are next to each other.
    let number = |at: usize| {
        let (tile, column, row) = (at / (TILE * k), at / TILE % k, at % TILE);
        f32::from(small(column * m + tile * TILE + row))
    };
    let panels: Aligned<f32> = (0..m * k).map(number).collect();
    let mut lists = ColumnLists::default();
    lists.push(0..k as u32);
    bench_product(bencher, size, |_, b, out| {
        run(TiledProduct {
            panels: black_box(&panels),
            lists: &lists,
            size,
            b,
            out,
        });
    });
}

/// All rows of a matrix, [`DOT_ROWS`] at a time, for each triple of columns.
struct DotProduct<'a> {
    rows: &'a [f32],
    size: Size,
    b: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for DotProduct<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let Size([m, k, n]) = self.size;
        for first in (0..n).step_by(CHANNELS) {
            let column = |c: usize| &self.b[(first + c) * k..(first + c + 1) * k];
            let x = [column(0), column(1), column(2)];
            for row in (0..m).step_by(DOT_ROWS) {
                let rows = &self.rows[row * k..(row + DOT_ROWS) * k];
                let sums = dot_rows(l, DOT_ROWS, rows, x);
                for (channel, sums) in sums.iter().enumerate() {
                    let at = (first + channel) * m + row;
                    self.out[at..at + DOT_ROWS].copy_from_slice(sums);
                }
            }
        }
    }
}

/// The kernel of rows, on a matrix that was packed beforehand; lengths that it does not take are left out.
#[divan::bench(args = SIZES.into_iter().filter(|size| size.0[1].is_multiple_of(mrt_core::simd::WIDEST)))]
fn product_rows(bencher: Bencher, size: Size) {
    let Size([m, k, _]) = size;
    let number = |at: usize| f32::from(small(at % k * m + at / k));
    let rows: Aligned<f32> = (0..m * k).map(number).collect();
    bench_product(bencher, size, |_, b, out| {
        run(DotProduct {
            rows: black_box(&rows),
            size,
            b,
            out,
        });
    });
}

fn bench_library(bencher: Bencher, size: Size, library: Library) {
    let Size([m, k, n]) = size;
    bench_product(bencher, size, |a, b, out| {
        let (a, b) = (MatrixView::new(m, k, a), MatrixView::new(k, n, b));
        product(library, a, b, out, Output::Replace);
    });
}

#[divan::bench(args = SIZES)]
fn product_gemm(bencher: Bencher, size: Size) {
    bench_library(bencher, size, Library::Gemm);
}

#[divan::bench(args = SIZES)]
fn product_matrixmultiply(bencher: Bencher, size: Size) {
    bench_library(bencher, size, Library::MatrixMultiply);
}

#[cfg(feature = "faer")]
#[divan::bench(args = SIZES)]
fn product_faer(bencher: Bencher, size: Size) {
    use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};
    let Size([m, k, n]) = size;
    bench_product(bencher, size, |a, b, out| {
        let a = MatRef::from_column_major_slice(a, m, k);
        let b = MatRef::from_column_major_slice(b, k, n);
        let out = MatMut::from_column_major_slice_mut(out, m, n);
        matmul(out, Accum::Replace, a, b, 1.0, Par::Seq);
    });
}
