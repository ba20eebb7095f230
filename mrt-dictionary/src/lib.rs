//! The offline half of Modular Radiance Transfer (Loos et al. 2011), in the order in which a bake runs.
//!
//! For each canonical shape: the [`symmetry`] of its texels, the closed-form one-[`bounce`] operator, a
//! light [`prior`], and the reduced [`transport`]. For all together: [`lightfield`]s at the openings and the
//! [`interface`] operators between them. [`bake`] is that list of calls.

pub mod config;
pub mod progress;
pub mod symmetry;
pub mod bounce;
pub mod bounce_rays;
pub mod prior;
pub mod transport;
pub mod lightfield;
pub mod interface;
pub mod bake;
pub mod spectrum;
pub mod tube_bounce;
pub mod tube_prior;
pub mod tube_lightfield;
pub mod tube_response;
