//! From texels to mirrored sums and back.

use crate::instructions::run;
use crate::numbers::{ExactSum, Number, channels, exact_small, light, small};
use divan::{Bencher, black_box, counter::ItemsCount};
use mrt_core::simd::folded::{Albedo, Basis, Folded, Reflected, Unfolded, fold, unfold};
use mrt_core::simd::tiles::{CHANNELS, Rgb, TILE};
use mrt_core::simd::{Aligned, Kernel, Lanes};
use std::ops::Range;

/// Elements of the group of three mirrors.
const GROUP: usize = 8;

/// Orbits, one and a half times those of a standard straight.
const STRIDE: usize = 192;

/// The sign that element `element` of the group gives to class `class`.
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
    run(RunFold {
        light,
        weight: &weight,
        folded: &mut folded,
    });
    let times = if with_indirect { 2.0 } else { 1.0 };
    let reflected = direct.iter().zip(&albedo[..]);
    let reflected: Vec<f64> = reflected
        .map(|(&light, &albedo)| times * f64::from(light) * f64::from(albedo))
        .collect();
    check_folded(&folded, &reflected);
    bencher
        .counter(ItemsCount::new(CHANNELS * GROUP * STRIDE))
        .bench_local(|| {
            run(RunFold {
                light: black_box(light),
                weight: &weight,
                folded: &mut folded,
            })
        });
}

/// Each class is the sum of the reflected light of the group's elements with their signs.
fn check_folded(folded: &[f32], reflected: &[f64]) {
    for (k, &found) in folded.iter().enumerate() {
        let (class, k) = (k / (CHANNELS * STRIDE), k % (CHANNELS * STRIDE));
        let (channel, orbit) = (k / STRIDE, k % STRIDE);
        let term = |element: usize| {
            let texel = (channel * GROUP + element) * STRIDE + orbit;
            sign(element, class) * reflected[texel]
        };
        ExactSum::of((0..GROUP).map(term)).check(found);
    }
}

/// Modes of a class, as of a standard block.
const MODES: usize = 8;

/// Modes of a block.
const COLUMNS: usize = GROUP * MODES;

/// Operands of [`unfold`].
struct Modes<E> {
    tiles: Aligned<E>,
    classes: Vec<Range<usize>>,
    weight: Aligned<f32>,
    coefficients: Aligned<f32>,
}

impl<E: Number> Modes<E> {
    fn new() -> Modes<E> {
        Modes {
            tiles: (0..COLUMNS * STRIDE).map(|k| E::of(small(k))).collect(),
            classes: (0..GROUP).map(|c| c * MODES..(c + 1) * MODES).collect(),
            weight: (0..STRIDE).map(|_| 1.0).collect(),
            coefficients: light(CHANNELS * COLUMNS),
        }
    }

    /// Each texel is its orbit's sum over all modes, with the signs of the modes' classes; light is not negative.
    fn check(&self, signal: &[f32]) {
        for (k, &found) in signal.iter().enumerate() {
            let (channel, k) = (k / (GROUP * STRIDE), k % (GROUP * STRIDE));
            let (element, orbit) = (k / STRIDE, k % STRIDE);
            let term = |column: usize| {
                let of_tile = (orbit / TILE * COLUMNS + column) * TILE + orbit % TILE;
                let coefficient = f64::from(self.coefficients[channel * COLUMNS + column]);
                sign(element, column / MODES) * exact_small(of_tile) * coefficient
            };
            ExactSum::of((0..COLUMNS).map(term)).or_zero().check(found);
        }
    }
}

struct RunUnfold<'a, E>(&'a Modes<E>, &'a mut [f32]);

impl<E: Number> Kernel for RunUnfold<'_, E> {
    type Output = Unfolded;
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Unfolded {
        let (modes, signal) = (self.0, self.1);
        let (red, rest) = signal.split_at_mut(GROUP * STRIDE);
        let (green, blue) = rest.split_at_mut(GROUP * STRIDE);
        let basis = Basis {
            tiles: &modes.tiles[..],
            classes: &modes.classes,
            weight: &modes.weight,
        };
        let x = Rgb::new(&modes.coefficients, COLUMNS);
        unfold::<L, E, GROUP, false>(l, basis, x, &mut [red, green, blue])
    }
}

/// Products with a basis, and the sums and differences that make texels of them; products are counted.
#[divan::bench(name = "unfold", types = [f32, u16, i8])]
fn unfolds<E: Number>(bencher: Bencher) {
    let modes = Modes::<E>::new();
    let mut signal = Aligned::zeroed(CHANNELS * GROUP * STRIDE);
    run(RunUnfold(&modes, &mut signal));
    modes.check(&signal);
    bencher
        .counter(ItemsCount::new(CHANNELS * COLUMNS * STRIDE))
        .bench_local(|| run(RunUnfold(black_box(&modes), &mut signal)));
}
