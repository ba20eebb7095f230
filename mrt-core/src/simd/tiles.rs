//! Products of small matrices with three right-hand sides: red, green and blue.
//!
//! A matrix is packed in **tiles** of [`TILE`] rows (or half as many), column after column. A product
//! keeps the sums of a tile in registers while it runs through the columns. For few rows,
//! [`rows`](super::rows) is faster.
//!
//! Functions here are parts of kernels: they are inlined into a kernel and so get the instructions of
//! its lanes.

#![allow(
    unsafe_code,
    reason = "bounds are checked once a call, not once a number"
)]

use super::lanes::Lanes;
use std::ops::Range;

/// Number of rows of a tile.
pub const TILE: usize = 16;

/// Number of rows of a half tile, for rows that would leave more than half of a tile empty.
pub const HALF_TILE: usize = 8;

/// Number of channels of every right-hand side.
pub const CHANNELS: usize = 3;

/// A type of number that packed operators consist of: `f32`, half precision by its bits (`u16`), or `i8`.
pub trait PackedNumber: Copy + Send + Sync + 'static {
    /// True if columns may have scales.
    const SCALED: bool = false;
    /// Loads `L::N` numbers as `f32`, without scale.
    fn load<L: Lanes>(lanes: L, from: &[Self]) -> L::V;
}

impl PackedNumber for f32 {
    #[inline(always)]
    fn load<L: Lanes>(lanes: L, from: &[f32]) -> L::V {
        lanes.load(from)
    }
}

/// Half-precision numbers, by their bits.
impl PackedNumber for u16 {
    #[inline(always)]
    fn load<L: Lanes>(lanes: L, from: &[u16]) -> L::V {
        lanes.load_f16(from)
    }
}

impl PackedNumber for i8 {
    const SCALED: bool = true;

    #[inline(always)]
    fn load<L: Lanes>(lanes: L, from: &[i8]) -> L::V {
        lanes.load_i8(from)
    }
}

/// Right-hand sides in three channels. Number k of red, green and blue is `values[k]`,
/// `values[k + stride]` and `values[k + 2 * stride]`.
#[derive(Clone, Copy, Debug)]
pub struct Rgb<'a> {
    pub(super) values: &'a [f32],
    pub(super) stride: usize,
}

impl<'a> Rgb<'a> {
    /// Three vectors of `stride` numbers one after another: red, green and blue. More such triples may
    /// follow, and are reached by indices of `3 * stride` and above.
    ///
    /// # Panics
    /// If `stride` is larger than the number of values.
    #[inline(always)]
    pub fn new(values: &'a [f32], stride: usize) -> Self {
        // So that multiples of the stride do not wrap around.
        assert!(stride <= values.len(), "stride");
        Self { values, stride }
    }

    /// True if every index below `limit` has its three numbers.
    #[inline(always)]
    pub(super) fn has(&self, limit: usize) -> bool {
        let before_last = (CHANNELS - 1) * self.stride;
        limit == 0 || limit.saturating_add(before_last) <= self.values.len()
    }
}

/// Lists of the columns that panels have. Indices are checked once, when a list is added.
#[derive(Clone, Debug, Default)]
pub struct ColumnLists {
    indices: Vec<u32>,
    /// Larger than every index.
    limit: usize,
}

/// A list of [`ColumnLists`].
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    indices: &'a [u32],
    limit: usize,
}

impl ColumnLists {
    /// Adds a list, and returns the range by which [`ColumnLists::get`] finds it.
    pub fn push(&mut self, columns: impl IntoIterator<Item = u32>) -> Range<usize> {
        let start = self.indices.len();
        self.indices.extend(columns);
        let largest = self.indices[start..].iter().copied().max();
        self.limit = self
            .limit
            .max(largest.map_or(0, |k| (k as usize).saturating_add(1)));
        start..self.indices.len()
    }

    /// The list in a range.
    ///
    /// # Panics
    /// If the range ends beyond [`ColumnLists::len`].
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

    /// True if no list has an index.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// Bytes of the indices.
    pub fn bytes(&self) -> usize {
        size_of_val(self.indices.as_slice())
    }
}

impl Columns<'_> {
    /// Which numbers of a right-hand side the columns belong to.
    pub fn indices(&self) -> &[u32] {
        self.indices
    }
}

/// Where the sums of a tile go: by channel, at least as many numbers as the tile has rows.
pub type TileOut<'a> = [&'a mut [f32]; CHANNELS];

