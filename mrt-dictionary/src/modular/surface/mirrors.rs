//! The symmetries of canonical cubes, of round tubes and of warped blocks, acting on their texels.
//!
//! Symmetries that commute and are their own inverses split signals into parity classes
//! ([`mrt_core::linalg::parity`]), and everything in a bake is decomposed class by class.

pub mod cube;
pub mod tube;
pub mod warped;
