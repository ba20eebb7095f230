//! Operators of their own for blocks that are warped too far for the canonical ones.

pub mod warp_error;
pub mod build;
pub mod advice;
