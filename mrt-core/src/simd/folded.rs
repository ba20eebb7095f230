//! Even and odd parts of signals under commuting mirrors, whole vectors at a time.
//!
//! A signal has `GROUP` parts of equal length, one for each element of the group that the mirrors make; position k of
//! each is an image of position k of the others. Element bit j says that mirror j was applied. Sums and differences
//! of parts are the signal's **classes**, class bit j saying odd under mirror j, and the same sums and differences of
//! classes give the signal back, `GROUP` times over.

#![allow(
    unsafe_code,
    reason = "bounds are checked once a call, not once a number"
)]

use super::tiles::{CHANNELS, Element, Rgb, TILE};
use super::{Lanes, WIDEST};
use std::ops::Range;

/// Sums and differences of mirrored parts, each mirror in turn.
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

/// Albedo of a surface.
#[derive(Clone, Copy, Debug)]
pub enum Albedo<'a> {
    /// The same everywhere that there is light, by channel.
    Uniform([f32; CHANNELS]),
    /// The same everywhere, and the caller multiplies sums by it; taken as 1. Nothing is emitted.
    Later,
    /// One number a number of light.
    Each([&'a [f32]; CHANNELS]),
}

/// What a surface sends out: `albedo (direct + indirect) + emission`, by channel.
#[derive(Clone, Copy, Debug)]
pub struct Reflected<'a> {
    /// Irradiance.
    pub direct: [&'a [f32]; CHANNELS],
    /// More of it, or none.
    pub indirect: Option<[&'a [f32]; CHANNELS]>,
    /// In [0, 1].
    pub albedo: Albedo<'a>,
    /// Radiosity, or none.
    pub emission: Option<[&'a [f32]; CHANNELS]>,
}

/// Sums over a surface, by channel.
#[derive(Clone, Copy, Debug)]
pub struct Folded {
    /// Of all that it sends out.
    pub all: [f32; CHANNELS],
    /// Of what is not indirect.
    pub fresh: [f32; CHANNELS],
}

/// Folds what a surface sends out: class after class, in that channel after channel, each `weight.len()` numbers. Returns
/// sums over the surface by `weight`.
///
/// # Panics
/// If a signal is not `GROUP` times as long as `weight`, that is no multiple of [`WIDEST`], or `folded` is too short.
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
    let direct = light.direct;
    let zero = l.splat(0.0);
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
                // SAFETY: element < GROUP and at + N <= stride, so k + N <= GROUP * stride, the length of every signal.
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
                // SAFETY: the last class's last channel ends at GROUP * CHANNELS * stride.
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

/// A basis of signals, of which a mode's numbers at one texel of each orbit are kept.
#[derive(Clone, Copy, Debug)]
pub struct Basis<'a, E> {
    /// Tile after tile of [`TILE`] orbits; in a tile a column for each mode, class after class.
    pub tiles: &'a [E],
    /// By class: which coefficients its modes are multiplied by.
    pub classes: &'a [Range<usize>],
    /// By orbit: what [`Unfolded::sums`] are taken by.
    pub weight: &'a [f32],
}

/// What [`unfold`] found out about a signal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unfolded {
    /// Weighted sums, by channel.
    pub sums: [f32; CHANNELS],
    /// Largest change of a number, if it was looked for.
    pub change: f32,
    /// Largest number, likewise.
    pub peak: f32,
}

/// A signal of three channels from its coefficients; negative numbers become zero. With `COMPARE`, looks at what was there
/// before.
///
/// Sums over modes are taken in the order of the columns, class by class.
///
/// # Panics
/// If there are not `GROUP` classes, a signal is not `GROUP` times as long as `weight`, that is no multiple of
/// [`WIDEST`], there are not as many numbers in tiles as modes times orbits, or `x` does not have the coefficients.
#[inline(always)]
pub fn unfold<L: Lanes, E: Element, const GROUP: usize, const COMPARE: bool>(
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

/// `VECTORS` vectors of orbits at a time.
#[inline(always)]
fn unfold_with<
    L: Lanes,
    E: Element,
    const GROUP: usize,
    const VECTORS: usize,
    const COMPARE: bool,
>(
    l: L,
    basis: Basis<'_, E>,
    x: Rgb<'_>,
    signal: &mut [&mut [f32]; CHANNELS],
) -> Unfolded {
    let Basis {
        tiles,
        classes,
        weight,
    } = basis;
    let stride = weight.len();
    assert_eq!(classes.len(), GROUP, "classes");
    let (mut columns, mut limit) = (0, 0);
    for class in classes {
        columns += class.len();
        limit = limit.max(class.end);
    }
    assert!(stride.is_multiple_of(WIDEST) && TILE.is_multiple_of(VECTORS * L::N));
    assert_eq!(tiles.len(), stride * columns, "numbers of a basis");
    assert!(x.has(limit));
    for channel in signal.iter() {
        assert_eq!(channel.len(), GROUP * stride, "numbers of a signal");
    }
    let zero = l.splat(0.0);
    let mut totals = [zero; CHANNELS];
    let (mut change, mut peak) = (zero, zero);
    let mut at = 0;
    while at < stride {
        let mut column = at / TILE * TILE * columns + at % TILE;
        let mut sums = [[[zero; VECTORS]; CHANNELS]; GROUP];
        // Written out: a loop over classes would keep the sums in memory.
        macro_rules! add_class {
            ($($class:literal)*) => {
                $(if $class < GROUP {
                    let modes = classes[$class].clone();
                    let next = column + modes.len() * TILE;
                    // SAFETY: columns of all classes lie within the tile that `at` is in, and `x` has numbers up to the
                    // limit.
                    sums[$class] = unsafe { sum_class(l, tiles, column, modes, x) };
                    column = next;
                })*
            };
        }
        add_class!(0 1 2 3 4 5 6 7);
        debug_assert_eq!(column, (at / TILE + 1) * TILE * columns + at % TILE);
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
                let weight = unsafe { l.load_unchecked(weight, at) };
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

/// Columns of one class from number `at` of the tiles on, times the coefficients of its modes.
///
/// # Safety
/// A tile's height lies between `at` and the first number of each next column, the last of them has `VECTORS` vectors,
/// and `x` has the coefficients.
#[inline(always)]
unsafe fn sum_class<L: Lanes, E: Element, const VECTORS: usize>(
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
            // SAFETY: the caller's promises; so below.
            *a = E::load(l, unsafe { tiles.get_unchecked(at..at + L::N) });
        }
        for (channel, acc) in acc.iter_mut().enumerate() {
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
