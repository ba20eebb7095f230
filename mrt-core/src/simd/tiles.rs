//! Products of small matrices with three right-hand sides: red, green and blue.
//!
//! A matrix with many rows is packed in **tiles** of [`TILE`] rows (or half as many), column after column, and a product
//! keeps a tile's sums in registers while it runs through the columns. One with many columns and few rows is packed row
//! by row, and a product keeps a sum of vectors for each row and channel.
//!
//! Functions here are parts of kernels: inlined into them, they get the instructions of their lanes.

#![allow(
    unsafe_code,
    reason = "bounds are checked once a call, not once a number"
)]

use super::Lanes;
use std::ops::Range;

/// Rows of a tile.
pub const TILE: usize = 16;

/// Rows of a half tile, for what would leave more than half of a tile empty.
pub const HALF_TILE: usize = 8;

/// Channels of every right-hand side.
pub const CHANNELS: usize = 3;

/// A number as operators are stored.
pub trait Element: Copy + Send + Sync + 'static {
    /// Bytes of one.
    const BYTES: usize = size_of::<Self>();
    /// Loads `L::N` of them as `f32`, without scale.
    fn load<L: Lanes>(lanes: L, from: &[Self]) -> L::V;
}

impl Element for f32 {
    #[inline(always)]
    fn load<L: Lanes>(lanes: L, from: &[f32]) -> L::V {
        lanes.load(from)
    }
}

/// Half-precision numbers by their bits.
impl Element for u16 {
    #[inline(always)]
    fn load<L: Lanes>(lanes: L, from: &[u16]) -> L::V {
        lanes.load_f16(from)
    }
}

impl Element for i8 {
    #[inline(always)]
    fn load<L: Lanes>(lanes: L, from: &[i8]) -> L::V {
        lanes.load_i8(from)
    }
}

/// Right-hand sides: three vectors of equal length.
#[derive(Clone, Copy, Debug)]
pub struct Rgb<'a> {
    values: &'a [f32],
    stride: usize,
}

impl<'a> Rgb<'a> {
    /// Red, then green, then blue, each a third of the slice.
    pub fn new(values: &'a [f32]) -> Self {
        Self {
            values,
            stride: values.len() / CHANNELS,
        }
    }

    /// Numbers a channel.
    pub fn len(&self) -> usize {
        self.stride
    }

    /// True without numbers.
    pub fn is_empty(&self) -> bool {
        self.stride == 0
    }
}

/// Lists of columns that panels hold; all are checked once, when they are added.
#[derive(Clone, Debug, Default)]
pub struct ColumnLists {
    indices: Vec<u16>,
    /// Above every index.
    limit: usize,
}

/// One of [`ColumnLists`].
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    indices: &'a [u16],
    limit: usize,
}

impl ColumnLists {
    /// Adds a list; [`ColumnLists::get`] takes the range that it returns.
    pub fn push(&mut self, columns: impl IntoIterator<Item = u16>) -> Range<usize> {
        let start = self.indices.len();
        self.indices.extend(columns);
        let largest = self.indices[start..].iter().copied().max();
        self.limit = self.limit.max(largest.map_or(0, |k| usize::from(k) + 1));
        start..self.indices.len()
    }

    /// The indices in a range.
    #[inline(always)]
    pub fn get(&self, range: Range<usize>) -> Columns<'_> {
        Columns {
            indices: &self.indices[range],
            limit: self.limit,
        }
    }

    /// Number of indices in all lists.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// Bytes of the indices.
    pub fn bytes(&self) -> usize {
        size_of_val(self.indices.as_slice())
    }
}

impl Columns<'_> {
    /// Their indices.
    pub fn indices(&self) -> &[u16] {
        self.indices
    }
}

/// The sums of one tile: channel by channel, [`TILE`] rows each; a half tile uses the first [`HALF_TILE`].
pub type TileSums = [[f32; TILE]; CHANNELS];

