//! Tests of which direct light reaches a point, for [`Frame::solve_with`](crate::Frame::solve_with).

pub use crate::level::placed::PlacedLevel;
pub use crate::light::visibility::{
    Openings, RAY_REACH, Rays, Receiver, Toward, Versioned, Visibility,
};
