//! Exact transport along paths of openings, reduced: a basis for what is sent, a basis for what arrives, and the operator
//! of each path between them.

pub mod ends;
pub mod gather;
pub mod emission;
pub mod response;
pub mod arrival;
pub mod warped;
