//! Code that is compiled for every instruction set.

use super::lanes::Lanes;

/// Code that runs with any lanes.
///
/// Everything that a kernel calls with vectors must be inlined into it. Otherwise it is compiled without
/// the instructions and is many times slower. So call only `#[inline(always)]` functions and plain loops,
/// and pass no closures to other code.
pub trait Kernel {
    /// What the kernel returns.
    type Output;
    /// Runs the kernel. Mark implementations `#[inline(always)]`, for the same reason.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}
