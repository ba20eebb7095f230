//! What a block gives besides irradiance: probes and vector irradiance.

pub mod cube;
pub mod warped;
