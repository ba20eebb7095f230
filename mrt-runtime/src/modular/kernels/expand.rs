//! A basis that is not folded by mirrors times joint coefficients, one block at a time: probes and vector irradiance.

use crate::modular::kernels::scratch::{Scratch, scale_joint};
use crate::modular::packed::numbers::PackedNumbers;
use crate::modular::packed::shape::Tiled;
use mrt_core::simd::tiles::{CHANNELS, PackedNumber, Rgb, TILE, Term, sum_tile};
use mrt_core::simd::{Kernel, Lanes, WIDEST};

/// Multiplies a tiled basis by joint coefficients.
pub(crate) struct Expand<'a> {
    pub basis: &'a Tiled,
    /// Number of rows to compute, from the first.
    pub rows: usize,
    pub joint: &'a [f32],
    pub scratch: &'a mut Scratch,
    /// Output: at least `rows` numbers in each channel.
    pub out: [&'a mut [f32]; CHANNELS],
}

impl Kernel for Expand<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) {
        let basis = self.basis;
        match &basis.values {
            PackedNumbers::F32(values) => expand_rows(l, values, &mut self),
            PackedNumbers::F16(values) => expand_rows(l, values, &mut self),
            PackedNumbers::Int8(values) => expand_rows(l, values, &mut self),
        }
    }
}

#[inline(always)]
fn expand_rows<L: Lanes, E: PackedNumber>(l: L, values: &[E], job: &mut Expand<'_>) {
    let basis = job.basis;
    let columns = basis.columns.get(0..basis.columns.len());
    let count = columns.indices().len();
    let mut x = job.joint;
    if !basis.scales.is_empty() {
        scale_joint(&basis.scales, x, &mut job.scratch.scaled);
        x = &job.scratch.scaled[..x.len()];
    }
    let x = Rgb::new(x, x.len() / CHANNELS);
    for row in (0..job.rows).step_by(TILE) {
        let mut sums = [[0.0f32; TILE]; CHANNELS];
        let term = Term {
            panel: &values[row * count..(row + TILE) * count],
            columns,
            x,
            scales: &[],
        };
        let to = sums.each_mut().map(|sums| &mut sums[..]);
        sum_tile(l, std::iter::once(term), None, to);
        let height = TILE.min(job.rows - row);
        for (out, sums) in job.out.iter_mut().zip(&sums) {
            out[row..row + height].copy_from_slice(&sums[..height]);
        }
    }
}

const _: () = assert!(TILE == WIDEST, "strides are whole tiles");
