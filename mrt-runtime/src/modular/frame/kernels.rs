//! The products of a pass, one block at a time.

use crate::modular::packed::{PackedShape, PackedTransport, TransportEntry, Values};
use glam::Vec3;
use mrt_core::simd::folded::{Albedo, Basis, Reflected, fold, unfold};
use mrt_core::simd::rows::{DOT_ROWS, dot_rows, dot_unlike_rows};
use mrt_core::simd::tiles::{
    CHANNELS, Finish, HALF_TILE, PackedNumber, Rgb, TILE, Term, TileOut, sum_half_tile, sum_tile,
};
use mrt_core::simd::{Aligned, Kernel, Lanes, WIDEST};
use std::ops::Range;

/// What kernels of one task write on the way.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// A block's radiosity by class, in that by channel.
    folded: Aligned<f32>,
    /// Coefficients times scales.
    scaled: Aligned<f32>,
    /// Joint coefficients of a block.
    pub(super) joint: Aligned<f32>,
}

impl Scratch {
    /// For blocks of so many slots and coefficients.
    pub(super) fn new(slots: usize, coefficients: usize) -> Self {
        Self {
            folded: Aligned::zeroed(CHANNELS * slots),
            scaled: Aligned::zeroed(coefficients),
            joint: Aligned::zeroed(coefficients),
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
    /// Channel by channel; numbers at rows that belong to none of them are zero, and stay so.
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
        match &self.shape.from_direct {
            Values::F32(rows) => coefficients(l, rows, &mut self),
            Values::F16(rows) => coefficients(l, rows, &mut self),
            Values::Int8(rows) => coefficients(l, rows, &mut self),
        }
        sent
    }
}

impl CoefficientsOf<'_> {
    /// The albedo that sums are multiplied by, instead of each texel's light.
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
                // A group of fewer rows writes zeros to those that follow; their own groups come later.
                let first = usize::from(group.rows[0]);
                to[first..first + DOT_ROWS].copy_from_slice(&scaled);
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

/// How much light may change where joint coefficients do.
pub(super) struct ChangeOf<'a> {
    pub shape: &'a PackedShape,
    /// Channel by channel, as many as there are rows or more.
    pub before: &'a [f32],
    pub now: &'a [f32],
}

impl Kernel for ChangeOf<'_> {
    /// No number of light, whatever the texel and channel, changes by more.
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> f32 {
        let peaks = &self.shape.peaks[..];
        let stride = self.now.len() / CHANNELS;
        assert!(peaks.len().is_multiple_of(HALF_TILE) && peaks.len() <= stride);
        assert_eq!(self.before.len(), self.now.len(), "joint coefficients");
        // Rows come in eights.
        let l = l.narrow();
        let mut most = 0.0f32;
        for channel in 0..CHANNELS {
            let mut sum = l.splat(0.0);
            let mut at = 0;
            while at < peaks.len() {
                let place = channel * stride + at;
                let change = l.sub(l.load(&self.now[place..]), l.load(&self.before[place..]));
                sum = l.mul_add(l.abs(change), l.load(&peaks[at..]), sum);
                at += <L::Narrow as Lanes>::N;
            }
            most = most.max(l.sum(sum));
        }
        most
    }
}

/// Irradiance of one block from its joint coefficients.
pub(super) struct IndirectOf<'a> {
    pub shape: &'a PackedShape,
    pub joint: &'a [f32],
    pub scratch: &'a mut Scratch,
    /// Whether to find the largest change and irradiance; without, only whether there is light is known.
    pub compare: bool,
    /// Irradiance; what was there before is replaced.
    pub indirect: [&'a mut [f32]; CHANNELS],
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

impl Kernel for IndirectOf<'_> {
    type Output = Arrived;

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) -> Arrived {
        match (&self.shape.joint, self.shape.folding.mirrors) {
            (Values::F32(joint), 0) => expand::<L, f32, 1>(l, joint, &mut self),
            (Values::F32(joint), 1) => expand::<L, f32, 2>(l, joint, &mut self),
            (Values::F32(joint), 2) => expand::<L, f32, 4>(l, joint, &mut self),
            (Values::F32(joint), _) => expand::<L, f32, 8>(l, joint, &mut self),
            (Values::F16(joint), 0) => expand::<L, u16, 1>(l, joint, &mut self),
            (Values::F16(joint), 1) => expand::<L, u16, 2>(l, joint, &mut self),
            (Values::F16(joint), 2) => expand::<L, u16, 4>(l, joint, &mut self),
            (Values::F16(joint), _) => expand::<L, u16, 8>(l, joint, &mut self),
            (Values::Int8(joint), 0) => expand::<L, i8, 1>(l, joint, &mut self),
            (Values::Int8(joint), 1) => expand::<L, i8, 2>(l, joint, &mut self),
            (Values::Int8(joint), 2) => expand::<L, i8, 4>(l, joint, &mut self),
            (Values::Int8(joint), _) => expand::<L, i8, 8>(l, joint, &mut self),
        }
    }
}