/// `sums += panel * x[columns]`, for a tile of [`TILE`] rows whose columns are those that `columns` names.
///
/// # Panics
/// If the panel does not have a tile of numbers for each column, or `x` is shorter than any of the lists allows.
#[inline(always)]
pub fn add_tile<L: Lanes, E: Element>(
    l: L,
    panel: &[E],
    columns: Columns<'_>,
    x: Rgb<'_>,
    sums: &mut TileSums,
) {
    let panels = [panel];
    match L::N {
        4 => add_rows::<L, E, 1, 4, 1, TILE>(l, panels, columns, x, [sums]),
        8 => add_rows::<L, E, 1, 2, 2, TILE>(l, panels, columns, x, [sums]),
        16 => add_rows::<L, E, 1, 1, 4, TILE>(l, panels, columns, x, [sums]),
        _ => add_rows_one_by_one::<L, E, TILE>(l, panel, columns, x, sums),
    }
}

/// [`add_tile`] for two tiles with the same columns: half the loads of `x`.
///
/// # Panics
/// As [`add_tile`].
#[inline(always)]
pub fn add_two_tiles<L: Lanes, E: Element>(
    l: L,
    panels: [&[E]; 2],
    columns: Columns<'_>,
    x: Rgb<'_>,
    sums: [&mut TileSums; 2],
) {
    match L::N {
        8 => add_rows::<L, E, 2, 2, 1, TILE>(l, panels, columns, x, sums),
        16 => add_rows::<L, E, 2, 1, 2, TILE>(l, panels, columns, x, sums),
        // Four lanes would need more registers than there are.
        _ => {
            let [first, second] = sums;
            add_tile(l, panels[0], columns, x, first);
            add_tile(l, panels[1], columns, x, second);
        }
    }
}

/// [`add_tile`] for a tile of [`HALF_TILE`] rows.
///
/// # Panics
/// As [`add_tile`].
#[inline(always)]
pub fn add_half_tile<L: Lanes, E: Element>(
    l: L,
    panel: &[E],
    columns: Columns<'_>,
    x: Rgb<'_>,
    sums: &mut TileSums,
) {
    let l = l.narrow();
    let panels = [panel];
    match <L::Narrow as Lanes>::N {
        4 => add_rows::<_, E, 1, 2, 2, HALF_TILE>(l, panels, columns, x, [sums]),
        8 => add_rows::<_, E, 1, 1, 4, HALF_TILE>(l, panels, columns, x, [sums]),
        _ => add_rows_one_by_one::<_, E, HALF_TILE>(l, panel, columns, x, sums),
    }
}

/// `VECTORS` vectors make the `ROWS` of each of `PANELS` panels; `SETS` columns go to sums of their own, so that enough
/// products are under way at once to hide the time that each takes (twelve, for every level).
#[inline(always)]
fn add_rows<
    L: Lanes,
    E: Element,
    const PANELS: usize,
    const VECTORS: usize,
    const SETS: usize,
    const ROWS: usize,
>(
    l: L,
    panels: [&[E]; PANELS],
    columns: Columns<'_>,
    x: Rgb<'_>,
    sums: [&mut TileSums; PANELS],
) {
    let count = columns.indices.len();
    assert!(VECTORS * L::N == ROWS && columns.limit <= x.stride);
    for panel in panels {
        assert!(panel.len() >= count * ROWS);
    }
    let mut acc = [[[[l.splat(0.0); VECTORS]; CHANNELS]; PANELS]; SETS];
    let whole = count / SETS * SETS;
    let mut k = 0;
    while k < whole {
        for (set, acc) in acc.iter_mut().enumerate() {
            // SAFETY: k + set < count, and all else was checked above.
            unsafe {
                add_column::<L, E, PANELS, VECTORS, ROWS>(l, panels, columns, k + set, x, acc)
            };
        }
        k += SETS;
    }
    while k < count {
        // SAFETY: as above.
        unsafe { add_column::<L, E, PANELS, VECTORS, ROWS>(l, panels, columns, k, x, &mut acc[0]) };
        k += 1;
    }
    for (panel, sums) in sums.into_iter().enumerate() {
        for channel in 0..CHANNELS {
            for v in 0..VECTORS {
                let mut sum = acc[0][panel][channel][v];
                for other in &acc[1..] {
                    sum = l.add(sum, other[panel][channel][v]);
                }
                let at = &mut sums[channel][v * L::N..(v + 1) * L::N];
                let before = l.load(at);
                l.store(at, l.add(before, sum));
            }
        }
    }
}

/// `acc += panel[k] * x[columns[k]]`.
///
/// # Safety
/// `k` is below the number of columns, each panel has `ROWS` numbers for each of them, `VECTORS` vectors make `ROWS`, and
/// `x` is as long as the columns' limit.
#[inline(always)]
unsafe fn add_column<
    L: Lanes,
    E: Element,
    const PANELS: usize,
    const VECTORS: usize,
    const ROWS: usize,
