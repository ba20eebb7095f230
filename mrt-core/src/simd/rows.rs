//! Products of few long rows of numbers with three vectors: red, green and blue.
//!
//! A product keeps a vector of sums for each row and channel. Functions here are parts of kernels, as in
//! [`tiles`](super::tiles).

#![allow(
    unsafe_code,
    reason = "bounds are checked once a call, not once a number"
)]

use super::Lanes;
use super::tiles::{CHANNELS, Element};

/// Rows of a group in [`dot_rows`], at most.
pub const DOT_ROWS: usize = 4;

/// Sums of `count` rows of numbers times three vectors: `out[channel][row]`, zero for rows that there are not.
///
/// `rows` holds row after row, each as long as a vector; lengths are multiples of [`WIDEST`](super::WIDEST).
///
/// # Panics
/// If `count` is not 1 to [`DOT_ROWS`], `rows` not that many times as long as a vector, or that length no multiple of the
/// lanes.
#[inline(always)]
pub fn dot_rows<L: Lanes, E: Element>(
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

/// `SETS` vectors of each row go to sums of their own, so that enough products are under way at once.
#[inline(always)]
fn dot_some_rows<L: Lanes, E: Element, const ROWS: usize, const SETS: usize>(
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
            unsafe { dot_vector(l, rows, x, length, at + set * L::N, acc) };
        }
        at += step;
    }
    while at < length {
        // SAFETY: at + N <= length, since the length is a multiple of N.
        unsafe { dot_vector(l, rows, x, length, at, &mut acc[0]) };
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

/// [`dot_rows`] of [`DOT_ROWS`] rows, each of which has vectors of its own: row k is multiplied by the three that lie one
/// after another in `x` from `starts[k]` on.
///
/// # Panics
/// If `rows` is not [`DOT_ROWS`] times `length`, that is no multiple of the lanes, or `x` is too short.
#[inline(always)]
pub fn dot_unlike_rows<L: Lanes, E: Element>(
    l: L,
    rows: &[E],
    x: &[f32],
    starts: [usize; DOT_ROWS],
    length: usize,
) -> [[f32; DOT_ROWS]; CHANNELS] {
    assert!(length.is_multiple_of(L::N));
    assert_eq!(rows.len(), DOT_ROWS * length, "rows");
    for start in starts {
        assert!(start + CHANNELS * length <= x.len(), "vectors");
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
/// Each vector of `x` has `length` numbers, `rows` that many for each row, and `at + N <= length`.
#[inline(always)]
unsafe fn dot_vector<L: Lanes, E: Element, const ROWS: usize>(
    l: L,
    rows: &[E],
    x: [&[f32]; CHANNELS],
    length: usize,
    at: usize,
    acc: &mut [[L::V; CHANNELS]; ROWS],
) {
    let mut signal = [l.splat(0.0); CHANNELS];
    for (signal, x) in signal.iter_mut().zip(x) {
        // SAFETY: the caller's promises; so below.
        *signal = unsafe { l.load_unchecked(x, at) };
    }
    for (row, acc) in acc.iter_mut().enumerate() {
        let start = row * length + at;
        let a = E::load(l, unsafe { rows.get_unchecked(start..start + L::N) });
        for (acc, &signal) in acc.iter_mut().zip(&signal) {
            *acc = l.mul_add(a, signal, *acc);
        }
    }
}
