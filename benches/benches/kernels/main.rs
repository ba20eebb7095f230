//! The frame's kernels one by one, and the same products by libraries: `cargo bench -p mrt-benches`, with `--features
//! faer` for one library more.
//!
//! Every kernel's answer is compared with sums in `f64` before it is timed. Rates count products, not operations. The
//! fastest instructions of the machine are used, or those that the variable `MRT_SIMD` names. `u16` stands for `f16`.

#![allow(
    missing_docs,
    reason = "names of benchmarks say what they measure; the macro leaves public items behind"
)]

use divan::{Bencher, black_box, counter::ItemsCount};
use mrt_core::simd::folded::{Albedo, Basis, Folded, Reflected, Unfolded, fold, unfold};
use mrt_core::simd::rows::{DOT_ROWS, dot_rows};
use mrt_core::simd::tiles::{
    CHANNELS, ColumnLists, HALF_TILE, PackedNumber, Rgb, TILE, Term, TileOut, sum_half_tile,
    sum_tile,
};
use mrt_core::simd::{Aligned, Kernel, Lanes, SimdLevel};

/// Red, green and blue of a tile.
type TileSums = [[f32; TILE]; CHANNELS];

fn main() {
    println!("instructions: {}", level().name());
    divan::main();
}

fn level() -> SimdLevel {
    let named = std::env::var("MRT_SIMD").ok();
    named.map_or(SimdLevel::detect(), |name| {
        SimdLevel::from_name(&name)
            .filter(|level| level.is_available())
            .expect("MRT_SIMD names instructions that this machine has")
    })
}

/// Numbers as operators are stored.
trait Number: PackedNumber + bytemuck::Pod + std::fmt::Debug {
    const NAME: &'static str;
    /// A number of -8 to 8, which every storage has exactly.
    fn of(small: i8) -> Self;
}

impl Number for f32 {
    const NAME: &'static str = "f32";
    fn of(small: i8) -> f32 {
        f32::from(small)
    }
}

/// `f16` by its bits.
impl Number for u16 {
    const NAME: &'static str = "f16";
    fn of(small: i8) -> u16 {
        half::f16::from_f32_const(f32::from(small)).to_bits()
    }
}

impl Number for i8 {
    const NAME: &'static str = "i8";
    fn of(small: i8) -> i8 {
        small
    }
}

/// Numbers of -8 to 8 without a pattern that kernels could share.
fn small(k: usize) -> i8 {
    let mixed = (k as u32).wrapping_mul(2_654_435_761) >> 16;
    (mixed % 17) as i8 - 8
}

/// Light, which no storage rounds.
fn light(count: usize) -> Aligned<f32> {
    (0..count).map(|k| 0.1 + 0.01 * (k % 97) as f32).collect()
}

/// `found` is a sum in `f32` of products whose magnitudes add up to `size`.
fn check(what: &str, found: f32, exact: f64, size: f64) {
    let apart = (f64::from(found) - exact).abs();
    assert!(apart <= 1e-5 * size, "{what}: {found} instead of {exact}");
}

// ---- Tiles ----

/// Columns of tiles, as they occur: coefficients of one class, of a block, of several blocks.
const COLUMNS: [usize; 5] = [8, 16, 32, 64, 256];

/// Operands of the kernels of tiles.
struct TileProduct<E> {
    is_half: bool,
    panel: Aligned<E>,
    lists: ColumnLists,
    x: Aligned<f32>,
    columns: usize,
}

struct RunTile<'a, E>(&'a TileProduct<E>, &'a mut TileSums);

impl<E: Number> Kernel for RunTile<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let (product, sums) = (self.0, out(self.1));
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

fn out(sums: &mut TileSums) -> TileOut<'_> {
    sums.each_mut().map(|channel| &mut channel[..])
}

fn tile<E: Number>(bencher: Bencher, is_half: bool, columns: usize) {
    let rows = if is_half { HALF_TILE } else { TILE };
    let mut lists = ColumnLists::default();
    lists.push(0..columns as u32);
    let product = TileProduct {
        is_half,
        panel: (0..columns * rows).map(|k| E::of(small(k))).collect(),
        lists,
        x: light(CHANNELS * columns),
        columns,
    };
    let mut sums = [[0.0; TILE]; CHANNELS];
    level().run(RunTile(&product, &mut sums));
    for (channel, sums) in sums.iter().enumerate() {
        for (row, &found) in sums.iter().enumerate().take(rows) {
            let (mut exact, mut size) = (0.0, 0.0);
            for k in 0..columns {
                let a = f64::from(small(k * rows + row));
                let term = a * f64::from(product.x[channel * columns + k]);
                exact += term;
                size += term.abs();
            }
            check(E::NAME, found, exact, size);
        }
    }
    bencher
        .counter(ItemsCount::new(rows * columns * CHANNELS))
        .bench_local(|| level_run(RunTile(black_box(&product), black_box(&mut sums))));
}

