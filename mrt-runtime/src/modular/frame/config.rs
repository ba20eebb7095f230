//! Settings of frames.

use crate::executor::{Executor, Serial};
use crate::output::probe_order::ProbeOrder;
use mrt_core::simd::SimdLevel;
use std::num::NonZero;
use std::sync::Arc;

/// Most passes of one solve: at albedo 0.99, the light left after them is 1e-18 of the first bounce.
pub const MAX_PASSES: u32 = 4096;

/// Which bounces a frame computes, with at most [`MAX_PASSES`] passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounces {
    /// A number of bounces, each a pass over the reduced operators; 0 leaves indirect light at zero.
    Count(u32),
    /// One pass that reflects the direct light of this frame and the indirect light of the previous one: many bounces
    /// over a few frames, at the cost of one bounce a frame.
    Feedback,
    /// Passes until no texel changes by more than `tolerance` times the brightest texel; at most `limit` passes.
    Converged {
        /// Relative change at which to stop.
        tolerance: f32,
        /// Most passes to make.
        limit: u32,
    },
}

/// What a frame computes besides irradiance at texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// Whether to fill the lightmap.
    pub lightmap: bool,
    /// Order of probes; `None` for no probes.
    pub probes: Option<ProbeOrder>,
    /// Whether to compute vector irradiance at texels.
    pub vector: bool,
}

impl Default for Outputs {
    /// The lightmap only.
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
    /// What to compute besides irradiance at texels.
    pub outputs: Outputs,
    /// Which bounces to compute.
    pub bounces: Bounces,
    /// Vector instructions to use. On a machine without them, the scalar reference runs.
    pub simd: SimdLevel,
    /// Changes of irradiance, W/m², that a frame may ignore: a block sends its light out again only when a texel
    /// changes by more, and light that arrives is shown only when it changes by more. It applies to [`Bounces::Count`]
    /// of 1 and [`Bounces::Feedback`].
    ///
    /// The default, 0, keeps only values that did not change at all. With feedback, rounding then changes the last bits
    /// of static light for ever; 1e-6 of the brightest irradiance lets it come to rest. With 1e-3 of the brightest, a
    /// frame in which one of four lamps moves takes 0.39 of the full time in a maze of 41 blocks.
    ///
    /// With albedos of up to a, the error of indirect light is at most `tolerance (1 + a)` after one bounce, and
    /// `tolerance (1 + a) / (1 - a)` over all bounces. The error of vector irradiance is no larger; that of the
    /// coefficients of probes, which are rotated to world axes up to five at a time, is at most √5 times as large.
    pub tolerance: f32,
    /// Most blocks whose light one frame brings up to date; `None`, the default, means all. It applies to
    /// [`Bounces::Count`] of 1 and [`Bounces::Feedback`].
    ///
    /// Blocks take turns, the one that waits longest first. If n blocks need direct light, the last gets it after n /
    /// `slice` frames, rounded up, and indirect light as many frames later: with 10 blocks a frame, 100 blocks take 10
    /// frames, then 10 more. Meanwhile, a lamp that moved lights both its old and its new place. If the indirect light
    /// of all blocks exceeds twice the most light that left the walls, all of it is scaled down until no block waits.
    pub slice: Option<NonZero<usize>>,
    /// Runs the work of a frame, on one thread or several.
    pub executor: Arc<dyn Executor>,
}

impl Default for FrameConfig {
    /// The lightmap, [`Bounces::Feedback`], the best vector instructions of the machine, all light up to date in every
    /// frame, and the caller's thread.
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
