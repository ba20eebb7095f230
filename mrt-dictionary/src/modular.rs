//! The bake of Modular Radiance Transfer: [`bake`] is its list of calls for cubes, [`bake_tubes`] for round tubes, and
//! [`variants`] for blocks that need operators of their own.

pub mod surface;
pub mod outputs;
pub mod one_bounce;
pub mod light_prior;
pub mod transport;
pub mod paths;
pub mod joint;
pub mod shape_set;
pub mod lightfield;
pub mod bake;
pub mod bake_tubes;
pub mod spectrum;
pub mod variants;
