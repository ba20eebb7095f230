//! The lanes of SSE2, AVX2 and AVX-512.

#![allow(
    unsafe_code,
    reason = "intrinsics; the types below are made only where the machine has their instructions"
)]

use super::kernel::Kernel;
use super::lanes::{F16_EXPONENT, Lanes};
use std::arch::x86_64::*;
use std::sync::atomic::{AtomicU8, Ordering};

/// Proof that the machine has SSE2.
#[derive(Clone, Copy, Debug)]
pub struct Sse2(());

/// Proof that the machine has AVX2, FMA and F16C.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

/// Proof that the machine has AVX-512 F and VL, and all that [`Avx2`] proves.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

/// What the machine has. It is asked once, because kernels are many and short.
static FOUND: AtomicU8 = AtomicU8::new(UNKNOWN);
const UNKNOWN: u8 = 0;
const BASELINE: u8 = 1;
const AVX2: u8 = 2;
const AVX512: u8 = 3;

#[inline]
fn found() -> u8 {
    match FOUND.load(Ordering::Relaxed) {
        UNKNOWN => ask(),
        found => found,
    }
}

#[cold]
fn ask() -> u8 {
    let avx2 = is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("f16c");
    let avx512 = is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl");
    let found = match (avx2, avx512) {
        (false, _) => BASELINE,
        (true, false) => AVX2,
        (true, true) => AVX512,
    };
    FOUND.store(found, Ordering::Relaxed);
    found
}

#[inline]
pub(super) fn has_avx2() -> bool {
    found() >= AVX2
}

#[inline]
pub(super) fn has_avx512() -> bool {
    found() == AVX512
}

/// Runs a kernel with SSE2, which every x86-64 has.
pub(super) fn run_sse2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Sse2(()))
}

/// Runs a kernel with AVX2.
///
/// # Panics
/// If the machine lacks it: call only where [`has_avx2`].
pub(super) fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,fma,f16c")]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Avx2(()))
    }
    assert!(has_avx2());
    // SAFETY: the machine has the instructions, as was just asserted.
    unsafe { run(kernel) }
}

/// Runs a kernel with AVX-512.
///
/// # Panics
/// If the machine lacks it: call only where [`has_avx512`].
pub(super) fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    // With VL, kernels of eight lanes can use all 32 registers too.
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma,f16c")]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Avx512(()))
    }
    assert!(has_avx512());
    // SAFETY: the machine has the instructions, as was just asserted.
    unsafe { run(kernel) }
}

// SAFETY, of every block below: a value of `Sse2` exists only where the machine has the instructions, and
// slices are checked to hold 4 elements before their pointers are read.
impl Lanes for Sse2 {
    type V = __m128;
    type Narrow = Sse2;
    const N: usize = 4;

