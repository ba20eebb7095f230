//! Even and odd parts of signals under commuting mirrors, whole vectors at a time.
//!
//! The mirrors make a group of `GROUP` elements; bit j of an element says that mirror j was applied. A
//! signal has one part for each element. Parts have equal length, and position k of each part is an
//! image of position k of the others.
//!
//! Sums and differences of the parts are the **classes** of the signal; bit j of a class says odd under
//! mirror j. The same sums and differences of the classes give the signal back, times `GROUP`.

#![allow(
    unsafe_code,
    reason = "bounds are checked once a call, not once a number"
)]

use super::lanes::{Lanes, WIDEST};
use super::tiles::{CHANNELS, PackedNumber, Rgb, TILE};
use std::ops::Range;

/// Classes from parts, or parts from classes: sums and differences, one mirror after another.
#[inline(always)]
fn butterflies<L: Lanes, const GROUP: usize>(l: L, v: &mut [L::V; GROUP]) {
    let mut step = 1;
    while step < GROUP {
        let mut k = 0;
        while k < GROUP {
            if k & step == 0 {
                let (a, b) = (v[k], v[k | step]);
                v[k] = l.add(a, b);
                v[k | step] = l.sub(a, b);
            }
            k += 1;
        }
        step *= 2;
    }
}

