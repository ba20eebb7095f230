//! Mirrors of a shape and of its texels.

pub mod mirrors;
pub mod warped_mirrors;
