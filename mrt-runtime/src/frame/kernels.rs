//! The two products of a pass, one block at a time.

use crate::packed::{PackedShape, PackedTransport, TransportEntry, Values};
use glam::Vec3;
use mrt_core::simd::folded::{Albedo, Reflected, Unfolded, fold, unfold};
use mrt_core::simd::tiles::{
    CHANNELS, Element, Rgb, TILE, Term, dot_rows, multiply_tiles, sum_half_tile, sum_tile,
    sum_two_tiles,
};
use mrt_core::simd::{Kernel, Lanes, WIDEST};
use std::ops::Range;

/// What kernels of one task write on the way.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// A block's radiosity by class, in that by channel; or the irradiance of two.
    folded: Vec<f32>,
    /// Coefficients times scales.
    scaled: Vec<f32>,
}

impl Scratch {
    /// For blocks of so many slots, and so many coefficients a channel.
    pub(super) fn new(slots: usize, coefficients: usize) -> Self {
        Self {
            folded: vec![0.0; 2 * CHANNELS * slots],
            scaled: vec![0.0; 2 * CHANNELS * coefficients],
        }
    }
}

/// Flux in units of a canonical texel's area, by channel.
pub(super) type Flux = [f64; CHANNELS];

/// `b = T_d->b (albedo (direct + indirect) + emission)` of one block.
pub(super) struct CoefficientsOf<'a> {
    pub shape: &'a PackedShape,
    pub direct: [&'a [f32]; CHANNELS],
    pub indirect: Option<[&'a [f32]; CHANNELS]>,
    pub albedo: [&'a [f32]; CHANNELS],
    /// The albedo of all texels, if they have the same.
    pub uniform: Option<Vec3>,
    pub emission: Option<[&'a [f32]; CHANNELS]>,
    pub scratch: &'a mut Scratch,
    /// Channel by channel.
    pub coefficients: &'a mut [f32],
}

/// What left a block's walls.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sent {
    /// All of it.
    pub all: Flux,
    /// Reflected direct light, and emission.
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
        match &self.shape.rows {
            Values::F32(rows) => coefficients(l, rows, &mut self),
            Values::F16(rows) => coefficients(l, rows, &mut self),
            Values::Int8(rows) => coefficients(l, rows, &mut self),
        }
        sent
    }
}

#[inline(always)]
fn fold_block<L: Lanes, const GROUP: usize>(l: L, block: &mut CoefficientsOf<'_>) -> Sent {
    let weight = &block.shape.folding.weight[..];
    let stride = weight.len();
    let mut sent = Sent::default();
    for channel in 0..CHANNELS {
        let light = Reflected {
            direct: block.direct[channel],
            indirect: block.indirect.map(|i| i[channel]),
            albedo: match block.uniform {
                Some(albedo) => Albedo::Uniform(albedo[channel]),
                None => Albedo::Each(block.albedo[channel]),
            },
            emission: block.emission.map(|e| e[channel]),
        };
        let folded = &mut block.scratch.folded[channel * stride..];
        let sums = fold::<L, GROUP>(l, light, weight, folded, CHANNELS * stride);
        (sent.all[channel], sent.fresh[channel]) = (f64::from(sums[0]), f64::from(sums[1]));
    }
    sent
}

#[inline(always)]
fn coefficients<L: Lanes, E: Element>(l: L, rows: &[E], block: &mut CoefficientsOf<'_>) {
    let stride = block.shape.folding.stride;
    let place = block.coefficients.len() / CHANNELS;
    let mut start = 0;
    for group in &block.shape.groups {
        let end = start + usize::from(group.count) * stride;
        let rows = &rows[std::mem::replace(&mut start, end)..end];
        let class = usize::from(group.class) * CHANNELS * stride;
        let folded = &block.scratch.folded[class..class + CHANNELS * stride];
        let x = [
            &folded[..stride],
            &folded[stride..2 * stride],
            &folded[2 * stride..],
        ];
        let sums = dot_rows(l, rows, x);
        for (row, sums) in sums.iter().take(usize::from(group.count)).enumerate() {
            for (channel, sum) in sums.iter().enumerate() {
                let at = channel * place + usize::from(group.modes[row]);
                block.coefficients[at] = sum * group.scales[row];
            }
        }
    }
}

/// `r = T_b->r b` of one block, and its own coefficients.
pub(super) struct ResponsesOf<'a> {
    /// Its place.
    pub block: usize,
    pub shape: &'a PackedShape,
    pub transport: &'a PackedTransport,
    /// Coefficients b of all blocks.
    pub coefficients: &'a [f32],
    /// Whether a block has any.
    pub has_coefficients: &'a [bool],
    /// Whether all blocks have.
    pub all_lit: bool,
    pub gate_values: &'a [f32],
    /// Joint coefficients of this block.
    pub joint: &'a mut [f32],
}

