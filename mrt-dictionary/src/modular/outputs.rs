//! What a basis holds besides the irradiance of walls: light at probes, and vector irradiance for normal maps (Loos et
//! al. 2011, section 6.5).

pub mod probe_samples;
pub mod polygon_light;
pub mod cube;
pub mod warped;
