//! Memory for intermediate results of kernels.

use mrt_core::simd::Aligned;
use mrt_core::simd::tiles::CHANNELS;

/// Memory for intermediate results of the kernels of one task.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// Radiosity of a block: for each class, channel by channel.
    pub(super) folded: Aligned<f32>,
    /// Joint coefficients multiplied by scales.
    pub(super) scaled: Aligned<f32>,
    /// Joint coefficients of a block.
    pub(crate) joint: Aligned<f32>,
}

impl Scratch {
    /// For blocks of up to `slots` slots and `coefficients` coefficients in all channels.
    pub(crate) fn new(slots: usize, coefficients: usize) -> Self {
        Self {
            folded: Aligned::zeroed(CHANNELS * slots),
            scaled: Aligned::zeroed(coefficients),
            joint: Aligned::zeroed(coefficients),
        }
    }
}

/// Flux in each channel, W/m² times the area of a canonical texel.
pub(crate) type Flux = [f64; CHANNELS];

/// Multiplies joint coefficients by the scales of a packed basis, row by row.
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
