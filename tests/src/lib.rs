//! What tests share.
//!
//! Dictionaries and bakes, levels by floor plan or at random, frames in a call, irradiance by texel, what frames are
//! compared with, [`tunnels`], meshes, checks of beams ([`beam_check`]) and of [`warped`] blocks, and what readers are
//! tried with ([`harness`]).

mod random;
mod threads;
mod dictionaries;
mod levels;
mod random_levels;
mod scenes;
mod irradiance;
mod flux;
mod frames;
mod references;
mod meshes;
pub mod tunnels;
pub mod beam_check;
pub mod warped;
pub mod harness;

pub use dictionaries::*;
pub use flux::Flux;
pub use frames::*;
pub use irradiance::*;
pub use levels::*;
pub use meshes::*;
pub use random::Random;
pub use random_levels::*;
pub use references::*;
pub use scenes::*;
pub use threads::with_threads;
