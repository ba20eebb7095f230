//! Modular Radiance Transfer at run time, in the order in which data flows: a [`shape`] is a cube
//! with faces missing; a [`level`] places warped shapes and joins them; [`dictionary`] holds their
//! baked operators.

pub mod level;
pub mod level_text;
mod overlap;
pub mod shape;
