//! The operations that every instruction set offers.

use std::fmt::Debug;

/// Lanes of the widest level. Storage that is padded to a multiple of it leaves no remainder at any
/// level.
pub const WIDEST: usize = 16;

/// Operations on vectors of `f32`. A value of an implementing type proves that the machine has the
/// instructions.
///
/// Loads and stores take slices of at least [`Lanes::N`] elements, and use the first `N` of them.
#[allow(
    missing_docs,
    reason = "each is the operation on every lane that its name says"
)]
pub trait Lanes: Copy + Debug + Send + Sync + 'static {
    /// A vector of `N` numbers.
    type V: Copy + Debug + Send + Sync;
    /// The lanes to use for eight rows: the next narrower ones if these are 16, else these.
    type Narrow: Lanes;

    /// How many numbers a vector holds.
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
    /// Loads half-precision numbers, given by their bits, as `f32`. They must be finite.
    fn load_f16(self, from: &[u16]) -> Self::V;
    fn load_i8(self, from: &[i8]) -> Self::V;
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    fn div(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a * b + c`, rounded once or twice, depending on the level.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    fn sqrt(self, a: Self::V) -> Self::V;
    /// The larger in each lane; `b` if one is NaN.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// The smaller in each lane; `b` if one is NaN.
    fn min(self, a: Self::V, b: Self::V) -> Self::V;
    fn abs(self, a: Self::V) -> Self::V;
    /// `x` where `a >= b`, else 0.
    fn keep_where_ge(self, a: Self::V, b: Self::V, x: Self::V) -> Self::V;
    /// Sum of the lanes, in an order that depends on the level alone.
    fn sum(self, a: Self::V) -> f32;
    /// The sum of each of four vectors, in an order that may differ from that of [`Lanes::sum`].
    fn sum_four(self, v: [Self::V; 4]) -> [f32; 4];
    /// The largest lane. No lane may be NaN.
    fn largest(self, a: Self::V) -> f32;
}

/// One lane: the reference for all other lanes.
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

/// 2^112: the exponent biases of half and single precision differ by 112.
pub(super) const F16_EXPONENT: f32 = 5.192_297e33;

/// The half-precision number with the given bits, which must be finite.
///
/// Exponent and mantissa move to their place in an `f32`, whose exponent is then too small by 112. A
/// product corrects that, exactly for subnormal numbers too.
#[inline(always)]
pub fn f32_from_f16_bits(bits: u16) -> f32 {
    let magnitude = f32::from_bits(u32::from(bits & 0x7fff) << 13) * F16_EXPONENT;
    f32::from_bits(magnitude.to_bits() | u32::from(bits & 0x8000) << 16)
}
