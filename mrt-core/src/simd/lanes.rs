//! What every instruction set offers.

use std::fmt::Debug;

/// Lanes of the widest level: storage padded to a multiple of it needs no remainders.
pub const WIDEST: usize = 16;

/// A vector of `f32`, and what can be done with it. Values of these types are proof that the machine has the
/// instructions.
///
/// Loads and stores take slices of at least [`Lanes::N`] elements and use the first ones.
#[allow(
    missing_docs,
    reason = "each is the operation on every lane that its name says"
)]
pub trait Lanes: Copy + Debug + Send + Sync + 'static {
    /// `N` numbers.
    type V: Copy + Debug + Send + Sync;
    /// The lanes to use for eight rows: these, or the next narrower ones where these are 16.
    type Narrow: Lanes;

    /// Numbers in a vector.
    const N: usize;

    fn narrow(self) -> Self::Narrow;
    fn splat(self, x: f32) -> Self::V;
    fn load(self, from: &[f32]) -> Self::V;
    fn store(self, to: &mut [f32], v: Self::V);
    /// [`Lanes::load`] of `from[at..]`.
    ///
    /// # Safety
    /// `at + N` is at most the length.
    #[allow(unsafe_code, reason = "see Safety")]
    #[inline(always)]
    unsafe fn load_unchecked(self, from: &[f32], at: usize) -> Self::V {
        // SAFETY: the caller's promise.
        self.load(unsafe { from.get_unchecked(at..at + Self::N) })
    }
    /// [`Lanes::store`] to `to[at..]`.
    ///
    /// # Safety
    /// `at + N` is at most the length.
    #[allow(unsafe_code, reason = "see Safety")]
    #[inline(always)]
    unsafe fn store_unchecked(self, to: &mut [f32], at: usize, v: Self::V) {
        // SAFETY: the caller's promise.
        self.store(unsafe { to.get_unchecked_mut(at..at + Self::N) }, v);
    }
    /// Half-precision numbers, by their bits, as `f32`; infinities and NaN do not occur.
    fn load_f16(self, from: &[u16]) -> Self::V;
    fn load_i8(self, from: &[i8]) -> Self::V;
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    fn div(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a * b + c`, rounded once or twice as the level does.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    fn sqrt(self, a: Self::V) -> Self::V;
    /// The larger; `b` if one is NaN.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// The smaller; `b` if one is NaN.
    fn min(self, a: Self::V, b: Self::V) -> Self::V;
    fn abs(self, a: Self::V) -> Self::V;
    /// `x` where `a >= b`, else 0.
    fn keep_where_ge(self, a: Self::V, b: Self::V, x: Self::V) -> Self::V;
    /// Sum of the lanes, in an order that depends on the level alone.
    fn sum(self, a: Self::V) -> f32;
    /// [`Lanes::sum`] of four vectors, added up in another order.
    fn sum_four(self, v: [Self::V; 4]) -> [f32; 4];
    /// The largest lane; no lane is NaN.
    fn largest(self, a: Self::V) -> f32;
}

/// One lane: the reference for all others.
#[derive(Clone, Copy, Debug)]
pub struct Scalar;

impl Lanes for Scalar {
    type V = f32;
    type Narrow = Scalar;
    const N: usize = 1;

    #[inline(always)]
    fn narrow(self) -> Scalar {
        self
    }
    #[inline(always)]
    fn splat(self, x: f32) -> f32 {
        x
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> f32 {
        from[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f32], v: f32) {
        to[0] = v;
    }
    #[inline(always)]
    fn load_f16(self, from: &[u16]) -> f32 {
        f32_from_f16_bits(from[0])
    }
    #[inline(always)]
    fn load_i8(self, from: &[i8]) -> f32 {
        f32::from(from[0])
    }
    #[inline(always)]
    fn add(self, a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline(always)]
    fn sub(self, a: f32, b: f32) -> f32 {
        a - b
    }
    #[inline(always)]
    fn mul(self, a: f32, b: f32) -> f32 {
        a * b
    }
    #[inline(always)]
    fn div(self, a: f32, b: f32) -> f32 {
        a / b
    }
    #[inline(always)]
    fn mul_add(self, a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
    #[inline(always)]
    fn sqrt(self, a: f32) -> f32 {
        a.sqrt()
    }
    #[inline(always)]
    fn max(self, a: f32, b: f32) -> f32 {
        if a > b { a } else { b }
    }
    #[inline(always)]
    fn min(self, a: f32, b: f32) -> f32 {
        if a < b { a } else { b }
    }
    #[inline(always)]
    fn abs(self, a: f32) -> f32 {
        a.abs()
    }
    #[inline(always)]
    fn keep_where_ge(self, a: f32, b: f32, x: f32) -> f32 {
        if a >= b { x } else { 0.0 }
    }
    #[inline(always)]
    fn sum(self, a: f32) -> f32 {
        a
    }
    #[inline(always)]
    fn sum_four(self, v: [f32; 4]) -> [f32; 4] {
        v
    }
    #[inline(always)]
    fn largest(self, a: f32) -> f32 {
        a
    }
}

/// 2^112: the distance between the exponents of half and single precision.
pub(super) const F16_EXPONENT: f32 = 5.192_297e33;

/// The number of a half's bits. Exponent and mantissa move to their place in an `f32`, whose exponent is then too
/// small by 112; a product makes up for that, and is exact for subnormal halves too.
#[inline(always)]
pub fn f32_from_f16_bits(bits: u16) -> f32 {
    let magnitude = f32::from_bits(u32::from(bits & 0x7fff) << 13) * F16_EXPONENT;
    f32::from_bits(magnitude.to_bits() | u32::from(bits & 0x8000) << 16)
}