/// Albedo of a surface, in [0, 1].
#[derive(Clone, Copy, Debug)]
pub enum Albedo<'a> {
    /// One albedo for the whole surface, by channel.
    Uniform([f32; CHANNELS]),
    /// One albedo for the whole surface, which the caller multiplies the sums by: here it counts as 1.
    /// Only for surfaces that emit nothing.
    Later,
    /// The albedo of every position, by channel.
    Each([&'a [f32]; CHANNELS]),
}

/// Light on a surface, by channel. The surface sends out `albedo * (direct + indirect) + emission`.
#[derive(Clone, Copy, Debug)]
pub struct Reflected<'a> {
    /// Direct irradiance.
    pub direct: [&'a [f32]; CHANNELS],
    /// Indirect irradiance, if any.
    pub indirect: Option<[&'a [f32]; CHANNELS]>,
    /// Albedo of the surface.
    pub albedo: Albedo<'a>,
    /// Emitted radiosity, if any.
    pub emission: Option<[&'a [f32]; CHANNELS]>,
}

/// Weighted sums over a surface, by channel.
#[derive(Clone, Copy, Debug)]
pub struct Folded {
    /// Sums of all that the surface sends out.
    pub all: [f32; CHANNELS],
    /// Sums of all but reflected indirect irradiance.
    pub fresh: [f32; CHANNELS],
}

/// Folds what a surface sends out into classes, and returns sums over the surface, weighted by `weight`.
///
/// `folded` gets class after class, in a class channel after channel, in a channel `weight.len()` numbers.
///
/// # Panics
/// If a signal is not `GROUP` times as long as `weight`, the length of `weight` is not a multiple of
/// [`WIDEST`], or `folded` is too short.
#[inline(always)]
pub fn fold<L: Lanes, const GROUP: usize>(
    l: L,
    light: Reflected<'_>,
    weight: &[f32],
    folded: &mut [f32],
) -> Folded {
    match (light.indirect, light.emission, light.albedo) {
        (None, None, Albedo::Later) => {
            fold_with::<L, GROUP, false, false, false>(l, light, weight, folded)
        }
        (_, None, Albedo::Later) => {
            fold_with::<L, GROUP, true, false, false>(l, light, weight, folded)
        }
        (None, None, _) => fold_with::<L, GROUP, false, false, true>(l, light, weight, folded),
        (_, None, _) => fold_with::<L, GROUP, true, false, true>(l, light, weight, folded),
        (None, _, _) => fold_with::<L, GROUP, false, true, true>(l, light, weight, folded),
        _ => fold_with::<L, GROUP, true, true, true>(l, light, weight, folded),
    }
}

/// [`fold`], compiled for light that has or lacks each of its parts.
#[inline(always)]
fn fold_with<
    L: Lanes,
    const GROUP: usize,
    const INDIRECT: bool,
    const EMISSION: bool,
    const ALBEDO: bool,
>(
    l: L,
    light: Reflected<'_>,
    weight: &[f32],
    folded: &mut [f32],
) -> Folded {
    let stride = weight.len();
    let zero = l.splat(0.0);
    // A signal that there is not is replaced by the direct light, and not read.
    let direct = light.direct;
    let (albedo, uniform) = match light.albedo {
        Albedo::Uniform([red, green, blue]) => {
            (direct, Some([l.splat(red), l.splat(green), l.splat(blue)]))
        }
        Albedo::Later => (direct, Some([zero; CHANNELS])),
        Albedo::Each(albedo) => (albedo, None),
    };
    let indirect = light.indirect.unwrap_or(direct);
    let emission = light.emission.unwrap_or(direct);
    for signal in [direct, albedo, indirect, emission] {
        for channel in signal {
            assert_eq!(channel.len(), GROUP * stride, "numbers of a signal");
        }
    }
    assert!(stride.is_multiple_of(WIDEST) && folded.len() >= GROUP * CHANNELS * stride);
    let (mut all, mut fresh) = ([zero; CHANNELS], [zero; CHANNELS]);
    for channel in 0..CHANNELS {
        let mut at = 0;
        while at < stride {
            let mut v = [zero; GROUP];
            let mut fresh_here = zero;
            for (element, v) in v.iter_mut().enumerate() {
                let k = element * stride + at;
                // SAFETY: element < GROUP and at + N <= stride, so k + N <= GROUP * stride, the length
                // of every signal.
                unsafe {
                    let albedo = match uniform {
                        Some(albedo) => albedo[channel],
                        None => l.load_unchecked(albedo[channel], k),
                    };
                    let mut sum = l.load_unchecked(direct[channel], k);
                    if EMISSION {
                        let emission = l.load_unchecked(emission[channel], k);
                        sum = l.mul_add(albedo, sum, emission);
                    } else if ALBEDO {
                        sum = l.mul(albedo, sum);
                    }
                    if INDIRECT {
                        fresh_here = l.add(fresh_here, sum);
                        let indirect = l.load_unchecked(indirect[channel], k);
                        sum = if ALBEDO {
                            l.mul_add(albedo, indirect, sum)
                        } else {
                            l.add(indirect, sum)
                        };
                    }
                    *v = sum;
                }
            }
            butterflies::<L, GROUP>(l, &mut v);
            // SAFETY: at + N <= stride.
            let weight = unsafe { l.load_unchecked(weight, at) };
            all[channel] = l.mul_add(v[0], weight, all[channel]);
            if INDIRECT {
                fresh[channel] = l.mul_add(fresh_here, weight, fresh[channel]);
            }
            for (class, v) in v.iter().enumerate() {
                // SAFETY: the last channel of the last class ends at GROUP * CHANNELS * stride.
                unsafe {
                    l.store_unchecked(folded, (class * CHANNELS + channel) * stride + at, *v)
                };
            }
            at += L::N;
        }
    }
    let all = sum_channels(l, all);
    Folded {
        all,
        fresh: if INDIRECT {
            sum_channels(l, fresh)
        } else {
            all
        },
    }
}

#[inline(always)]
fn sum_channels<L: Lanes>(l: L, [red, green, blue]: [L::V; CHANNELS]) -> [f32; CHANNELS] {
    let [red, green, blue, _] = l.sum_four([red, green, blue, l.splat(0.0)]);
    [red, green, blue]
}

/// A basis of signals. It holds the numbers of every mode at one position of each orbit of the mirrors.
#[derive(Clone, Copy, Debug)]
pub struct Basis<'a, E> {
    /// Tile after tile of [`TILE`] orbits. A tile has a column for each mode, class after class.
    pub tiles: &'a [E],
    /// By class: the range of coefficients that its modes are multiplied by.
    pub classes: &'a [Range<usize>],
    /// By orbit: the weight in [`Unfolded::sums`].
    pub weight: &'a [f32],
}

/// What [`unfold`] found out about a signal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unfolded {
    /// Weighted sums, by channel.
    pub sums: [f32; CHANNELS],
    /// Largest change of a number; 0 without `COMPARE`.
    pub change: f32,
    /// Largest number; 0 without `COMPARE`.
    pub peak: f32,
}

/// A signal of three channels from its coefficients. Negative numbers become zero. With `COMPARE`, also
/// compares with the numbers that `signal` held before.
///
/// Sums over modes are taken in the order of the columns, class by class.
///
/// # Panics
/// If there are not `GROUP` classes, a signal is not `GROUP` times as long as `weight`, the length of
/// `weight` is not a multiple of [`WIDEST`], the tiles do not have modes times orbits numbers, or `x` lacks
/// coefficients.
#[inline(always)]
pub fn unfold<L: Lanes, E: PackedNumber, const GROUP: usize, const COMPARE: bool>(
    l: L,
    basis: Basis<'_, E>,
    x: Rgb<'_>,
    signal: &mut [&mut [f32]; CHANNELS],
) -> Unfolded {
    match L::N {
        4 => unfold_with::<L, E, GROUP, 4, COMPARE>(l, basis, x, signal),
        8 => unfold_with::<L, E, GROUP, 2, COMPARE>(l, basis, x, signal),
        _ => unfold_with::<L, E, GROUP, 1, COMPARE>(l, basis, x, signal),
    }
}

/// [`unfold`], `VECTORS` vectors of orbits at a time.
#[inline(always)]
fn unfold_with<
    L: Lanes,
    E: PackedNumber,
    const GROUP: usize,
    const VECTORS: usize,
    const COMPARE: bool,
>(
    l: L,
    basis: Basis<'_, E>,
    x: Rgb<'_>,
    signal: &mut [&mut [f32]; CHANNELS],
) -> Unfolded {
    let stride = basis.weight.len();
    assert!(stride.is_multiple_of(WIDEST) && TILE.is_multiple_of(VECTORS * L::N));
    let columns = basis.assert_fits::<GROUP>(x, signal);
    let zero = l.splat(0.0);
    let mut totals = [zero; CHANNELS];
    let (mut change, mut peak) = (zero, zero);
    let mut at = 0;
    while at < stride {
        let first = at / TILE * TILE * columns + at % TILE;
        // SAFETY: the columns of all classes lie within the tile of `at`, and `x` has a number for every
        // coefficient of a class.
        let sums = unsafe { sum_classes::<L, E, GROUP, VECTORS>(l, basis, first, x) };
        for channel in 0..CHANNELS {
            let signal = &mut *signal[channel];
            for vector in 0..VECTORS {
                let at = at + vector * L::N;
                let mut v = [zero; GROUP];
                for (v, class) in v.iter_mut().zip(&sums) {
                    *v = class[channel][vector];
                }
                butterflies::<L, GROUP>(l, &mut v);
                // SAFETY: at + N <= stride.
                let weight = unsafe { l.load_unchecked(basis.weight, at) };
                for (element, v) in v.iter().enumerate() {
                    let at = element * stride + at;
                    let now = l.max(*v, zero);
                    // SAFETY: at + N <= GROUP * stride.
                    unsafe {
                        if COMPARE {
                            let before = l.load_unchecked(signal, at);
                            change = l.max(l.abs(l.sub(now, before)), change);
                            peak = l.max(now, peak);
                        }
                        l.store_unchecked(signal, at, now);
                    }
                    totals[channel] = l.mul_add(now, weight, totals[channel]);
                }
            }
        }
        at += VECTORS * L::N;
    }
    let sums = sum_channels(l, totals);
    let (change, peak) = if COMPARE {
        (l.largest(change), l.largest(peak))
    } else {
        (0.0, 0.0)
    };
    Unfolded { sums, change, peak }
}

impl<E> Basis<'_, E> {
    /// Checks that there are `GROUP` classes, a column of the tiles for each of their modes, the
    /// coefficients of all modes in `x`, and `GROUP` parts of a signal. Returns the number of columns.
    #[inline(always)]
    fn assert_fits<const GROUP: usize>(
        &self,
        x: Rgb<'_>,
        signal: &[&mut [f32]; CHANNELS],
    ) -> usize {
        assert_eq!(self.classes.len(), GROUP, "classes");
        let (mut columns, mut limit) = (0, 0);
        for class in self.classes {
            columns += class.len();
            limit = limit.max(class.end);
        }
        let stride = self.weight.len();
        assert_eq!(self.tiles.len(), stride * columns, "numbers of a basis");
        assert!(x.has(limit));
        for channel in signal {
            assert_eq!(channel.len(), GROUP * stride, "numbers of a signal");
        }
        columns
    }
}

