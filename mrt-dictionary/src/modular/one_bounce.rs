//! The one-bounce operator F (Loos et al. 2011, section 3.1): from outgoing radiosity to incident irradiance.
//!
//! Cubes, tubes and warped blocks have a file each; [`rays`] estimates the same by ray tracing, for tests to compare.

mod orbits;
pub mod cube;
pub mod tube;
pub mod warped;
pub mod rays;
