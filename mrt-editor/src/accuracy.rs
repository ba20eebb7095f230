//! How far light is off: from the exact solution of a level, and from files of another renderer.

pub mod exact_level;
pub mod reference_file;
