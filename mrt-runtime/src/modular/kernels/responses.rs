//! `r = T_b->r b`, one block at a time, and how much it changes light.

use crate::modular::packed::numbers::PackedNumbers;
use crate::modular::packed::shape::PackedShape;
use crate::modular::packed::transport::{PackedTransport, TransportEntry};
use crate::output::texel_layout::BlockRank;
use mrt_core::simd::tiles::{
    CHANNELS, Finish, HALF_TILE, PackedNumber, Rgb, TILE, Term, TileOut, sum_half_tile, sum_tile,
};
use mrt_core::simd::{Kernel, Lanes};
use std::ops::Range;

/// `r = T_b->r b` of one block, and its own coefficients.
pub(crate) struct ResponsesOf<'a> {
    /// Which block.
    pub block: BlockRank,
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
pub(crate) struct ChangeOf<'a> {
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
        let is_dark = !has_coefficients[entry.source.get()];
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
        let is_lit = |entry: &TransportEntry| self.has_coefficients[entry.source.get()];
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