    #[inline(always)]
    fn narrow(self) -> Sse2 {
        self
    }
    #[inline(always)]
    fn splat(self, x: f32) -> __m128 {
        unsafe { _mm_set1_ps(x) }
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> __m128 {
        let from = &from[..4];
        unsafe { _mm_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32], v: __m128) {
        let to = &mut to[..4];
        unsafe { _mm_storeu_ps(to.as_mut_ptr(), v) }
    }
    #[inline(always)]
    fn add(self, a: __m128, b: __m128) -> __m128 {
        unsafe { _mm_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m128, b: __m128) -> __m128 {
        unsafe { _mm_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m128, b: __m128) -> __m128 {
        unsafe { _mm_mul_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: __m128, b: __m128) -> __m128 {
        unsafe { _mm_div_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: __m128, b: __m128) -> __m128 {
        unsafe { _mm_max_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: __m128, b: __m128) -> __m128 {
        unsafe { _mm_min_ps(a, b) }
    }
    #[inline(always)]
    fn sqrt(self, a: __m128) -> __m128 {
        unsafe { _mm_sqrt_ps(a) }
    }
    #[inline(always)]
    fn load_f16(self, from: &[u16]) -> __m128 {
        let from = &from[..4];
        unsafe {
            let bits = _mm_loadl_epi64(from.as_ptr().cast());
            // As `f32_from_f16_bits`.
            let wide = _mm_unpacklo_epi16(bits, _mm_setzero_si128());
            let sign = _mm_slli_epi32::<16>(_mm_and_si128(wide, _mm_set1_epi32(0x8000)));
            let rest = _mm_slli_epi32::<13>(_mm_and_si128(wide, _mm_set1_epi32(0x7fff)));
            let magnitude = _mm_mul_ps(_mm_castsi128_ps(rest), _mm_set1_ps(F16_EXPONENT));
            _mm_or_ps(magnitude, _mm_castsi128_ps(sign))
        }
    }
    #[inline(always)]
    fn load_i8(self, from: &[i8]) -> __m128 {
        let from = &from[..4];
        let bits = i32::from_le_bytes([from[0] as u8, from[1] as u8, from[2] as u8, from[3] as u8]);
        unsafe {
            let bytes = _mm_cvtsi32_si128(bits);
            // Each byte moves to the top of a 32-bit lane, then down with its sign.
            let words = _mm_unpacklo_epi8(_mm_setzero_si128(), bytes);
            let wide = _mm_unpacklo_epi16(_mm_setzero_si128(), words);
            _mm_cvtepi32_ps(_mm_srai_epi32::<24>(wide))
        }
    }
    #[inline(always)]
    fn mul_add(self, a: __m128, b: __m128, c: __m128) -> __m128 {
        unsafe { _mm_add_ps(_mm_mul_ps(a, b), c) }
    }
    #[inline(always)]
    fn abs(self, a: __m128) -> __m128 {
        unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), a) }
    }
    #[inline(always)]
    fn keep_where_ge(self, a: __m128, b: __m128, x: __m128) -> __m128 {
        unsafe { _mm_and_ps(_mm_cmpge_ps(a, b), x) }
    }
    #[inline(always)]
    fn sum(self, a: __m128) -> f32 {
        unsafe {
            let pairs = _mm_add_ps(a, _mm_movehl_ps(a, a));
            let all = _mm_add_ss(pairs, _mm_shuffle_ps::<1>(pairs, pairs));
            _mm_cvtss_f32(all)
        }
    }
    #[inline(always)]
    fn sum_four(self, [a, b, c, d]: [__m128; 4]) -> [f32; 4] {
        let mut sums = [0.0; 4];
        unsafe {
            // The sums of lanes 0 and 2 and of lanes 1 and 3, for a and b and for c and d.
            let ab = _mm_add_ps(_mm_unpacklo_ps(a, b), _mm_unpackhi_ps(a, b));
            let cd = _mm_add_ps(_mm_unpacklo_ps(c, d), _mm_unpackhi_ps(c, d));
            let all = _mm_add_ps(_mm_movelh_ps(ab, cd), _mm_movehl_ps(cd, ab));
            _mm_storeu_ps(sums.as_mut_ptr(), all);
        }
        sums
    }
    #[inline(always)]
    fn largest(self, a: __m128) -> f32 {
        unsafe {
            let pairs = _mm_max_ps(a, _mm_movehl_ps(a, a));
            let all = _mm_max_ss(pairs, _mm_shuffle_ps::<1>(pairs, pairs));
            _mm_cvtss_f32(all)
        }
    }
}

// SAFETY, of every block below: a value of `Avx2` exists only where the machine has the instructions, and
// slices are checked to hold 8 elements before their pointers are read.
impl Lanes for Avx2 {
    type V = __m256;
    type Narrow = Avx2;
    const N: usize = 8;

    #[inline(always)]
    fn narrow(self) -> Avx2 {
        self
    }
    #[inline(always)]
    fn splat(self, x: f32) -> __m256 {
        unsafe { _mm256_set1_ps(x) }
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> __m256 {
        let from = &from[..8];
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32], v: __m256) {
        let to = &mut to[..8];
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), v) }
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_div_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_min_ps(a, b) }
    }
    #[inline(always)]
    fn sqrt(self, a: __m256) -> __m256 {
        unsafe { _mm256_sqrt_ps(a) }
    }
    #[inline(always)]
    fn load_f16(self, from: &[u16]) -> __m256 {
        let from = &from[..8];
        unsafe { _mm256_cvtph_ps(_mm_loadu_si128(from.as_ptr().cast())) }
    }
    #[inline(always)]
    fn load_i8(self, from: &[i8]) -> __m256 {
        let from = &from[..8];
        unsafe {
            let bytes = _mm_loadl_epi64(from.as_ptr().cast());
            _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(bytes))
        }
    }
    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn abs(self, a: __m256) -> __m256 {
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
    }
    #[inline(always)]
    fn keep_where_ge(self, a: __m256, b: __m256, x: __m256) -> __m256 {
        unsafe { _mm256_and_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(a, b), x) }
    }
    #[inline(always)]
    fn sum(self, a: __m256) -> f32 {
        unsafe {
            let half = _mm_add_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
            Sse2(()).sum(half)
        }
    }
    #[inline(always)]
    fn sum_four(self, [a, b, c, d]: [__m256; 4]) -> [f32; 4] {
        let mut sums = [0.0; 4];
        unsafe {
            // As for four lanes, in both halves at once.
            let ab = _mm256_add_ps(_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let cd = _mm256_add_ps(_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            let all = _mm256_add_ps(
                _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
            );
            let all = _mm_add_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps::<1>(all));
            _mm_storeu_ps(sums.as_mut_ptr(), all);
        }
        sums
    }
    #[inline(always)]
    fn largest(self, a: __m256) -> f32 {
        unsafe {
            let half = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
            Sse2(()).largest(half)
        }
    }
}

