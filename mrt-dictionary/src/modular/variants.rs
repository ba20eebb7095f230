//! Operators of their own for blocks that are warped too far for the canonical ones: who needs them ([`warp_error`],
//! [`advice`]), and how they are made ([`build`]).

pub mod warp_error;
mod operators;
pub mod build;
pub mod advice;
