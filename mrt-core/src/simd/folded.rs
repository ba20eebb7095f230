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

use super::{Lanes, WIDEST};

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
    /// The same everywhere that there is light.
    Uniform(f32),
    /// One number a number of light.
    Each(&'a [f32]),
}

/// What a surface sends out, one channel: `albedo (direct + indirect) + emission`.
#[derive(Clone, Copy, Debug)]
pub struct Reflected<'a> {
    /// Irradiance.
    pub direct: &'a [f32],
    /// More of it, or none.
    pub indirect: Option<&'a [f32]>,
    /// In [0, 1].
    pub albedo: Albedo<'a>,
    /// Radiosity, or none.
    pub emission: Option<&'a [f32]>,
}

/// Folds what a surface sends out: class after class, each `weight.len()` numbers, `apart` numbers from one class to the
/// next. Returns sums over the surface by `weight`: of all of it, and of what is not indirect.
///
/// # Panics
/// If a signal is not `GROUP` times as long as `weight`, that is no multiple of [`WIDEST`], or `folded` is too short.
#[inline(always)]
pub fn fold<L: Lanes, const GROUP: usize>(
    l: L,
    light: Reflected<'_>,
    weight: &[f32],
    folded: &mut [f32],
    apart: usize,
) -> [f32; 2] {
    match (light.indirect, light.emission) {
        (None, None) => fold_with::<L, GROUP, false, false>(l, light, weight, folded, apart),
        (None, _) => fold_with::<L, GROUP, false, true>(l, light, weight, folded, apart),
        (_, None) => fold_with::<L, GROUP, true, false>(l, light, weight, folded, apart),
        _ => fold_with::<L, GROUP, true, true>(l, light, weight, folded, apart),
    }
}

#[inline(always)]
fn fold_with<L: Lanes, const GROUP: usize, const INDIRECT: bool, const EMISSION: bool>(
    l: L,
    light: Reflected<'_>,
    weight: &[f32],
    folded: &mut [f32],
    apart: usize,
) -> [f32; 2] {
    let stride = weight.len();
    let direct = light.direct;
    let (albedo, uniform) = match light.albedo {
        Albedo::Uniform(albedo) => (direct, Some(l.splat(albedo))),
        Albedo::Each(albedo) => (albedo, None),
    };
    let indirect = light.indirect.unwrap_or(direct);
    let emission = light.emission.unwrap_or(direct);
    for signal in [direct, albedo, indirect, emission] {
        assert_eq!(signal.len(), GROUP * stride, "numbers of a signal");
    }
    assert!(stride.is_multiple_of(WIDEST) && folded.len() >= (GROUP - 1) * apart + stride);
    let (mut all, mut fresh) = (l.splat(0.0), l.splat(0.0));
    let mut at = 0;
    while at < stride {
        let mut v = [l.splat(0.0); GROUP];
        let mut fresh_here = l.splat(0.0);
        for (element, v) in v.iter_mut().enumerate() {
            let k = element * stride + at;
            // SAFETY: element < GROUP and at + N <= stride, so k + N <= GROUP * stride, the length of every signal.
            unsafe {
                let albedo = match uniform {
                    Some(albedo) => albedo,
                    None => l.load_unchecked(albedo, k),
                };
                let mut sum = if EMISSION {
                    let emission = l.load_unchecked(emission, k);
                    l.mul_add(albedo, l.load_unchecked(direct, k), emission)
                } else {
                    l.mul(albedo, l.load_unchecked(direct, k))
                };
                if INDIRECT {
                    fresh_here = l.add(fresh_here, sum);
                    sum = l.mul_add(albedo, l.load_unchecked(indirect, k), sum);
                }
                *v = sum;
            }
        }
        butterflies::<L, GROUP>(l, &mut v);
        // SAFETY: at + N <= stride.
        let weight = unsafe { l.load_unchecked(weight, at) };
        all = l.mul_add(v[0], weight, all);
        if INDIRECT {
            fresh = l.mul_add(fresh_here, weight, fresh);
        }
        for (class, v) in v.iter().enumerate() {
            // SAFETY: the last class ends at (GROUP - 1) * apart + stride.
            unsafe { l.store_unchecked(folded, class * apart + at, *v) };
        }
        at += L::N;
    }
    let all = l.sum(all);
    [all, if INDIRECT { l.sum(fresh) } else { all }]
}

/// What [`unfold`] finds out, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Unfolded<L: Lanes> {
    change: L::V,
    peak: L::V,
}

impl<L: Lanes> Unfolded<L> {
    /// Nothing yet.
    #[inline(always)]
    pub fn new(l: L) -> Self {
        Self {
            change: l.splat(0.0),
            peak: l.splat(0.0),
        }
    }

    /// Largest change of a number and largest number, if changes were looked for.
    #[inline(always)]
    pub fn change_and_peak(&self, l: L) -> [f32; 2] {
        [l.largest(self.change), l.largest(self.peak)]
    }
}

/// One channel of a signal from its classes, which lie `apart` numbers from one another; negative numbers become zero.
/// With `COMPARE`, looks at what was there before.
///
/// # Panics
/// If the signal is not `GROUP` times as long as `weight`, that is no multiple of [`WIDEST`], or `folded` is too short.
#[inline(always)]
pub fn unfold<L: Lanes, const GROUP: usize, const COMPARE: bool>(
    l: L,
    folded: &[f32],
    apart: usize,
    weight: &[f32],
    signal: &mut [f32],
    found: &mut Unfolded<L>,
) -> f32 {
    let stride = weight.len();
    let zero = l.splat(0.0);
    let mut total = zero;
    assert_eq!(signal.len(), GROUP * stride, "numbers of a signal");
    assert!(stride.is_multiple_of(WIDEST) && folded.len() >= (GROUP - 1) * apart + stride);
    let mut at = 0;
    while at < stride {
        let mut v = [zero; GROUP];
        for (class, v) in v.iter_mut().enumerate() {
            // SAFETY: the last class ends at (GROUP - 1) * apart + stride, and at + N <= stride.
            *v = unsafe { l.load_unchecked(folded, class * apart + at) };
        }
        butterflies::<L, GROUP>(l, &mut v);
        let mut sum = zero;
        for (element, v) in v.iter().enumerate() {
            let at = element * stride + at;
            let now = l.max(*v, zero);
            // SAFETY: at + N <= GROUP * stride.
            unsafe {
                if COMPARE {
                    let change = l.abs(l.sub(now, l.load_unchecked(signal, at)));
                    found.change = l.max(change, found.change);
                    found.peak = l.max(now, found.peak);
                }
                l.store_unchecked(signal, at, now);
            }
            sum = l.add(sum, now);
        }
        // SAFETY: at + N <= stride.
        let weight = unsafe { l.load_unchecked(weight, at) };
        total = l.mul_add(sum, weight, total);
        at += L::N;
    }
    l.sum(total)
}
