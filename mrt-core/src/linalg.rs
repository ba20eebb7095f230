//! Dense matrices and their decompositions.

pub mod matrix;
pub mod parity;
#[cfg(feature = "svd")]
pub mod parity_modes;
#[cfg(feature = "svd")]
pub mod least_squares;
#[cfg(feature = "svd")]
pub mod svd;
