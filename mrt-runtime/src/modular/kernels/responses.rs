//! `r = T_b->r b`, one block at a time, and a bound of how much that changes light.

use crate::modular::packed::numbers::PackedNumbers;
use crate::modular::packed::shape::PackedShape;
use crate::modular::packed::transport::{PackedTransport, TransportEntry};
use crate::output::texel_layout::BlockRank;
use mrt_core::simd::tiles::{
    CHANNELS, Finish, HALF_TILE, PackedNumber, Rgb, TILE, Term, TileOut, sum_half_tile, sum_tile,
};
use mrt_core::simd::{Kernel, Lanes};
use std::ops::Range;

/// Computes the joint coefficients of one block: `r = T_b->r b`, plus its own coefficients b.
pub(crate) struct ResponsesOf<'a> {
    /// Which block.
    pub block: BlockRank,
    pub shape: &'a PackedShape,
    pub transport: &'a PackedTransport,
    /// Coefficients b of all blocks.
    pub coefficients: &'a [f32],
    /// By rank: whether the block has coefficients.
    pub has_coefficients: &'a [bool],
    /// Whether all blocks have coefficients.
    pub all_lit: bool,
    pub gate_values: &'a [f32],
    /// Output: joint coefficients of this block.
    pub joint: &'a mut [f32],
}

/// Bounds how much the light of a block changes with its joint coefficients.
pub(crate) struct ChangeOf<'a> {
    pub shape: &'a PackedShape,
    /// Old joint coefficients, channel by channel; at least as many in a channel as the shape has rows.
    pub before: &'a [f32],
    pub now: &'a [f32],
}

impl Kernel for ChangeOf<'_> {
    /// An upper bound of the change of irradiance at every texel, and of every coefficient of probes and of vector
    /// irradiance.
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> f32 {
        let peaks = &self.shape.peaks[..];
        let stride = self.now.len() / CHANNELS;
        assert!(peaks.len().is_multiple_of(HALF_TILE) && peaks.len() <= stride);
        assert_eq!(self.before.len(), self.now.len(), "joint coefficients");
        // Numbers of rows are multiples of eight.
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

impl Kernel for ResponsesOf<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, l: L) {
        match &self.transport.values {
            Some(PackedNumbers::F32(values)) => arrive(l, values, &mut self),
            Some(PackedNumbers::F16(values)) => arrive(l, values, &mut self),
            Some(PackedNumbers::Int8(values)) => arrive(l, values, &mut self),
            None => {}
        }
    }
}

#[inline(always)]
fn arrive<L: Lanes, E: PackedNumber>(l: L, values: &[E], block: &mut ResponsesOf<'_>) {
    let transport = block.transport;
    let stride = block.joint.len() / CHANNELS;
    let own = CHANNELS * stride * block.block.get();
    let own = &block.coefficients[own..own + CHANNELS * stride];
    let x = Rgb::new(block.coefficients, stride);
    let tiles = transport.tiles_of_block[block.block.get()].clone();
    let tiles = &transport.tiles[tiles.start as usize..tiles.end as usize];
    // The entries of all tiles of a block have nearly the same sources, so the first tile decides.
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
        // The first joint modes take the block's own coefficients.
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
                if factor == 0.0 || !block.has_coefficients[entry.source.get()] {
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

/// Whether to multiply all columns of these entries, though some may belong to dark blocks. Coefficients of dark blocks
/// are zero, and if they are few, leaving them out takes longer.
#[inline(always)]
fn has_few_dark<L: Lanes>(entries: &[TransportEntry], has_coefficients: &[bool]) -> bool {
    // A column takes 3 cycles with 8 or 16 lanes, 12 with 4. Runs of lit entries take some 50 cycles more for each
    // tile, and their ends are mispredicted. Measured on x86-64 with a quarter of the blocks dark.
    let few = match L::N {
        1 => 0,
        4 => 8,
        _ => 32,
    };
    let mut dark = 0;
    // Without branches, since the machine cannot predict which blocks are lit.
    for entry in entries {
        let is_dark = !has_coefficients[entry.source.get()];
        dark += u32::from(is_dark) * (entry.columns.end - entry.columns.start);
    }
    dark <= few
}

/// Runs of entries whose sources have light. The columns and numbers of a run are contiguous, and one long product has
/// fewer mispredicted branches than many short ones, which have two each.
struct LitRuns<'a> {
    entries: &'a [TransportEntry],
    has_coefficients: &'a [bool],
}

impl Iterator for LitRuns<'_> {
    /// Columns of a run, and the index of its first number.
    type Item = (Range<usize>, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        let is_lit = |entry: &TransportEntry| self.has_coefficients[entry.source.get()];
        let dark = self.entries.iter().take_while(|entry| !is_lit(entry));
        let rest = &self.entries[dark.count()..];
        let lit = rest.iter().take_while(|entry| is_lit(entry)).count();
        let (run, rest) = rest.split_at(lit);
        self.entries = rest;
        run_of(run)
    }
}

/// Columns of contiguous entries, and the index of their first number; `None` without entries.
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
