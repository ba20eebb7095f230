//! The offline half of Modular Radiance Transfer (Loos et al. 2011), in the order in which a bake runs.
//!
//! [`modular::bake`] is the list of calls for cubes, [`modular::bake_tubes`] that for round tubes, and
//! [`modular::variants`] makes operators for blocks that are warped too far for the canonical ones.

pub mod config;
pub mod progress;
mod matrix_parts;
mod parallel_products;
pub mod modular;
