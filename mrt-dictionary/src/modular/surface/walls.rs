//! Texels of the walls of canonical cubes, of round tubes and of warped blocks.

pub mod cube;
pub mod tube;
pub mod warped;
