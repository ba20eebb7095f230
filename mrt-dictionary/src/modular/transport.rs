//! Reduced transport inside a shape: `U_b`, `T_d->b` and the implicit lighting environment (Loos et al. 2011, section 4.1).
//!
//! [`modes`] decomposes; cubes, tubes and warped blocks have a file each that says what is decomposed.

pub mod modes;
pub mod cube;
pub mod tube;
pub mod warped;
