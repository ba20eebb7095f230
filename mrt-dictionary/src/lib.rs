//! The offline half of Modular Radiance Transfer, in the order in which a bake runs.

pub mod config;
pub mod progress;
pub mod symmetry;
pub mod bounce;
pub mod prior;
pub mod transport;
pub mod lightfield;
pub mod interface;
pub mod bake;
