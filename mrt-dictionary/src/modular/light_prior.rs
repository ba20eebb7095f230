//! Plausible direct light, the light prior P (Loos et al. 2011, section 4).

pub mod cube;
pub mod tube;
pub mod warped;