/// [`SimdLevel::run`] with the level read once.
fn level_run<K: Kernel>(kernel: K) -> K::Output {
    static LEVEL: std::sync::OnceLock<SimdLevel> = std::sync::OnceLock::new();
    LEVEL.get_or_init(level).run(kernel)
}

#[divan::bench(name = "sum_tile", types = [f32, u16, i8], args = COLUMNS)]
fn whole_tile<E: Number>(bencher: Bencher, columns: usize) {
    tile::<E>(bencher, false, columns);
}

#[divan::bench(name = "sum_half_tile", types = [f32, u16, i8], args = COLUMNS)]
fn half_tile<E: Number>(bencher: Bencher, columns: usize) {
    tile::<E>(bencher, true, columns);
}

// ---- Rows ----

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

/// Lengths are orbits of texels: of a mobile straight, a standard corner, one and a half of a standard straight.
#[divan::bench(name = "dot_rows", types = [f32, u16, i8], args = [32, 128, 192, 1536])]
fn dots<E: Number>(bencher: Bencher, length: usize) {
    let rows: Aligned<E> = (0..DOT_ROWS * length).map(|k| E::of(small(k))).collect();
    let x = light(CHANNELS * length);
    let channels: [&[f32]; CHANNELS] = std::array::from_fn(|c| &x[c * length..(c + 1) * length]);
    let (rows, x) = (&rows[..], channels);
    let found = level_run(RunDots { rows, x });
    for (channel, found) in found.iter().enumerate() {
        for (row, &found) in found.iter().enumerate() {
            let (mut exact, mut size) = (0.0, 0.0);
            for (k, &x) in x[channel].iter().enumerate() {
                let term = f64::from(small(row * length + k)) * f64::from(x);
                exact += term;
                size += term.abs();
            }
            check(E::NAME, found, exact, size);
        }
    }
    bencher
        .counter(ItemsCount::new(DOT_ROWS * length * CHANNELS))
        .bench_local(|| {
            let rows = black_box(rows);
            level_run(RunDots { rows, x })
        });
}

// ---- Folding ----

/// Three mirrors.
const GROUP: usize = 8;

/// Orbits, one and a half times those of a standard straight.
const STRIDE: usize = 192;

/// What element `element` of the group does to class `class`.
fn sign(element: usize, class: usize) -> f64 {
    match (element & class).count_ones() % 2 {
        0 => 1.0,
        _ => -1.0,
    }
}

struct RunFold<'a> {
    light: Reflected<'a>,
    weight: &'a [f32],
    folded: &'a mut [f32],
}

impl Kernel for RunFold<'_> {
    type Output = Folded;
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Folded {
        fold::<L, GROUP>(l, self.light, self.weight, self.folded)
    }
}

const BOTH: &str = "direct and indirect";

/// Red, green and blue of a signal.
fn channels(signal: &[f32]) -> [&[f32]; CHANNELS] {
    let length = signal.len() / CHANNELS;
    std::array::from_fn(|c| &signal[c * length..(c + 1) * length])
}

#[divan::bench(name = "fold", args = ["direct", BOTH])]
fn folds(bencher: Bencher, what: &str) {
    let with_indirect = what == BOTH;
    let direct = light(CHANNELS * GROUP * STRIDE);
    let albedo: Aligned<f32> = direct.iter().rev().copied().collect();
    let weight: Aligned<f32> = (0..STRIDE).map(|_| 1.0).collect();
    let mut folded = Aligned::zeroed(CHANNELS * GROUP * STRIDE);
    let light = Reflected {
        direct: channels(&direct),
        indirect: with_indirect.then_some(channels(&direct)),
        albedo: Albedo::Each(channels(&albedo)),
        emission: None,
    };
    level_run(RunFold {
        light,
        weight: &weight,
        folded: &mut folded,
    });
    let times = if with_indirect { 2.0 } else { 1.0 };
    for class in 0..GROUP {
        for channel in 0..CHANNELS {
            for at in 0..STRIDE {
                let (mut exact, mut size) = (0.0, 0.0);
                for element in 0..GROUP {
                    let k = (channel * GROUP + element) * STRIDE + at;
                    let sent = times * f64::from(direct[k]) * f64::from(albedo[k]);
                    exact += sign(element, class) * sent;
                    size += sent;
                }
                let found = folded[(class * CHANNELS + channel) * STRIDE + at];
                check("fold", found, exact, size);
            }
        }
    }
    bencher
        .counter(ItemsCount::new(CHANNELS * GROUP * STRIDE))
        .bench_local(|| {
            level_run(RunFold {
                light: black_box(light),
                weight: &weight,
                folded: &mut folded,
            })
        });
}

