//! Lights, their shadows, and direct light at texels.

pub mod limits;
pub mod source;
pub mod placed;
pub mod visibility;
pub mod beam;
pub mod direct_light;
