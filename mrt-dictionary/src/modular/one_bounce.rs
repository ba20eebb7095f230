//! The one-bounce operator F (Loos et al. 2011, section 3.1): from outgoing radiosity to incident irradiance.

pub mod cube;
pub mod rays;
pub mod tube;
pub mod warped;
