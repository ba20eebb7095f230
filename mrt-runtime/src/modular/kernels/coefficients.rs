//! `b = T_d->b (albedo (direct + indirect) + emission)`, one block at a time.

use crate::modular::kernels::scratch::{Flux, Scratch};
use crate::modular::packed::numbers::PackedNumbers;
use crate::modular::packed::shape::PackedShape;
use glam::Vec3;
use mrt_core::simd::folded::{Albedo, Reflected, fold};
use mrt_core::simd::rows::{DOT_ROWS, dot_rows, dot_unlike_rows};
use mrt_core::simd::tiles::{CHANNELS, PackedNumber};
use mrt_core::simd::{Kernel, Lanes};

/// `b = T_d->b (albedo (direct + indirect) + emission)` of one block.
pub(crate) struct CoefficientsOf<'a> {
    pub shape: &'a PackedShape,
    pub direct: [&'a [f32]; CHANNELS],
    pub indirect: Option<[&'a [f32]; CHANNELS]>,
    pub albedo: [&'a [f32]; CHANNELS],
    /// The albedo of all texels, if it is the same for all.
    pub uniform: Option<Vec3>,
    pub emission: Option<[&'a [f32]; CHANNELS]>,
    pub scratch: &'a mut Scratch,
    /// Output, channel by channel. Rows without a coefficient b are zero, and stay zero.
    pub coefficients: &'a mut [f32],
}

/// Flux that left the walls of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sent {
    /// All flux.
    pub all: Flux,
    /// The part that is reflected direct light, and emission.
    pub fresh: Flux,
}

impl Kernel for CoefficientsOf<'_> {
    type Output = Sent;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Sent {
        let sent = match self.shape.folding.mirrors {
            0 => fold_block::<L, 1>(l, &mut self),
            1 => fold_block::<L, 2>(l, &mut self),
            2 => fold_block::<L, 4>(l, &mut self),
            _ => fold_block::<L, 8>(l, &mut self),
        };
        match &self.shape.from_direct {
            PackedNumbers::F32(rows) => coefficients(l, rows, &mut self),
            PackedNumbers::F16(rows) => coefficients(l, rows, &mut self),
            PackedNumbers::Int8(rows) => coefficients(l, rows, &mut self),
        }
        sent
    }
}

impl CoefficientsOf<'_> {
    /// The albedo that multiplies sums of light, where no texel's light needs to be multiplied; `None` otherwise.
    #[inline(always)]
    fn later(&self) -> Option<[f32; CHANNELS]> {
        match (self.uniform, self.emission) {
            (Some(albedo), None) => Some(albedo.to_array()),
            _ => None,
        }
    }
}

#[inline(always)]
fn fold_block<L: Lanes, const GROUP: usize>(l: L, block: &mut CoefficientsOf<'_>) -> Sent {
    let later = block.later();
    let light = Reflected {
        direct: block.direct,
        indirect: block.indirect,
        albedo: match (later, block.uniform) {
            (Some(_), _) => Albedo::Later,
            (None, Some(albedo)) => Albedo::Uniform(albedo.to_array()),
            (None, None) => Albedo::Each(block.albedo),
        },
        emission: block.emission,
    };
    let weight = &block.shape.folding.weight;
    let sums = fold::<L, GROUP>(l, light, weight, &mut block.scratch.folded);
    let mut sent = Sent::default();
    for channel in 0..CHANNELS {
        let albedo = later.map_or(1.0, |albedo| f64::from(albedo[channel]));
        sent.all[channel] = albedo * f64::from(sums.all[channel]);
        sent.fresh[channel] = albedo * f64::from(sums.fresh[channel]);
    }
    sent
}

#[inline(always)]
fn coefficients<L: Lanes, E: PackedNumber>(l: L, rows: &[E], block: &mut CoefficientsOf<'_>) {
    let stride = block.shape.folding.stride;
    let place = block.coefficients.len() / CHANNELS;
    let albedo = block.later().unwrap_or([1.0; CHANNELS]);
    let folded = &block.scratch.folded[..];
    let mut start = 0;
    for group in &block.shape.groups {
        let count = usize::from(group.count);
        let end = start + count * stride;
        let numbers = &rows[std::mem::replace(&mut start, end)..end];
        let of_class = |class: u8| usize::from(class) * CHANNELS * stride;
        let sums = if group.is_mixed {
            let starts = group.classes.map(of_class);
            dot_unlike_rows(l, numbers, folded, starts, stride)
        } else {
            let folded = &folded[of_class(group.classes[0])..][..CHANNELS * stride];
            let (red, rest) = folded.split_at(stride);
            let (green, blue) = rest.split_at(stride);
            dot_rows(l, count, numbers, [red, green, blue])
        };
        for (channel, sums) in sums.iter().enumerate() {
            let mut scaled = [0.0; DOT_ROWS];
            for (row, scaled) in scaled.iter_mut().enumerate() {
                *scaled = sums[row] * (group.scales[row] * albedo[channel]);
            }
            let to = &mut block.coefficients[channel * place..(channel + 1) * place];
            if group.is_mixed {
                for (&row, scaled) in group.rows.iter().zip(scaled) {
                    to[usize::from(row)] = scaled;
                }
            } else {
                // A group that is not full writes zeros to the rows after it; the groups of those rows come later.
                let first = usize::from(group.rows[0]);
                to[first..first + DOT_ROWS].copy_from_slice(&scaled);
            }
        }
    }
}