/// Irradiance of one block, or of two of one shape, from their joint coefficients.
pub(super) struct IndirectOf<'a, const BLOCKS: usize> {
    pub shape: &'a PackedShape,
    pub joint: [&'a [f32]; BLOCKS],
    pub scratch: &'a mut Scratch,
    /// Whether to find the largest change and irradiance; without, only whether there is light is known.
    pub compare: bool,
    /// Irradiance; what was there before is replaced.
    pub indirect: [[&'a mut [f32]; CHANNELS]; BLOCKS],
}

/// What arrived at a block's walls.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrived {
    pub flux: Flux,
    /// Largest change of irradiance, W/m²; 0 if not compared.
    pub change: f32,
    /// Largest irradiance, W/m²; if not compared, a number that is 0 where that is.
    pub peak: f32,
}

impl Kernel for ResponsesOf<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) {
        match &self.transport.values {
            Some(Values::F32(values)) => arrive(l, values, &mut self),
            Some(Values::F16(values)) => arrive(l, values, &mut self),
            Some(Values::Int8(values)) => arrive(l, values, &mut self),
            None => {}
        }
    }
}

impl<const BLOCKS: usize> Kernel for IndirectOf<'_, BLOCKS> {
    type Output = [Arrived; BLOCKS];

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> [Arrived; BLOCKS] {
        match (&self.shape.joint, self.shape.folding.mirrors) {
            (Values::F32(joint), 0) => expand::<L, f32, 1, BLOCKS>(l, joint, &mut self),
            (Values::F32(joint), 1) => expand::<L, f32, 2, BLOCKS>(l, joint, &mut self),
            (Values::F32(joint), 2) => expand::<L, f32, 4, BLOCKS>(l, joint, &mut self),
            (Values::F32(joint), _) => expand::<L, f32, 8, BLOCKS>(l, joint, &mut self),
            (Values::F16(joint), 0) => expand::<L, u16, 1, BLOCKS>(l, joint, &mut self),
            (Values::F16(joint), 1) => expand::<L, u16, 2, BLOCKS>(l, joint, &mut self),
            (Values::F16(joint), 2) => expand::<L, u16, 4, BLOCKS>(l, joint, &mut self),
            (Values::F16(joint), _) => expand::<L, u16, 8, BLOCKS>(l, joint, &mut self),
            (Values::Int8(joint), 0) => expand::<L, i8, 1, BLOCKS>(l, joint, &mut self),
            (Values::Int8(joint), 1) => expand::<L, i8, 2, BLOCKS>(l, joint, &mut self),
            (Values::Int8(joint), 2) => expand::<L, i8, 4, BLOCKS>(l, joint, &mut self),
            (Values::Int8(joint), _) => expand::<L, i8, 8, BLOCKS>(l, joint, &mut self),
        }
    }
}

#[inline(always)]
fn arrive<L: Lanes, E: Element>(l: L, values: &[E], block: &mut ResponsesOf<'_>) {
    let transport = block.transport;
    let stride = block.coefficients.len() / block.has_coefficients.len().max(1);
    let mode_stride = stride / CHANNELS;
    let place = block.joint.len() / CHANNELS;
    let own = &block.coefficients[block.block * stride..(block.block + 1) * stride];
    let tiles = transport.tiles_of_block[block.block].clone();
    let tiles = &transport.tiles[tiles.start as usize..tiles.end as usize];
    for (tile, row_tile) in tiles.iter().zip(&block.shape.row_tiles) {
        let rows = usize::from(row_tile.height);
        let mut sums = [[0.0f32; TILE]; CHANNELS];
        let entries = &transport.entries[tile.entries.start as usize..tile.entries.end as usize];
        // Gated ones come first.
        let gated = entries.partition_point(|entry| entry.gate != u32::MAX);
        let mut behind_doors = [[0.0f32; TILE]; CHANNELS];
        for entry in &entries[..gated] {
            let factor = block.gate_values[entry.gate as usize];
            if factor == 0.0 || !block.has_coefficients[entry.source as usize] {
                continue;
            }
            let columns = entry.columns.start as usize..entry.columns.end as usize;
            let term = Term {
                panels: [&values[entry.start as usize..][..columns.len() * rows]],
                columns: transport.columns.get(columns.clone()),
                x: Rgb::new(block.coefficients, mode_stride),
                scales: transport.column_scales.get(columns).unwrap_or(&[]),
            };
            sum_terms(l, std::iter::once(term), rows, &mut sums);
            for (to, from) in behind_doors
                .as_flattened_mut()
                .iter_mut()
                .zip(sums.as_flattened())
            {
                *to += factor * from;
            }
        }
        let runs = LitRuns {
            entries: &entries[gated..],
            has_coefficients: block.has_coefficients,
            all_lit: block.all_lit,
        };
        let x = Rgb::new(block.coefficients, mode_stride);
        let lit = runs.map(|(columns, start)| Term {
            panels: [&values[start..start + columns.len() * rows]],
            columns: transport.columns.get(columns.clone()),
            x,
            scales: transport.column_scales.get(columns).unwrap_or(&[]),
        });
        sum_terms(l, lit, rows, &mut sums);
        if gated > 0 {
            for (to, from) in sums
                .as_flattened_mut()
                .iter_mut()
                .zip(behind_doors.as_flattened())
            {
                *to += from;
            }
        }
        let first = usize::from(row_tile.start);
        let of_tile = first..first + usize::from(row_tile.count);
        let modes = &block.shape.row_order[of_tile.clone()];
        let inverses = &block.shape.row_inverses[of_tile];
        for (channel, sums) in sums.iter().enumerate() {
            let joint = &mut block.joint[channel * place..(channel + 1) * place];
            for ((&mode, inverse), sum) in modes.iter().zip(inverses).zip(sums) {
                joint[usize::from(mode)] = sum * (tile.scale * inverse);
            }
        }
    }
    // The first joint modes are the block's own.
    for channel in 0..CHANNELS {
        let joint = &mut block.joint[channel * place..(channel + 1) * place];
        let own = &own[channel * mode_stride..][..block.shape.modes];
        for (joint, own) in joint.iter_mut().zip(own) {
            *joint += own;
        }
    }
}

