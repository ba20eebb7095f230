//! The products of a frame, one block at a time. Each is written once for all instruction sets, with
//! [`Lanes`](mrt_core::simd::Lanes).

pub(crate) mod scratch;
pub(crate) mod coefficients;
pub(crate) mod responses;
pub(crate) mod indirect;
pub(crate) mod expand;
