//! Which instructions kernels run with.

use mrt_core::simd::{Kernel, SimdLevel};
use std::sync::OnceLock;

/// The instructions that the variable `MRT_SIMD` names, or else the machine's fastest.
pub fn level() -> SimdLevel {
    static LEVEL: OnceLock<SimdLevel> = OnceLock::new();
    *LEVEL.get_or_init(|| {
        let named = std::env::var("MRT_SIMD").ok();
        named.map_or(SimdLevel::detect(), |name| {
            SimdLevel::from_name(&name)
                .filter(|level| level.is_available())
                .expect("MRT_SIMD names instructions that this machine has")
        })
    })
}

/// Runs a kernel with these instructions.
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    level().run(kernel)
}