/// Runs of entries whose sources have light: their columns and numbers stand side by side, and one long product has no
/// branch that the machine guesses wrong, where many short ones have two each.
struct LitRuns<'a> {
    entries: &'a [TransportEntry],
    has_coefficients: &'a [bool],
    all_lit: bool,
}

impl Iterator for LitRuns<'_> {
    /// Columns, and the first number.
    type Item = (Range<usize>, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        if self.all_lit {
            return run_of(std::mem::take(&mut self.entries));
        }
        let is_lit = |entry: &TransportEntry| self.has_coefficients[entry.source as usize];
        let dark = self.entries.iter().take_while(|entry| !is_lit(entry));
        let rest = &self.entries[dark.count()..];
        let lit = rest.iter().take_while(|entry| is_lit(entry)).count();
        let (run, rest) = rest.split_at(lit);
        self.entries = rest;
        run_of(run)
    }
}

/// Columns of entries that stand side by side, and their first number.
#[inline(always)]
fn run_of(entries: &[TransportEntry]) -> Option<(Range<usize>, usize)> {
    let (first, last) = (entries.first()?, entries.last()?);
    let columns = first.columns.start as usize..last.columns.end as usize;
    Some((columns, first.start as usize))
}

#[inline(always)]
fn sum_terms<'a, L: Lanes, E: Element>(
    l: L,
    terms: impl Iterator<Item = Term<'a, E>>,
    rows: usize,
    sums: &mut [[f32; TILE]; CHANNELS],
) {
    let [red, green, blue] = sums;
    let sums = [&mut red[..], &mut green[..], &mut blue[..]];
    if rows == TILE {
        sum_tile(l, terms, sums);
    } else {
        sum_half_tile(l, terms, sums);
    }
}

