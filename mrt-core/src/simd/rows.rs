//! Products of a few long rows of numbers with three vectors: red, green and blue.
//!
//! A product keeps a vector of sums for each row and channel. Functions here are parts of kernels, as in
//! [`tiles`](super::tiles).

#![allow(
    unsafe_code,
    reason = "bounds are checked once a call, not once a number"
)]

use super::lanes::Lanes;
use super::tiles::{CHANNELS, PackedNumber};

/// Most rows of one call of [`dot_rows`].
pub const DOT_ROWS: usize = 4;

/// Scalar products of `count` rows with three vectors: `out[channel][row]`, which is zero for
/// `row >= count`.
///
/// `rows` holds row after row, each as long as a vector. That length is a multiple of
/// [`WIDEST`](super::WIDEST).
///
/// # Panics
/// If `count` is not 1 to [`DOT_ROWS`], `rows` is not `count` times as long as a vector, or that length is
/// not a multiple of the lanes.
#[inline(always)]
pub fn dot_rows<L: Lanes, E: PackedNumber>(
    l: L,
    count: usize,
    rows: &[E],
    x: [&[f32]; CHANNELS],
) -> [[f32; DOT_ROWS]; CHANNELS] {
    match count {
        1 => dot_some_rows::<L, E, 1, 4>(l, rows, x),
        2 => dot_some_rows::<L, E, 2, 2>(l, rows, x),
        3 => dot_some_rows::<L, E, 3, 1>(l, rows, x),
        4 => dot_some_rows::<L, E, 4, 1>(l, rows, x),
        _ => panic!("{count} rows; expected 1 to {DOT_ROWS}"),
    }
}

/// Every `SETS` vectors of a row add to sums of their own, so that enough products are under way at once.
#[inline(always)]
fn dot_some_rows<L: Lanes, E: PackedNumber, const ROWS: usize, const SETS: usize>(
    l: L,
    rows: &[E],
    x: [&[f32]; CHANNELS],
) -> [[f32; DOT_ROWS]; CHANNELS] {
    let length = x[0].len();
    assert!(x.iter().all(|x| x.len() == length) && length.is_multiple_of(L::N));
    assert_eq!(rows.len(), ROWS * length, "rows");
    let mut acc = [[[l.splat(0.0); CHANNELS]; ROWS]; SETS];
    let step = SETS * L::N;
    let mut at = 0;
    while at + step <= length {
        for (set, acc) in acc.iter_mut().enumerate() {
            // SAFETY: at + step <= length.
            unsafe { dot_vector(l, rows, x, at + set * L::N, acc) };
        }
        at += step;
    }
    while at < length {
        // SAFETY: at + N <= length, since the length is a multiple of N.
        unsafe { dot_vector(l, rows, x, at, &mut acc[0]) };
        at += L::N;
    }
    let mut sums = [[0.0; DOT_ROWS]; CHANNELS];
    for (channel, sums) in sums.iter_mut().enumerate() {
        let mut of_rows = [l.splat(0.0); DOT_ROWS];
        for (row, sum) in of_rows.iter_mut().take(ROWS).enumerate() {
            *sum = acc[0][row][channel];
            for other in &acc[1..] {
                *sum = l.add(*sum, other[row][channel]);
            }
        }
        *sums = l.sum_four(of_rows);
    }
    sums
}

/// Scalar products of [`DOT_ROWS`] rows, each with three vectors of its own: `out[channel][row]`. The
/// vectors of row k lie one after another in `x`, from `starts[k]` on.
///
/// # Panics
/// If `rows` is not [`DOT_ROWS`] times `length` long, `length` is not a multiple of the lanes, or `x` is
/// too short.
#[inline(always)]
pub fn dot_unlike_rows<L: Lanes, E: PackedNumber>(
    l: L,
    rows: &[E],
    x: &[f32],
    starts: [usize; DOT_ROWS],
    length: usize,
) -> [[f32; DOT_ROWS]; CHANNELS] {
    assert!(length.is_multiple_of(L::N));
    // Divided and saturating, so that no length or start can wrap around.
    assert!(
        rows.len() / DOT_ROWS == length && rows.len().is_multiple_of(DOT_ROWS),
        "rows"
    );
    for start in starts {
        assert!(
            start.saturating_add(CHANNELS * length) <= x.len(),
            "vectors"
        );
    }
    let mut acc = [[l.splat(0.0); DOT_ROWS]; CHANNELS];
    let mut at = 0;
    while at < length {
        for row in 0..DOT_ROWS {
            // SAFETY: at + N <= length, and all else was checked above.
            unsafe {
                let first = row * length + at;
                let a = E::load(l, rows.get_unchecked(first..first + L::N));
                for (channel, acc) in acc.iter_mut().enumerate() {
                    let x = l.load_unchecked(x, starts[row] + channel * length + at);
                    acc[row] = l.mul_add(a, x, acc[row]);
                }
            }
        }
        at += L::N;
    }
    let mut sums = [[0.0; DOT_ROWS]; CHANNELS];
    for (sums, acc) in sums.iter_mut().zip(acc) {
        *sums = l.sum_four(acc);
    }
    sums
}

/// `acc += rows[at..] * x[at..]`, one vector of each row.
///
/// # Safety
/// All vectors of `x` have one length, `rows` holds `ROWS` rows of that length, and `at + N` is at most
/// that length.
#[inline(always)]
unsafe fn dot_vector<L: Lanes, E: PackedNumber, const ROWS: usize>(
    l: L,
    rows: &[E],
    x: [&[f32]; CHANNELS],
    at: usize,
    acc: &mut [[L::V; CHANNELS]; ROWS],
) {
    let length = x[0].len();
    let mut signal = [l.splat(0.0); CHANNELS];
    for (signal, x) in signal.iter_mut().zip(x) {
        // SAFETY: the caller's promises.
        *signal = unsafe { l.load_unchecked(x, at) };
    }
    for (row, acc) in acc.iter_mut().enumerate() {
        let start = row * length + at;
        // SAFETY: the caller's promises.
        let a = E::load(l, unsafe { rows.get_unchecked(start..start + L::N) });
        for (acc, &signal) in acc.iter_mut().zip(&signal) {
            *acc = l.mul_add(a, signal, *acc);
        }
    }
}