#[inline(always)]
fn arrive<L: Lanes, E: PackedNumber>(l: L, values: &[E], block: &mut ResponsesOf<'_>) {
    let transport = block.transport;
    let stride = block.joint.len() / CHANNELS;
    let own = CHANNELS * stride * block.block;
    let own = &block.coefficients[own..own + CHANNELS * stride];
    let x = Rgb::new(block.coefficients, stride);
    let tiles = transport.tiles_of_block[block.block].clone();
    let tiles = &transport.tiles[tiles.start as usize..tiles.end as usize];
    // What the first tile's entries are, those of the others are or nearly so.
    let take_all = block.all_lit
        || tiles.first().is_some_and(|tile| {
            let entries = tile.entries.start + tile.gated..tile.entries.end;
            let entries = &transport.entries[entries.start as usize..entries.end as usize];
            has_few_dark::<L>(entries, block.has_coefficients)
        });
    for (tile, row_tile) in tiles.iter().zip(&block.shape.row_tiles) {
        let rows = usize::from(row_tile.height);
        let entries = &transport.entries[tile.entries.start as usize..tile.entries.end as usize];
        let (gated, open) = entries.split_at(tile.gated as usize);
        let place = |channel: usize| {
            let first = channel * stride + usize::from(row_tile.start);
            first..first + rows
        };
        // The first joint modes are the block's own.
        let mut finish = Finish {
            scale: tile.scale,
            factors: &block.shape.row_inverses[row_tile.rows()],
            own: [&own[place(0)], &own[place(1)], &own[place(2)]],
        };
        let term = |(columns, start): (Range<usize>, usize)| Term {
            panel: &values[start..start + columns.len() * rows],
            columns: transport.columns.get(columns.clone()),
            x,
            scales: transport.column_scales.get(columns).unwrap_or(&[]),
        };
        let mut behind_doors = [[0.0f32; TILE]; CHANNELS];
        if !gated.is_empty() {
            for (to, own) in behind_doors.iter_mut().zip(finish.own) {
                to[..rows].copy_from_slice(own);
            }
            for entry in gated {
                let factor = block.gate_values[entry.gate as usize];
                if factor == 0.0 || !block.has_coefficients[entry.source as usize] {
                    continue;
                }
                let before = behind_doors;
                let [red, green, blue] = &before;
                let finish = Finish {
                    scale: tile.scale * factor,
                    own: [&red[..rows], &green[..rows], &blue[..rows]],
                    ..finish
                };
                let entry = run_of(std::slice::from_ref(entry)).map(term);
                let sums = behind_doors.each_mut().map(|to| &mut to[..rows]);
                sum_terms(l, entry.into_iter(), finish, sums);
            }
            let [red, green, blue] = &behind_doors;
            finish.own = [&red[..rows], &green[..rows], &blue[..rows]];
        }
        let (red, rest) = block.joint.split_at_mut(stride);
        let (green, blue) = rest.split_at_mut(stride);
        let rows = row_tile.rows();
        let to = [
            &mut red[rows.clone()],
            &mut green[rows.clone()],
            &mut blue[rows],
        ];
        if take_all {
            // One term, whose sums need not be kept for others.
            sum_terms(l, run_of(open).map(term).into_iter(), finish, to);
        } else {
            let runs = LitRuns {
                entries: open,
                has_coefficients: block.has_coefficients,
            };
            sum_terms(l, runs.map(term), finish, to);
        }
    }
}

/// Whether all columns of these entries are to be multiplied, though some may be dark: those are zero, and where they are
/// few, leaving them out takes longer.
#[inline(always)]
fn has_few_dark<L: Lanes>(entries: &[TransportEntry], has_coefficients: &[bool]) -> bool {
    // A column takes 3 cycles with 8 or 16 lanes, 12 with 4. Runs take some 50 more a tile, and end at ends that the
    // machine guesses wrong; measured on x86-64 with a quarter of the blocks dark.
    let few = match L::N {
        1 => 0,
        4 => 8,
        _ => 32,
    };
    let mut dark = 0;
    // Without branches: which blocks are lit is hard to guess.
    for entry in entries {
        let is_dark = !has_coefficients[entry.source as usize];
        dark += u32::from(is_dark) * (entry.columns.end - entry.columns.start);
    }
    dark <= few
}

/// Runs of entries whose sources have light: their columns and numbers stand side by side, and one long product has no
/// branch that the machine guesses wrong, where many short ones have two each.
struct LitRuns<'a> {
    entries: &'a [TransportEntry],
    has_coefficients: &'a [bool],
}

impl Iterator for LitRuns<'_> {
    /// Columns, and the first number.
    type Item = (Range<usize>, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
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
fn sum_terms<'a, L: Lanes, E: PackedNumber>(
    l: L,
    terms: impl Iterator<Item = Term<'a, E>>,
    finish: Finish<'_>,
    to: TileOut<'_>,
) {
    if to[0].len() == TILE {
        sum_tile(l, terms, Some(finish), to);
    } else {
        sum_half_tile(l, terms, Some(finish), to);
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
            // Nobody asks but whether there is light.
            red.max(green).max(blue)
        },
    }
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
    pub basis: &'a crate::modular::packed::Tiled,
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