// SAFETY, of every block below: a value of `Avx512` exists only where the machine has the instructions, and
// slices are checked to hold 16 elements before their pointers are read.
impl Lanes for Avx512 {
    type V = __m512;
    type Narrow = Avx2;
    const N: usize = 16;

    #[inline(always)]
    fn narrow(self) -> Avx2 {
        Avx2(())
    }
    #[inline(always)]
    fn splat(self, x: f32) -> __m512 {
        unsafe { _mm512_set1_ps(x) }
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> __m512 {
        let from = &from[..16];
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32], v: __m512) {
        let to = &mut to[..16];
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), v) }
    }
    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_mul_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_div_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_max_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_min_ps(a, b) }
    }
    #[inline(always)]
    fn sqrt(self, a: __m512) -> __m512 {
        unsafe { _mm512_sqrt_ps(a) }
    }
    #[inline(always)]
    fn load_f16(self, from: &[u16]) -> __m512 {
        let from = &from[..16];
        unsafe { _mm512_cvtph_ps(_mm256_loadu_si256(from.as_ptr().cast())) }
    }
    #[inline(always)]
    fn load_i8(self, from: &[i8]) -> __m512 {
        let from = &from[..16];
        unsafe {
            let bytes = _mm_loadu_si128(from.as_ptr().cast());
            _mm512_cvtepi32_ps(_mm512_cvtepi8_epi32(bytes))
        }
    }
    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn abs(self, a: __m512) -> __m512 {
        unsafe { _mm512_abs_ps(a) }
    }
    #[inline(always)]
    fn keep_where_ge(self, a: __m512, b: __m512, x: __m512) -> __m512 {
        unsafe { _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(a, b), x) }
    }
    #[inline(always)]
    fn sum(self, a: __m512) -> f32 {
        unsafe {
            let low = _mm512_castps512_ps256(a);
            let high = _mm512_castps512_ps256(_mm512_shuffle_f32x4::<0b01_00_11_10>(a, a));
            Avx2(()).sum(_mm256_add_ps(low, high))
        }
    }
    #[inline(always)]
    fn sum_four(self, [a, b, c, d]: [__m512; 4]) -> [f32; 4] {
        let mut sums = [0.0; 4];
        unsafe {
            // As for four lanes, in all quarters at once.
            let ab = _mm512_add_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let cd = _mm512_add_ps(_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
            let all = _mm512_add_ps(
                _mm512_shuffle_ps::<0b01_00_01_00>(ab, cd),
                _mm512_shuffle_ps::<0b11_10_11_10>(ab, cd),
            );
            let high = _mm512_shuffle_f32x4::<0b01_00_11_10>(all, all);
            let all = _mm256_add_ps(_mm512_castps512_ps256(all), _mm512_castps512_ps256(high));
            let all = _mm_add_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps::<1>(all));
            _mm_storeu_ps(sums.as_mut_ptr(), all);
        }
        sums
    }
    #[inline(always)]
    fn largest(self, a: __m512) -> f32 {
        unsafe {
            let low = _mm512_castps512_ps256(a);
            let high = _mm512_castps512_ps256(_mm512_shuffle_f32x4::<0b01_00_11_10>(a, a));
            Avx2(()).largest(_mm256_max_ps(low, high))
        }
    }
}
