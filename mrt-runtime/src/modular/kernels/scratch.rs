//! What kernels write on the way.

use mrt_core::simd::Aligned;
use mrt_core::simd::tiles::CHANNELS;

/// What kernels of one task write on the way.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// A block's radiosity by class, in that by channel.
    pub(super) folded: Aligned<f32>,
    /// Coefficients times scales.
    pub(super) scaled: Aligned<f32>,
    /// Joint coefficients of a block.
    pub(crate) joint: Aligned<f32>,
}

impl Scratch {
    /// For blocks of so many slots and coefficients.
    pub(crate) fn new(slots: usize, coefficients: usize) -> Self {
        Self {
            folded: Aligned::zeroed(CHANNELS * slots),
            scaled: Aligned::zeroed(coefficients),
            joint: Aligned::zeroed(coefficients),
        }
    }
}

/// Flux in units of a canonical texel's area, by channel.
pub(crate) type Flux = [f64; CHANNELS];

/// Joint coefficients times the scales of a packed basis, by mode.
#[inline(always)]
pub(super) fn scale_joint(scales: &[f32], joint: &[f32], scaled: &mut [f32]) {
    let place = joint.len() / CHANNELS;
    for channel in 0..CHANNELS {
        for (mode, scale) in scales.iter().enumerate() {
            let at = channel * place + mode;
            scaled[at] = joint[at] * scale;
        }
    }
}