/// Columns of each class times the coefficients of its modes. The first column starts at number `first` of
/// the tiles.
///
/// # Safety
/// As [`sum_class`], for the columns of all classes one after another.
#[inline(always)]
unsafe fn sum_classes<L: Lanes, E: PackedNumber, const GROUP: usize, const VECTORS: usize>(
    l: L,
    basis: Basis<'_, E>,
    first: usize,
    x: Rgb<'_>,
) -> [[[L::V; VECTORS]; CHANNELS]; GROUP] {
    let mut sums = [[[l.splat(0.0); VECTORS]; CHANNELS]; GROUP];
    let mut column = first;
    // Written out: a loop over classes would keep the sums in memory.
    macro_rules! add_class {
        ($($class:literal)*) => {
            $(if $class < GROUP {
                let modes = basis.classes[$class].clone();
                let next = column + modes.len() * TILE;
                // SAFETY: the caller's promises.
                sums[$class] = unsafe { sum_class(l, basis.tiles, column, modes, x) };
                column = next;
            })*
        };
    }
    add_class!(0 1 2 3 4 5 6 7);
    let _ = column;
    sums
}

/// Columns of one class, from number `at` of the tiles on, times the coefficients of its modes.
///
/// # Safety
/// Columns lie [`TILE`] numbers apart. From its first number on, the last column has `VECTORS` vectors.
/// `x` has the coefficients of all `modes`.
#[inline(always)]
unsafe fn sum_class<L: Lanes, E: PackedNumber, const VECTORS: usize>(
    l: L,
    tiles: &[E],
    at: usize,
    modes: Range<usize>,
    x: Rgb<'_>,
) -> [[L::V; VECTORS]; CHANNELS] {
    let mut acc = [[l.splat(0.0); VECTORS]; CHANNELS];
    let mut at = at;
    for mode in modes {
        let mut a = [l.splat(0.0); VECTORS];
        for (v, a) in a.iter_mut().enumerate() {
            let at = at + v * L::N;
            // SAFETY: the caller's promises.
            *a = E::load(l, unsafe { tiles.get_unchecked(at..at + L::N) });
        }
        for (channel, acc) in acc.iter_mut().enumerate() {
            // SAFETY: the caller's promises.
            let x = unsafe { *x.values.get_unchecked(channel * x.stride + mode) };
            let x = l.splat(x);
            for (acc, &a) in acc.iter_mut().zip(&a) {
                *acc = l.mul_add(a, x, *acc);
            }
        }
        at += TILE;
    }
    acc
}
