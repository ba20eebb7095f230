//! Products with tiles of a matrix.

use crate::instructions::run;
use crate::numbers::{ExactSum, Number, exact_small, light, small};
use divan::{Bencher, black_box, counter::ItemsCount};
use mrt_core::simd::tiles::{
    CHANNELS, ColumnLists, HALF_TILE, Rgb, TILE, Term, TileOut, sum_half_tile, sum_tile,
};
use mrt_core::simd::{Aligned, Kernel, Lanes};

/// Columns of tiles, as they occur: coefficients of one class, of a block, of several blocks.
const COLUMNS: [usize; 5] = [8, 16, 32, 64, 256];

/// Red, green and blue of a tile.
pub type TileSums = [[f32; TILE]; CHANNELS];

/// The sums as a kernel writes them.
pub fn tile_out(sums: &mut TileSums) -> TileOut<'_> {
    sums.each_mut().map(|channel| &mut channel[..])
}

/// Operands of the kernels.
struct TileProduct<E> {
    is_half: bool,
    panel: Aligned<E>,
    lists: ColumnLists,
    x: Aligned<f32>,
    columns: usize,
}

impl<E: Number> TileProduct<E> {
    fn new(is_half: bool, columns: usize) -> TileProduct<E> {
        let rows = if is_half { HALF_TILE } else { TILE };
        let mut lists = ColumnLists::default();
        lists.push(0..columns as u32);
        TileProduct {
            is_half,
            panel: (0..columns * rows).map(|k| E::of(small(k))).collect(),
            lists,
            x: light(CHANNELS * columns),
            columns,
        }
    }

    fn rows(&self) -> usize {
        self.panel.len() / self.columns
    }

    fn check(&self, sums: &TileSums) {
        let rows = self.rows();
        for (channel, sums) in sums.iter().enumerate() {
            let x = &self.x[channel * self.columns..][..self.columns];
            for (row, &found) in sums.iter().enumerate().take(rows) {
                let term = |(k, &x): (usize, &f32)| exact_small(k * rows + row) * f64::from(x);
                ExactSum::of(x.iter().enumerate().map(term)).check(found);
            }
        }
    }
}

struct RunTile<'a, E>(&'a TileProduct<E>, &'a mut TileSums);

impl<E: Number> Kernel for RunTile<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let (product, sums) = (self.0, tile_out(self.1));
        let term = std::iter::once(Term {
            panel: &product.panel,
            columns: product.lists.get(0..product.columns),
            x: Rgb::new(&product.x, product.columns),
            scales: &[],
        });
        if product.is_half {
            sum_half_tile(l, term, None, sums);
        } else {
            sum_tile(l, term, None, sums);
        }
    }
}

fn bench_tile<E: Number>(bencher: Bencher, is_half: bool, columns: usize) {
    let product = TileProduct::<E>::new(is_half, columns);
    let mut sums = [[0.0; TILE]; CHANNELS];
    run(RunTile(&product, &mut sums));
    product.check(&sums);
    bencher
        .counter(ItemsCount::new(product.panel.len() * CHANNELS))
        .bench_local(|| run(RunTile(black_box(&product), black_box(&mut sums))));
}

#[divan::bench(name = "sum_tile", types = [f32, u16, i8], args = COLUMNS)]
fn whole_tile<E: Number>(bencher: Bencher, columns: usize) {
    bench_tile::<E>(bencher, false, columns);
}

#[divan::bench(name = "sum_half_tile", types = [f32, u16, i8], args = COLUMNS)]
fn half_tile<E: Number>(bencher: Bencher, columns: usize) {
    bench_tile::<E>(bencher, true, columns);
}