>(
    l: L,
    panels: [&[E]; PANELS],
    columns: Columns<'_>,
    k: usize,
    x: Rgb<'_>,
    acc: &mut [[[L::V; VECTORS]; CHANNELS]; PANELS],
) {
    // SAFETY: the caller's promises; `Rgb` has three times its stride.
    let (red, green, blue) = unsafe {
        let column = usize::from(*columns.indices.get_unchecked(k));
        let at = |channel: usize| *x.values.get_unchecked(channel * x.stride + column);
        (at(0), at(1), at(2))
    };
    let x = [l.splat(red), l.splat(green), l.splat(blue)];
    for (panel, acc) in panels.iter().zip(acc) {
        #[allow(
            clippy::needless_range_loop,
            reason = "iterators may not be inlined with their lanes"
        )]
        for v in 0..VECTORS {
            let at = k * ROWS + v * L::N;
            // SAFETY: the caller's promises.
            let a = E::load(l, unsafe { panel.get_unchecked(at..at + L::N) });
            for channel in 0..CHANNELS {
                acc[channel][v] = l.mul_add(a, x[channel], acc[channel][v]);
            }
        }
    }
}

/// The reference: each sum in the order of the columns.
#[inline(always)]
fn add_rows_one_by_one<L: Lanes, E: Element, const ROWS: usize>(
    l: L,
    panel: &[E],
    columns: Columns<'_>,
    x: Rgb<'_>,
    sums: &mut TileSums,
) {
    assert!(L::N == 1 && panel.len() >= columns.indices.len() * ROWS);
    assert!(columns.limit <= x.stride);
    for (channel, sums) in sums.iter_mut().enumerate() {
        let x = &x.values[channel * x.stride..];
        for (row, sum) in sums[..ROWS].iter_mut().enumerate() {
            let mut acc = l.splat(0.0);
            for (k, &column) in columns.indices.iter().enumerate() {
                let a = E::load(l, &panel[k * ROWS + row..]);
                acc = l.mul_add(a, l.splat(x[usize::from(column)]), acc);
            }
            *sum += l.sum(acc);
        }
    }
}

/// Rows of a group in [`dot_rows`].
pub const DOT_ROWS: usize = 4;

/// Sums of [`DOT_ROWS`] rows of numbers times three vectors: `out[row][channel]`.
///
/// `rows` holds row after row, each as long as a vector; lengths are multiples of [`WIDEST`](super::WIDEST).
///
/// # Panics
/// If `rows` is not [`DOT_ROWS`] times as long as a vector, or that length is no multiple of the lanes.
#[inline(always)]
pub fn dot_rows<L: Lanes, E: Element>(
    l: L,
    rows: &[E],
    x: [&[f32]; CHANNELS],
) -> [[f32; CHANNELS]; DOT_ROWS] {
    let length = x[0].len();
    assert!(x.iter().all(|x| x.len() == length) && length.is_multiple_of(L::N));
    assert_eq!(rows.len(), DOT_ROWS * length, "rows");
    let mut acc = [[l.splat(0.0); CHANNELS]; DOT_ROWS];
    let mut at = 0;
    while at < length {
        let mut signal = [l.splat(0.0); CHANNELS];
        for (signal, x) in signal.iter_mut().zip(x) {
            // SAFETY: at + N <= length, since the length is a multiple of N.
            *signal = l.load(unsafe { x.get_unchecked(at..at + L::N) });
        }
        for (row, acc) in acc.iter_mut().enumerate() {
            // SAFETY: as above, in the row that starts at row * length.
            let a = unsafe { rows.get_unchecked(row * length + at..row * length + at + L::N) };
            let a = E::load(l, a);
            for (acc, &signal) in acc.iter_mut().zip(&signal) {
                *acc = l.mul_add(a, signal, *acc);
            }
        }
        at += L::N;
    }
    let mut sums = [[0.0; CHANNELS]; DOT_ROWS];
    for (sums, acc) in sums.iter_mut().zip(&acc) {
        for (sum, &acc) in sums.iter_mut().zip(acc) {
            *sum = l.sum(acc);
        }
    }
    sums
}