/// A panel of a tile's columns, and the vectors that it is multiplied by.
#[derive(Clone, Copy, Debug)]
pub struct Term<'a, E> {
    /// Numbers of the tile, column after column.
    pub panel: &'a [E],
    /// Which numbers of `x` the columns belong to.
    pub columns: Columns<'a>,
    /// The right-hand sides.
    pub x: Rgb<'a>,
    /// For `i8`: empty, or one factor for each column. Ignored for other numbers.
    pub scales: &'a [f32],
}

impl<E: Copy> Term<'_, E> {
    /// Checks that the panel has `rows` numbers for each column, and `x` a number for it.
    #[inline(always)]
    fn assert_fits(&self, rows: usize) {
        let count = self.columns.indices.len();
        assert!(self.x.has(self.columns.limit));
        assert!(self.scales.is_empty() || self.scales.len() >= count);
        assert!(self.panel.len() >= count * rows);
    }
}

/// How the sums of a tile or half tile are finished before they are written:
/// `sums * scale * factors + own`.
#[derive(Clone, Copy, Debug)]
pub struct Finish<'a> {
    /// Factor of all rows.
    pub scale: f32,
    /// Factors by row.
    pub factors: &'a [f32],
    /// Numbers to add, by channel and row.
    pub own: [&'a [f32]; CHANNELS],
}

impl Finish<'_> {
    /// Finishes one vector of rows.
    #[inline(always)]
    fn apply<L: Lanes>(&self, l: L, channel: usize, row: usize, sum: L::V) -> L::V {
        let factor = l.mul(l.splat(self.scale), l.load(&self.factors[row..]));
        l.mul_add(sum, factor, l.load(&self.own[channel][row..]))
    }
}

/// `sums = panel * x[columns]`, added up over all terms, for a tile of [`TILE`] rows.
///
/// # Panics
/// If a panel has less than a tile of numbers for each column, `x` is shorter than the lists of columns
/// ask for, or anything in `finish` has fewer rows than the tile.
#[inline(always)]
pub fn sum_tile<'a, L: Lanes, E: PackedNumber>(
    l: L,
    terms: impl Iterator<Item = Term<'a, E>>,
    finish: Option<Finish<'_>>,
    sums: TileOut<'_>,
) {
    match L::N {
        4 => sum_rows::<L, E, 4, 1, TILE>(l, terms, finish, sums),
        8 => sum_rows::<L, E, 2, 2, TILE>(l, terms, finish, sums),
        16 => sum_rows::<L, E, 1, 2, TILE>(l, terms, finish, sums),
        _ => sum_rows_one_by_one::<L, E, TILE>(l, terms, finish, sums),
    }
}

/// [`sum_tile`] for a tile of [`HALF_TILE`] rows.
///
/// # Panics
/// As [`sum_tile`].
#[inline(always)]
pub fn sum_half_tile<'a, L: Lanes, E: PackedNumber>(
    l: L,
    terms: impl Iterator<Item = Term<'a, E>>,
    finish: Option<Finish<'_>>,
    sums: TileOut<'_>,
) {
    let l = l.narrow();
    match <L::Narrow as Lanes>::N {
        4 => sum_rows::<_, E, 2, 2, HALF_TILE>(l, terms, finish, sums),
        8 => sum_rows::<_, E, 1, 2, HALF_TILE>(l, terms, finish, sums),
        _ => sum_rows_one_by_one::<_, E, HALF_TILE>(l, terms, finish, sums),
    }
}

/// `VECTORS` vectors hold the `ROWS` rows of a panel. Every `SETS` columns add to sums of their own, so
/// that enough products are under way at once to hide the latency of each.
#[inline(always)]
fn sum_rows<
    'a,
    L: Lanes,
    E: PackedNumber,
    const VECTORS: usize,
    const SETS: usize,
    const ROWS: usize,