/// Modes of a class, as of a standard block.
const MODES: usize = 8;

struct RunUnfold<'a, E> {
    basis: Basis<'a, E>,
    x: Rgb<'a>,
    signal: [&'a mut [f32]; CHANNELS],
}

impl<E: PackedNumber> Kernel for RunUnfold<'_, E> {
    type Output = Unfolded;
    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Unfolded {
        unfold::<L, E, GROUP, false>(l, self.basis, self.x, &mut self.signal)
    }
}

/// Products with a basis, and the sums and differences that make texels of them; products are counted.
#[divan::bench(name = "unfold", types = [f32, u16, i8])]
fn unfolds<E: Number>(bencher: Bencher) {
    let columns = GROUP * MODES;
    let tiles: Aligned<E> = (0..columns * STRIDE).map(|k| E::of(small(k))).collect();
    let classes: Vec<_> = (0..GROUP).map(|c| c * MODES..(c + 1) * MODES).collect();
    let weight: Aligned<f32> = (0..STRIDE).map(|_| 1.0).collect();
    let x = light(CHANNELS * columns);
    let mut signal = Aligned::zeroed(CHANNELS * GROUP * STRIDE);
    let run = |signal: &mut [f32]| {
        let (red, rest) = signal.split_at_mut(GROUP * STRIDE);
        let (green, blue) = rest.split_at_mut(GROUP * STRIDE);
        let basis = Basis {
            tiles: black_box(&tiles[..]),
            classes: &classes,
            weight: &weight,
        };
        let x = Rgb::new(&x, columns);
        level_run(RunUnfold {
            basis,
            x,
            signal: [red, green, blue],
        })
    };
    run(&mut signal);
    for (k, &found) in signal.iter().enumerate() {
        let (channel, k) = (k / (GROUP * STRIDE), k % (GROUP * STRIDE));
        let (element, at) = (k / STRIDE, k % STRIDE);
        let (mut exact, mut size) = (0.0, 0.0);
        for column in 0..columns {
            let number = small((at / TILE * columns + column) * TILE + at % TILE);
            let term = f64::from(number) * f64::from(x[channel * columns + column]);
            exact += sign(element, column / MODES) * term;
            size += term.abs();
        }
        check(E::NAME, found, exact.max(0.0), size);
    }
    bencher
        .counter(ItemsCount::new(CHANNELS * columns * STRIDE))
        .bench_local(|| run(&mut signal));
}

// ---- Dense products ----

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

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [m, k, n] = self.0;
        write!(f, "{m} x {k} x {n}")
    }
}

/// `out = a b`, all column-major; times `run` after a look at its answer.
fn dense(bencher: Bencher, Size([m, k, n]): Size, run: impl Fn(&[f32], &[f32], &mut [f32])) {
    let a: Vec<f32> = (0..m * k).map(|at| f32::from(small(at))).collect();
    let b = light(k * n);
    let mut out = vec![0.0; m * n];
    run(&a, &b, &mut out);
    for column in 0..n {
        for row in 0..m {
            let (mut exact, mut size) = (0.0, 0.0);
            for inner in 0..k {
                let term = f64::from(a[inner * m + row]) * f64::from(b[column * k + inner]);
                exact += term;
                size += term.abs();
            }
            check("product", out[column * m + row], exact, size);
        }
    }
    bencher
        .counter(ItemsCount::new(m * k * n))
        .bench_local(|| run(black_box(&a), black_box(&b), black_box(&mut out)));
}

