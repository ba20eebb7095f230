//! Vector instructions, chosen once at run time.
//!
//! A [`Kernel`] is written once, for any [`Lanes`]. [`SimdLevel::run`] compiles it for each instruction
//! set and calls the one that was chosen. Kernels are safe code: a value of a `Lanes` type exists only
//! where the machine has its instructions. [`Scalar`] is the reference that all other lanes are compared
//! with.
//!
//! Bits differ between levels, which add in different orders, and some of which fuse a product with a
//! sum. Each level gives the same bits on every machine that has it.

mod aligned;
mod lanes;
mod kernel;
#[cfg(target_arch = "aarch64")]
mod neon;
#[cfg(target_arch = "x86_64")]
mod x86;
mod level;
pub mod tiles;
pub mod rows;
pub mod folded;

pub use aligned::Aligned;
pub use kernel::Kernel;
pub use lanes::{Lanes, Scalar, WIDEST, f32_from_f16_bits};
pub use level::SimdLevel;

#[cfg(test)]
mod tests;