>(
    l: L,
    terms: impl Iterator<Item = Term<'a, E>>,
    finish: Option<Finish<'_>>,
    sums: TileOut<'_>,
) {
    assert_eq!(VECTORS * L::N, ROWS);
    let mut acc = [[[l.splat(0.0); VECTORS]; CHANNELS]; SETS];
    for term in terms {
        let count = term.columns.indices.len();
        term.assert_fits(ROWS);
        let whole = count / SETS * SETS;
        let mut k = 0;
        if E::SCALED && !term.scales.is_empty() {
            while k < count {
                // SAFETY: k < count, and all else was checked above.
                unsafe {
                    let scale = *term.scales.get_unchecked(k);
                    add_column::<L, E, VECTORS, ROWS>(l, term, k, scale, &mut acc[0]);
                }
                k += 1;
            }
        }
        while k < whole {
            for (set, acc) in acc.iter_mut().enumerate() {
                // SAFETY: k + set < count, and all else was checked above.
                unsafe { add_column::<L, E, VECTORS, ROWS>(l, term, k + set, 1.0, acc) };
            }
            k += SETS;
        }
        while k < count {
            // SAFETY: k < count, and all else was checked above.
            unsafe { add_column::<L, E, VECTORS, ROWS>(l, term, k, 1.0, &mut acc[0]) };
            k += 1;
        }
    }
    for (channel, out) in sums.into_iter().enumerate() {
        let out = &mut out[..ROWS];
        for v in 0..VECTORS {
            let mut sum = acc[0][channel][v];
            for other in &acc[1..] {
                sum = l.add(sum, other[channel][v]);
            }
            let at = v * L::N;
            if let Some(finish) = &finish {
                sum = finish.apply(l, channel, at, sum);
            }
            l.store(&mut out[at..at + L::N], sum);
        }
    }
}

/// `acc += panel[k] * scale * x[columns[k]]`; numbers that have no scales ignore it.
///
/// # Safety
/// `k` is below the number of columns, the panel has `ROWS` numbers for each of them, `VECTORS` vectors
/// hold `ROWS` numbers, and `x` has three numbers for every index below the columns' limit.
#[inline(always)]
unsafe fn add_column<L: Lanes, E: PackedNumber, const VECTORS: usize, const ROWS: usize>(
    l: L,
    term: Term<'_, E>,
    k: usize,
    scale: f32,
    acc: &mut [[L::V; VECTORS]; CHANNELS],
) {
    let x = term.x;
    // SAFETY: the caller's promises.
    let (red, green, blue) = unsafe {
        let column = *term.columns.indices.get_unchecked(k) as usize;
        let at = |channel: usize| *x.values.get_unchecked(channel * x.stride + column);
        (at(0), at(1), at(2))
    };
    let x = if E::SCALED {
        [red * scale, green * scale, blue * scale]
    } else {
        [red, green, blue]
    };
    let mut a = [l.splat(0.0); VECTORS];
    for (v, a) in a.iter_mut().enumerate() {
        let at = k * ROWS + v * L::N;
        // SAFETY: the caller's promises.
        *a = E::load(l, unsafe { term.panel.get_unchecked(at..at + L::N) });
    }
    // One channel after another: with eight lanes, only one number of `x` fits in the registers beside
    // two sets of sums.
    for channel in 0..CHANNELS {
        let x = l.splat(x[channel]);
        for v in 0..VECTORS {
            acc[channel][v] = l.mul_add(a[v], x, acc[channel][v]);
        }
    }
}

/// The reference: each sum in the order of the columns.
#[inline(always)]
fn sum_rows_one_by_one<'a, L: Lanes, E: PackedNumber, const ROWS: usize>(
    l: L,
    terms: impl Iterator<Item = Term<'a, E>>,
    finish: Option<Finish<'_>>,
    sums: TileOut<'_>,
) {
    assert_eq!(L::N, 1);
    let [red, green, blue] = sums;
    let mut sums = [&mut red[..ROWS], &mut green[..ROWS], &mut blue[..ROWS]];
    for sums in &mut sums {
        sums.fill(0.0);
    }
    for Term {
        panel,
        columns,
        x,
        scales,
    } in terms
    {
        let panel = &panel[..columns.indices.len() * ROWS];
        for (channel, sums) in sums.iter_mut().enumerate() {
            let x = &x.values[channel * x.stride..];
            for (row, sum) in sums.iter_mut().enumerate() {
                let mut acc = l.splat(0.0);
                for (k, &column) in columns.indices.iter().enumerate() {
                    let a = E::load(l, &panel[k * ROWS + row..]);
                    let scale = scales.get(k).copied().unwrap_or(1.0);
                    acc = l.mul_add(a, l.splat(x[column as usize] * scale), acc);
                }
                *sum += l.sum(acc);
            }
        }
    }
    if let Some(finish) = &finish {
        for (channel, sums) in sums.iter_mut().enumerate() {
            for (row, sum) in sums.iter_mut().enumerate() {
                *sum = l.sum(finish.apply(l, channel, row, l.splat(*sum)));
            }
        }
    }
}
