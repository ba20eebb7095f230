//! What callers choose about frames.

use crate::executor::{Executor, Serial};
use crate::output::probe_order::ProbeOrder;
use mrt_core::simd::SimdLevel;
use std::num::NonZero;
use std::sync::Arc;

/// Passes in one frame, at most: at albedo 0.99 the light left after them is 1e-18 of the first.
pub const MAX_PASSES: u32 = 4096;

/// Which bounces a frame computes; more than [`MAX_PASSES`] passes are not made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounces {
    /// This many, each a pass over the reduced operators; 0 leaves indirect light at zero.
    Count(u32),
    /// One pass that reflects the previous frame's indirect light with this frame's direct light: many
    /// bounces over a few frames at the cost of one.
    Feedback,
    /// Passes until no texel changes by more than `tolerance` of the brightest, at most `limit`.
    Converged {
        /// Relative change at which to stop.
        tolerance: f32,
        /// Most passes.
        limit: u32,
    },
}

/// What a frame computes besides irradiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// The lightmap.
    pub lightmap: bool,
    /// Probes, with so many coefficients.
    pub probes: Option<ProbeOrder>,
    /// Vector irradiance at texels.
    pub vector: bool,
}

impl Default for Outputs {
    /// The lightmap alone.
    fn default() -> Self {
        Self {
            lightmap: true,
            probes: None,
            vector: false,
        }
    }
}

/// How frames are computed.
#[derive(Clone, Debug)]
pub struct FrameConfig {
    /// What to compute besides irradiance.
    pub outputs: Outputs,
    /// How often light is reflected.
    pub bounces: Bounces,
    /// Instructions to use; the scalar reference where the machine lacks them.
    pub simd: SimdLevel,
    /// Irradiance, W/m², by which a texel's light may change before its block's light is sent out anew, and by which light
    /// that arrives may change before it is shown; with [`Bounces::Count`] of 1 and [`Bounces::Feedback`]. With albedos of
    /// up to a, indirect light is then off by at most `tolerance (1 + a)` after one bounce, and by
    /// `tolerance (1 + a) / (1 - a)` over all; vector irradiance by no more, and coefficients of probes, which are turned
    /// to the world's axes five at a time, by √5 times that. At 0, the
    /// default, what is kept is kept because nothing about it changed, bit by bit; with feedback, rounding then changes
    /// the last bits for ever, and some 1e-6 of the brightest irradiance lets static light come to rest. With 1e-3 of the
    /// brightest, one moving lamp of four in a maze of 41 blocks takes 0.39 of the time of all.
    pub tolerance: f32,
    /// Blocks whose light is brought up to date in a frame, at most, with the same bounces. When n blocks need it, the
    /// last of them waits for n / `slice` frames, rounded up: oldest first; direct light, and then indirect light as long
    /// again. Light that moves is there twice meanwhile; where indirect light comes to twice the most that left the walls,
    /// all of it is scaled down until the last block had its turn. `None`, the default: all.
    pub slice: Option<NonZero<usize>>,
    /// Who does the work.
    pub executor: Arc<dyn Executor>,
}

impl Default for FrameConfig {
    /// The lightmap, one more bounce each frame, with the best instructions that the machine has, everything up to date,
    /// on the caller's thread.
    fn default() -> Self {
        Self {
            outputs: Outputs::default(),
            bounces: Bounces::Feedback,
            simd: SimdLevel::detect(),
            tolerance: 0.0,
            slice: None,
            executor: Arc::new(Serial),
        }
    }
}
