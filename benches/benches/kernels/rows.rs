//! Products with rows of a matrix.

use crate::instructions::run;
use crate::numbers::{ExactSum, Number, channels, exact_small, light, small};
use divan::{Bencher, black_box, counter::ItemsCount};
use mrt_core::simd::rows::{DOT_ROWS, dot_rows};
use mrt_core::simd::tiles::{CHANNELS, PackedNumber};
use mrt_core::simd::{Aligned, Kernel, Lanes};

struct RunDots<'a, E> {
    rows: &'a [E],
    x: [&'a [f32]; CHANNELS],
}

impl<E: PackedNumber> Kernel for RunDots<'_, E> {
    type Output = [[f32; DOT_ROWS]; CHANNELS];
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Self::Output {
        dot_rows(l, DOT_ROWS, self.rows, self.x)
    }
}

/// Lengths are orbits of texels: of a mobile straight, of a standard corner, of one and a half standard straights, and
/// all texels of a standard straight.
#[divan::bench(name = "dot_rows", types = [f32, u16, i8], args = [32, 128, 192, 1536])]
fn dots<E: Number>(bencher: Bencher, length: usize) {
    let rows: Aligned<E> = (0..DOT_ROWS * length).map(|k| E::of(small(k))).collect();
    let light = light(CHANNELS * length);
    let (rows, x) = (&rows[..], channels(&light));
    let sums = run(RunDots { rows, x });
    for (x, sums) in x.iter().zip(sums) {
        for (row, found) in sums.into_iter().enumerate() {
            let term = |(k, &x): (usize, &f32)| exact_small(row * length + k) * f64::from(x);
            ExactSum::of(x.iter().enumerate().map(term)).check(found);
        }
    }
    bencher
        .counter(ItemsCount::new(DOT_ROWS * length * CHANNELS))
        .bench_local(|| {
            let rows = black_box(rows);
            run(RunDots { rows, x })
        });
}
