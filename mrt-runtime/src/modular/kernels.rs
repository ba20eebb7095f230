//! The products of a frame, one block at a time, each written once over [`Lanes`](mrt_core::simd::Lanes).

pub(crate) mod scratch;
pub(crate) mod coefficients;
pub(crate) mod responses;
pub(crate) mod indirect;
pub(crate) mod expand;
