//! Reduced transport inside a shape: `U_b`, `T_d->b` and the implicit lighting environment (Loos et al. 2011, section 4.1).

pub mod modes;
pub mod cube;
pub mod tube;
pub mod warped;
