//! The light prior P: a basis of plausible direct light (Loos et al. 2011, section 4).
//!
//! Cubes, tubes and warped blocks each have a file with the prior's lights and the samples of direct light from them;
//! [`basis`] decomposes and enriches the samples of all.

pub mod basis;
pub mod cube;
pub mod tube;
pub mod warped;
