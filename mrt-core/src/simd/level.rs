//! The choice of instructions.

use super::kernel::Kernel;
use super::lanes::Scalar;
#[cfg(target_arch = "aarch64")]
use super::neon;
#[cfg(target_arch = "x86_64")]
use super::x86;

/// A set of vector instructions.
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

    /// How many numbers one instruction works on.
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

    /// The levels that this machine has, slowest first.
    pub fn available() -> impl Iterator<Item = SimdLevel> {
        Self::ALL.into_iter().filter(|level| level.is_available())
    }

    /// The fastest level that this machine has.
    pub fn detect() -> Self {
        Self::available().last().unwrap_or(SimdLevel::Scalar)
    }

    /// The fastest level that this machine has and that has no more lanes than `cap`.
    pub fn capped(cap: SimdLevel) -> Self {
        Self::available()
            .filter(|level| level.lanes() <= cap.lanes())
            .last()
            .unwrap_or(SimdLevel::Scalar)
    }

    /// Runs a kernel with the instructions of this level, or as the scalar reference if the machine lacks
    /// them.
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
