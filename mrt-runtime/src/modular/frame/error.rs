//! What a frame refuses; it is then as it was.

use crate::light::limits::MAX_LIGHT_VALUE;

/// Why a frame did not take what it was given.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// Direct light from the caller has the wrong length, or values that are no irradiance.
    #[error(
        "direct light has {found} values, the first that is no irradiance at {faulty:?}; expected \
         {expected} values in [0, {MAX_LIGHT_VALUE}]"
    )]
    Direct {
        /// Three values a texel.
        expected: usize,
        /// Values given.
        found: usize,
        /// Position of the first that is negative, too large or NaN.
        faulty: Option<usize>,
    },
    /// No such door, or not a value for one.
    #[error("door {door} is set to {found}; expected one of {count} doors and a value in [0, 1]")]
    Door {
        /// The door given.
        door: usize,
        /// Doors in the scene.
        count: usize,
        /// The value given.
        found: f32,
    },
}
