//! Vector instructions, chosen once at run time.
//!
//! A [`Kernel`] is written once, for any [`Lanes`]; [`SimdLevel::run`] compiles it for each instruction set and calls
//! the one that was chosen. Kernels are safe code: a value of a `Lanes` type exists only where the machine has its
//! instructions. [`Scalar`] is the reference that all others are compared with.
//!
//! Bits differ between levels, since they add in different orders and some fuse a product with a sum; each level gives
//! the same bits on every machine that has it.

mod aligned;
pub mod folded;
mod lanes;
pub mod rows;
pub mod tiles;
#[cfg(target_arch = "aarch64")]
mod neon;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use aligned::Aligned;
pub use lanes::{Lanes, Scalar, WIDEST, f32_from_f16_bits};

/// Which instructions to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdLevel {
    /// One number at a time; the reference.
    Scalar,
    /// 4 lanes; every x86-64 has it.
    Sse2,
    /// 8 lanes with AVX2, FMA and F16C.
    Avx2,
    /// 16 lanes with AVX-512 F and VL.
    Avx512,
    /// 4 lanes; every 64-bit ARM has it.
    Neon,
}

/// Code that runs with any lanes.
///
/// Everything that it calls with vectors must be inlined into it, or is compiled without the instructions and many times
/// slower: functions of one's own with `#[inline(always)]`, plain loops, no closures that are given to others.
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Runs it; mark implementations `#[inline(always)]`, or they are compiled without the instructions.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

impl SimdLevel {
    /// All levels of all machines, slowest first.
    pub const ALL: [SimdLevel; 5] = [
        SimdLevel::Scalar,
        SimdLevel::Sse2,
        SimdLevel::Neon,
        SimdLevel::Avx2,
        SimdLevel::Avx512,
    ];

    /// "scalar", "sse2", "avx2", "avx512" or "neon".
    pub const fn name(self) -> &'static str {
        match self {
            SimdLevel::Scalar => "scalar",
            SimdLevel::Sse2 => "sse2",
            SimdLevel::Avx2 => "avx2",
            SimdLevel::Avx512 => "avx512",
            SimdLevel::Neon => "neon",
        }
    }

    /// Inverse of [`SimdLevel::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.name() == name)
    }

    /// Numbers that one instruction works on.
    pub const fn lanes(self) -> usize {
        match self {
            SimdLevel::Scalar => 1,
            SimdLevel::Sse2 | SimdLevel::Neon => 4,
            SimdLevel::Avx2 => 8,
            SimdLevel::Avx512 => 16,
        }
    }

    /// True if this machine has the instructions.
    pub fn is_available(self) -> bool {
        match self {
            SimdLevel::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Sse2 => true,
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => x86::has_avx2(),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => x86::has_avx512(),
            #[cfg(target_arch = "aarch64")]
            SimdLevel::Neon => true,
            _ => false,
        }
    }

    /// Those that this machine has, slowest first.
    pub fn available() -> impl Iterator<Item = SimdLevel> {
        Self::ALL.into_iter().filter(|level| level.is_available())
    }

    /// The fastest that this machine has.
    pub fn detect() -> Self {
        Self::available().last().unwrap_or(SimdLevel::Scalar)
    }

    /// The fastest that this machine has and that is no wider than `cap`.
    pub fn capped(cap: SimdLevel) -> Self {
        Self::available()
            .filter(|level| level.lanes() <= cap.lanes())
            .last()
            .unwrap_or(SimdLevel::Scalar)
    }

    /// Runs a kernel with this level's instructions, or the scalar reference if the machine lacks them.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Sse2 => x86::run_sse2(kernel),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 if x86::has_avx2() => x86::run_avx2(kernel),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 if x86::has_avx512() => x86::run_avx512(kernel),
            #[cfg(target_arch = "aarch64")]
            SimdLevel::Neon => neon::run_neon(kernel),
            _ => kernel.run(Scalar),
        }
    }
}

#[cfg(test)]
mod tests;