/// All tiles of a matrix, two at a time, for each triple of columns.
struct TiledProduct<'a> {
    panels: &'a [f32],
    lists: &'a ColumnLists,
    size: [usize; 3],
    b: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for TiledProduct<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let [m, k, n] = self.size;
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
                sum_tile(l, std::iter::once(term), None, out(&mut sums));
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
    // As `dense` has it: rows of a tile next to each other.
    let number = |at: usize| {
        let (tile, column, row) = (at / (TILE * k), at / TILE % k, at % TILE);
        f32::from(small(column * m + tile * TILE + row))
    };
    let panels: Aligned<f32> = (0..m * k).map(number).collect();
    let mut lists = ColumnLists::default();
    lists.push(0..k as u32);
    dense(bencher, size, |_, b, out| {
        level_run(TiledProduct {
            panels: black_box(&panels),
            lists: &lists,
            size: size.0,
            b,
            out,
        });
    });
}

/// All rows of a matrix, [`DOT_ROWS`] at a time, for each triple of columns.
struct DotProduct<'a> {
    rows: &'a [f32],
    size: [usize; 3],
    b: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for DotProduct<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let [m, k, n] = self.size;
        let mut first = 0;
        while first < n {
            let column = |c: usize| &self.b[(first + c) * k..(first + c + 1) * k];
            let x = [column(0), column(1), column(2)];
            let mut row = 0;
            while row < m {
                let sums = dot_rows(l, DOT_ROWS, &self.rows[row * k..(row + DOT_ROWS) * k], x);
                for (channel, sums) in sums.iter().enumerate() {
                    let at = (first + channel) * m + row;
                    self.out[at..at + DOT_ROWS].copy_from_slice(sums);
                }
                row += DOT_ROWS;
            }
            first += CHANNELS;
        }
    }
}

/// The kernel of rows, on a matrix that was packed beforehand; lengths that it does not take are left out.
#[divan::bench(args = SIZES.into_iter().filter(|size| size.0[1].is_multiple_of(mrt_core::simd::WIDEST)))]
fn product_rows(bencher: Bencher, size: Size) {
    let Size([m, k, _]) = size;
    let rows: Aligned<f32> = (0..m * k)
        .map(|at| f32::from(small(at % k * m + at / k)))
        .collect();
    dense(bencher, size, |_, b, out| {
        level_run(DotProduct {
            rows: black_box(&rows),
            size: size.0,
            b,
            out,
        });
    });
}

#[divan::bench(args = SIZES)]
#[allow(unsafe_code, reason = "the library takes pointers")]
fn product_gemm(bencher: Bencher, size: Size) {
    let Size([m, k, n]) = size;
    dense(bencher, size, |a, b, out| {
        assert_eq!([a.len(), b.len(), out.len()], [m * k, k * n, m * n]);
        // SAFETY: the slices hold m x k, k x n and m x n numbers, and the strides stay inside them.
        unsafe {
            gemm::gemm(
                m,
                n,
                k,
                out.as_mut_ptr(),
                m as isize,
                1,
                false,
                a.as_ptr(),
                m as isize,
                1,
                b.as_ptr(),
                k as isize,
                1,
                0.0,
                1.0,
                false,
                false,
                false,
                gemm::Parallelism::None,
            );
        }
    });
}

#[divan::bench(args = SIZES)]
#[allow(unsafe_code, reason = "the library takes pointers")]
fn product_matrixmultiply(bencher: Bencher, size: Size) {
    let Size([m, k, n]) = size;
    dense(bencher, size, |a, b, out| {
        assert_eq!([a.len(), b.len(), out.len()], [m * k, k * n, m * n]);
        // SAFETY: as above.
        unsafe {
            matrixmultiply::sgemm(
                m,
                k,
                n,
                1.0,
                a.as_ptr(),
                1,
                m as isize,
                b.as_ptr(),
                1,
                k as isize,
                0.0,
                out.as_mut_ptr(),
                1,
                m as isize,
            );
        }
    });
}

#[cfg(feature = "faer")]
#[divan::bench(args = SIZES)]
fn product_faer(bencher: Bencher, size: Size) {
    use faer::{Accum, MatMut, MatRef, Par, linalg::matmul::matmul};
    let Size([m, k, n]) = size;
    dense(bencher, size, |a, b, out| {
        let a = MatRef::from_column_major_slice(a, m, k);
        let b = MatRef::from_column_major_slice(b, k, n);
        let out = MatMut::from_column_major_slice_mut(out, m, n);
        matmul(out, Accum::Replace, a, b, 1.0, Par::Seq);
    });
}
