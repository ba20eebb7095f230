//! The offline half of Modular Radiance Transfer (Loos et al. 2011), in the order in which a bake runs.
//!
//! For each canonical shape: the [`symmetry`] of its texels, the closed-form one-[`bounce`] operator, a
//! light [`prior`], and the reduced [`transport`]. For all together: [`lightfield`]s at the openings and the
//! [`interface`] operators between them. [`bake`] is that list of calls.
//!
//! For tubes: their own [`tube_bounce`], [`tube_prior`], [`tube_transport`], [`tube_lightfield`] and
//! [`tube_response`], called by [`tube_bake`].
//!
//! For a block that is warped too far for the canonical operators: its own [`warped_symmetry`],
//! [`warped_bounce`], [`warped_prior`] and [`warped`] transport, and the [`warp_error`] to decide by. What it
//! does at probes ([`warped_outputs`]) and through openings ([`warped_openings`]) joins them in [`variants`].

pub mod config;
pub mod progress;
pub mod outputs;
pub mod symmetry;
pub mod bounce;
pub mod bounce_rays;
pub mod prior;
pub mod transport;
pub mod path_transport;
pub mod shape_transport;
pub mod emission;
pub mod response;
pub mod joint;
pub mod lightfield;
pub mod interface;
pub mod bake;
pub mod spectrum;
pub mod warped_symmetry;
pub mod warped_bounce;
pub mod warped_prior;
mod snapshots;
pub mod warped;
pub mod warp_error;
pub mod warped_outputs;
pub mod warped_openings;
pub mod variants;
pub mod warp_advice;
pub mod tube_bounce;
pub mod tube_prior;
pub mod tube_lightfield;
pub mod tube_response;
pub mod tube_transport;
pub mod tube_bake;
