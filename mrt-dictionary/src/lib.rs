//! The offline half of Modular Radiance Transfer (Loos et al. 2011), in the order in which a bake runs.
//!
//! ```no_run
//! use mrt_dictionary::config::BakeConfig;
//! use mrt_dictionary::modular::bake::bake;
//! use mrt_dictionary::progress::Progress;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let config = BakeConfig::preset_for("standard", "cubes-2d")?;
//! config.check()?;
//! let dictionary = bake(&config, &Progress::silent())?;
//! let bytes = dictionary.to_bytes()?;
//! # Ok(())
//! # }
//! ```
//!
//! [`modular::bake`] is the list of calls for cubes, [`modular::bake_tubes`] that for round tubes, and
//! [`modular::variants`] makes operators for blocks that are warped too far for the canonical ones.

pub mod config;
pub mod progress;
mod matrix_parts;
mod parallel_products;
pub mod modular;
