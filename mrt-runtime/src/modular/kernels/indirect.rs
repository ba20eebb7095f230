//! Indirect irradiance `U_b b + U_r r` from joint coefficients, one block at a time.

use crate::modular::kernels::scratch::{Flux, Scratch, scale_joint};
use crate::modular::packed::numbers::PackedNumbers;
use crate::modular::packed::shape::PackedShape;
use mrt_core::simd::folded::{Basis, unfold};
use mrt_core::simd::tiles::{CHANNELS, PackedNumber, Rgb};
use mrt_core::simd::{Kernel, Lanes};

/// Computes the irradiance of one block from its joint coefficients.
pub(crate) struct IndirectOf<'a> {
    pub shape: &'a PackedShape,
    pub joint: &'a [f32],
    pub scratch: &'a mut Scratch,
    /// Whether to find the largest change and the largest irradiance; otherwise only whether there is light.
    pub compare: bool,
    /// Output: irradiance. Its old content is only used for [`Arrived::change`].
    pub indirect: [&'a mut [f32]; CHANNELS],
}

/// Light that arrived at the walls of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Arrived {
    pub flux: Flux,
    /// Largest change of irradiance, W/m²; 0 if not compared.
    pub change: f32,
    /// Largest irradiance, W/m²; if not compared, any number that is 0 exactly when the block is dark.
    pub peak: f32,
}

impl Kernel for IndirectOf<'_> {
    type Output = Arrived;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Arrived {
        match (&self.shape.joint, self.shape.folding.mirrors) {
            (PackedNumbers::F32(joint), 0) => expand::<L, f32, 1>(l, joint, &mut self),
            (PackedNumbers::F32(joint), 1) => expand::<L, f32, 2>(l, joint, &mut self),
            (PackedNumbers::F32(joint), 2) => expand::<L, f32, 4>(l, joint, &mut self),
            (PackedNumbers::F32(joint), _) => expand::<L, f32, 8>(l, joint, &mut self),
            (PackedNumbers::F16(joint), 0) => expand::<L, u16, 1>(l, joint, &mut self),
            (PackedNumbers::F16(joint), 1) => expand::<L, u16, 2>(l, joint, &mut self),
            (PackedNumbers::F16(joint), 2) => expand::<L, u16, 4>(l, joint, &mut self),
            (PackedNumbers::F16(joint), _) => expand::<L, u16, 8>(l, joint, &mut self),
            (PackedNumbers::Int8(joint), 0) => expand::<L, i8, 1>(l, joint, &mut self),
            (PackedNumbers::Int8(joint), 1) => expand::<L, i8, 2>(l, joint, &mut self),
            (PackedNumbers::Int8(joint), 2) => expand::<L, i8, 4>(l, joint, &mut self),
            (PackedNumbers::Int8(joint), _) => expand::<L, i8, 8>(l, joint, &mut self),
        }
    }
}

#[inline(always)]
fn expand<L: Lanes, E: PackedNumber, const GROUP: usize>(
    l: L,
    joint: &[E],
    block: &mut IndirectOf<'_>,
) -> Arrived {
    let shape = block.shape;
    let mut x = block.joint;
    if !shape.joint_scales.is_empty() {
        let scaled = &mut block.scratch.scaled[..x.len()];
        scale_joint(&shape.joint_scales, x, scaled);
        x = scaled;
    }
    let x = Rgb::new(x, x.len() / CHANNELS);
    let basis = Basis {
        tiles: joint,
        classes: &shape.joint_classes,
        weight: &shape.folding.weight,
    };
    let found = if block.compare {
        unfold::<L, E, GROUP, true>(l, basis, x, &mut block.indirect)
    } else {
        unfold::<L, E, GROUP, false>(l, basis, x, &mut block.indirect)
    };
    let [red, green, blue] = found.sums;
    Arrived {
        flux: [f64::from(red), f64::from(green), f64::from(blue)],
        change: found.change,
        peak: if block.compare {
            found.peak
        } else {
            // Only used as an is-lit flag.
            red.max(green).max(blue)
        },
    }
}
