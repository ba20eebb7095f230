//! Why a frame refuses input. The frame is then unchanged.

use crate::light::limits::MAX_LIGHT_VALUE;

/// Why a frame refused input.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// Direct light from the caller has the wrong length, or values that are negative, too large or NaN.
    #[error(
        "direct light has {found} values{}; expected {expected} values in [0, {MAX_LIGHT_VALUE:e}]",
        faulty.map_or(String::new(), |at| format!(", and value {at} is out of range"))
    )]
    Direct {
        /// Three values for each texel.
        expected: usize,
        /// Number of values given.
        found: usize,
        /// Position of the first value that is negative, too large or NaN.
        faulty: Option<usize>,
    },
    /// There is no such door, or its value is not in [0, 1].
    #[error("door {door} is set to {found}; expected one of {count} doors and a value in [0, 1]")]
    Door {
        /// The door given.
        door: usize,
        /// Number of doors in the scene.
        count: usize,
        /// The value given.
        found: f32,
    },
}
