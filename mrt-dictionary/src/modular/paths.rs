//! Exact transport along paths of openings, projected on what arrives.

pub mod transport;
pub mod emission;
pub mod response;
pub mod warped;