#[inline(always)]
fn expand<L: Lanes, E: Element, const GROUP: usize, const BLOCKS: usize>(
    l: L,
    joint: &[E],
    blocks: &mut IndirectOf<'_, BLOCKS>,
) -> [Arrived; BLOCKS] {
    let shape = blocks.shape;
    let stride = shape.folding.stride;
    let weight = &shape.folding.weight[..];
    let place = blocks.joint[0].len();
    let mut x = blocks.joint;
    if !shape.joint_scales.is_empty() {
        let scaled = blocks.scratch.scaled.chunks_exact_mut(place);
        for (x, scaled) in x.iter_mut().zip(scaled) {
            scale_joint(&shape.joint_scales, x, scaled);
            *x = scaled;
        }
    }
    let mut coefficients = [Rgb::new(x[0], place / CHANNELS); BLOCKS];
    for (coefficients, x) in coefficients.iter_mut().zip(x) {
        *coefficients = Rgb::new(x, place / CHANNELS);
    }
    let mut start = 0;
    for class in 0..GROUP {
        let columns = shape.joint_columns.get(shape.joint_classes[class].clone());
        let end = start + stride * columns.indices().len();
        let tiles = &joint[std::mem::replace(&mut start, end)..end];
        // Of each block all classes lie side by side, so that it unfolds from what it last wrote.
        let half = GROUP * CHANNELS * stride;
        let (first, second) = blocks.scratch.folded.split_at_mut(half);
        let at = class * CHANNELS * stride..(class + 1) * CHANNELS * stride;
        let first = channels(&mut first[at.clone()], stride);
        if BLOCKS == 2 {
            let second = channels(&mut second[at], stride);
            let x = [coefficients[0], coefficients[1]];
            multiply_tiles(l, tiles, columns, x, [first, second]);
        } else {
            multiply_tiles(l, tiles, columns, [coefficients[0]], [first]);
        }
    }
    let mut arrived = [Arrived::default(); BLOCKS];
    for (block, arrived) in arrived.iter_mut().enumerate() {
        let folded = &blocks.scratch.folded[block * GROUP * CHANNELS * stride..];
        let mut found = Unfolded::new(l);
        let mut flux = [0.0; CHANNELS];
        for (channel, flux) in flux.iter_mut().enumerate() {
            let (folded, apart) = (&folded[channel * stride..], CHANNELS * stride);
            let out = &mut *blocks.indirect[block][channel];
            *flux = if blocks.compare {
                unfold::<L, GROUP, true>(l, folded, apart, weight, out, &mut found)
            } else {
                unfold::<L, GROUP, false>(l, folded, apart, weight, out, &mut found)
            };
        }
        let [change, peak] = if blocks.compare {
            found.change_and_peak(l)
        } else {
            // Nobody asks but whether there is light.
            [0.0, flux[0].max(flux[1]).max(flux[2])]
        };
        *arrived = Arrived {
            flux: [f64::from(flux[0]), f64::from(flux[1]), f64::from(flux[2])],
            change,
            peak,
        };
    }
    arrived
}

/// Red, green and blue of numbers that lie channel by channel.
#[inline(always)]
fn channels(all: &mut [f32], stride: usize) -> [&mut [f32]; CHANNELS] {
    let (red, rest) = all.split_at_mut(stride);
    let (green, blue) = rest.split_at_mut(stride);
    [red, green, blue]
}

/// Joint coefficients times the scales of a packed basis, by mode.
#[inline(always)]
fn scale_joint(scales: &[f32], joint: &[f32], scaled: &mut [f32]) {
    let place = joint.len() / CHANNELS;
    for channel in 0..CHANNELS {
        for (mode, scale) in scales.iter().enumerate() {
            let at = channel * place + mode;
            scaled[at] = joint[at] * scale;
        }
    }
}

/// A tiled basis times joint coefficients: row after row, channel by channel.
pub(crate) struct Expand<'a> {
    pub basis: &'a crate::packed::Tiled,
    /// The first so many rows.
    pub rows: usize,
    pub joint: &'a [f32],
    pub scratch: &'a mut Scratch,
    /// At least `rows` numbers a channel.
    pub out: [&'a mut [f32]; CHANNELS],
}

impl Kernel for Expand<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) {
        let basis = self.basis;
        match &basis.values {
            Values::F32(values) => expand_rows(l, values, &mut self),
            Values::F16(values) => expand_rows(l, values, &mut self),
            Values::Int8(values) => expand_rows(l, values, &mut self),
        }
    }
}

#[inline(always)]
fn expand_rows<L: Lanes, E: Element>(l: L, values: &[E], job: &mut Expand<'_>) {
    let basis = job.basis;
    let columns = basis.columns.get(0..basis.columns.len());
    let count = columns.indices().len();
    let mut x = job.joint;
    if !basis.scales.is_empty() {
        scale_joint(&basis.scales, x, &mut job.scratch.scaled);
        x = &job.scratch.scaled[..x.len()];
    }
    let mut row = 0;
    while row < job.rows {
        let panel = |tile: usize| &values[tile * TILE * count..(tile + 1) * TILE * count];
        let mut sums = [[[0.0f32; TILE]; CHANNELS]; 2];
        let [[r0, g0, b0], [r1, g1, b1]] = &mut sums;
        let pair = row + TILE < job.rows;
        let tile = row / TILE;
        let x = Rgb::new(x, x.len() / CHANNELS);
        if pair {
            let term = Term {
                panels: [panel(tile), panel(tile + 1)],
                columns,
                x,
                scales: &[],
            };
            sum_two_tiles(l, term, [[r0, g0, b0], [r1, g1, b1]]);
        } else {
            let term = Term {
                panels: [panel(tile)],
                columns,
                x,
                scales: &[],
            };
            sum_tile(l, std::iter::once(term), [r0, g0, b0]);
        }
        for sums in sums.iter().take(1 + usize::from(pair)) {
            let height = TILE.min(job.rows - row);
            for (out, sums) in job.out.iter_mut().zip(sums) {
                out[row..row + height].copy_from_slice(&sums[..height]);
            }
            row += height;
        }
    }
}

const _: () = assert!(TILE == WIDEST, "strides are whole tiles");
