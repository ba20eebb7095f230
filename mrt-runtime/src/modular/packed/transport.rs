//! `T_b->r`, sorted by the block where light arrives, without columns that are zero or negligible.

use crate::modular::packed::numbers::PackedNumbers;
use crate::modular::packed::shape::PackedShape;
use crate::output::texel_layout::{BlockRank, TexelLayout};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::simd::tiles::ColumnLists;
use mrt_core::storage::Storage;
use std::ops::Range;

/// The operator from the coefficients b of all blocks to the joint coefficients of all blocks. Blocks are in the order
/// of [`TexelLayout`].
#[derive(Clone, Debug, Default)]
pub struct PackedTransport {
    /// By rank: the tiles of the block.
    pub(crate) tiles_of_block: Vec<Range<u32>>,
    pub(crate) tiles: Vec<TransportTile>,
    pub(crate) entries: Vec<TransportEntry>,
    /// Columns of entries: positions of coefficients among those of all blocks.
    pub(crate) columns: ColumnLists,
    /// Scale of each column, for `int8` only.
    pub(crate) column_scales: Vec<f32>,
    pub(crate) values: Option<PackedNumbers>,
    /// By gate: the doors whose values multiply light that passes it.
    pub(crate) gates: Vec<Vec<u32>>,
    /// The block of rank k sends light to the blocks `reached[reached_by[k]..reached_by[k + 1]]`.
    pub(crate) reached_by: Vec<u32>,
    pub(crate) reached: Vec<BlockRank>,
    dense_multiply_adds: usize,
    multiply_adds: usize,
}

/// Light that arrives in one [`RowTile`](crate::modular::packed::shape::RowTile) of a block.
#[derive(Clone, Debug)]
pub struct TransportTile {
    pub(crate) entries: Range<u32>,
    /// Number of entries that pass a gate; they come first.
    pub(crate) gated: u32,
    /// Scale that multiplies sums.
    pub(crate) scale: f32,
    /// Number of rows.
    height: u8,
}

/// Light that one block sends to a tile.
#[derive(Clone, Debug)]
pub struct TransportEntry {
    pub(crate) source: BlockRank,
    /// The gate that it passes; [`NO_GATE`] if none.
    pub(crate) gate: u32,
    /// Range in [`PackedTransport::columns`].
    pub(crate) columns: Range<u32>,
    /// Index of its first number in [`PackedTransport::values`].
    pub(crate) start: u32,
}

/// Builds a [`PackedTransport`] from operators of pairs of blocks.
#[derive(Debug)]
pub struct TransportPacker<'a> {
    shapes: &'a [PackedShape],
    /// By rank: the shape of the block.
    shape_of_block: Vec<usize>,
    /// Distance between the coefficients of a block and those of the next.
    block_stride: u32,
    storage: Storage,
    negligible: Option<f32>,
    pending: Vec<Pending>,
    columns: Vec<u16>,
    values: Vec<f32>,
    gates: Vec<Vec<u32>>,
    dense_multiply_adds: usize,
}

#[derive(Clone, Debug)]
struct Pending {
    target: BlockRank,
    tile: u32,
    gate: u32,
    source: BlockRank,
    columns: Range<usize>,
    start: usize,
}

impl<'a> TransportPacker<'a> {
    pub(crate) fn new(
        shapes: &'a [PackedShape],
        layout: &TexelLayout,
        block_stride: usize,
        storage: Storage,
        negligible: Option<f32>,
    ) -> Self {
        Self {
            shapes,
            shape_of_block: layout.shapes.iter().map(|&shape| shape as usize).collect(),
            block_stride: block_stride as u32,
            storage,
            negligible,
            pending: Vec::new(),
            columns: Vec::new(),
            values: Vec::new(),
            gates: Vec::new(),
            dense_multiply_adds: 0,
        }
    }

    /// Bytes of all operators added so far.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.values.as_slice()) + size_of_val(self.columns.as_slice())
    }

    /// Adds the operator, joint modes x modes, of light from `source` to `target` that passes `doors`. Call it at most
    /// once for each pair and set of doors.
    ///
    /// The weakest columns of tiles are left out, up to a share `negligible` of the pair's light in L2. A column's
    /// light is the light on the receiving walls from unit light on the sending walls.
    pub(crate) fn add(
        &mut self,
        doors: &[u32],
        target: BlockRank,
        source: BlockRank,
        operator: &Matrix<f32>,
    ) {
        let shapes = self.shapes;
        let (to, from) = (
            &shapes[self.shape_of_block[target.get()]],
            &shapes[self.shape_of_block[source.get()]],
        );
        self.dense_multiply_adds += 3 * operator.rows() * operator.columns();
        let gate = self.gate(doors);
        let parts = tile_columns(to, from, operator);
        let share = self.negligible;
        let share = share.unwrap_or_else(|| negligible(operator.columns()));
        let kept = strongest(parts, f64::from(share).max(ROUNDING));
        for part in kept.chunk_by(|a, b| a.0 == b.0) {
            let tile = part[0].0;
            let first_column = self.columns.len();
            let start = self.values.len();
            let modes = to.modes_of(to.row_tiles[tile as usize].rows());
            for &(_, column) in part {
                let column = usize::from(column);
                self.columns.push(from.row_of_mode[column]);
                let values = modes
                    .clone()
                    .map(|mode| mode.map_or(0.0, |mode| operator[(mode, column)] * to.units[mode]));
                self.values.extend(values);
            }
            self.pending.push(Pending {
                target,
                tile,
                gate,
                source,
                columns: first_column..self.columns.len(),
                start,
            });
        }
    }

    /// Index of the gate of these doors, which is new if they have none; [`NO_GATE`] without doors.
    fn gate(&mut self, doors: &[u32]) -> u32 {
        if doors.is_empty() {
            return NO_GATE;
        }
        let known = self.gates.iter().position(|gate| gate == doors);
        known.unwrap_or_else(|| {
            self.gates.push(doors.to_vec());
            self.gates.len() - 1
        }) as u32
    }

    /// Sorts everything by the block and tile where it arrives.
    pub(crate) fn finish(mut self) -> PackedTransport {
        // Entries that pass no gate come last, since `NO_GATE` is the largest number.
        self.pending
            .sort_by_key(|p| (p.target, p.tile, p.gate, p.source));
        let mut packed = PackedTransport {
            dense_multiply_adds: self.dense_multiply_adds,
            ..PackedTransport::default()
        };
        let mut values = PackedNumbers::new(self.storage);
        let mut rest = &self.pending[..];
        for (target, &shape) in self.shape_of_block.iter().enumerate() {
            let first_tile = packed.tiles.len() as u32;
            for (tile, rows) in (0u32..).zip(&self.shapes[shape].row_tiles) {
                let is_here = |p: &Pending| p.target.get() == target && p.tile == tile;
                let (entries, after) = rest.split_at(rest.partition_point(is_here));
                rest = after;
                self.pack_tile(entries, rows.height, &mut packed, &mut values);
            }
            let tiles = first_tile..packed.tiles.len() as u32;
            packed.tiles_of_block.push(tiles);
        }
        self.list_reached(&mut packed);
        packed.values = Some(values);
        packed.gates = self.gates;
        packed
    }

    /// Packs the entries of one tile, whose numbers then begin a cache line.
    fn pack_tile(
        &self,
        entries: &[Pending],
        height: u8,
        packed: &mut PackedTransport,
        values: &mut PackedNumbers,
    ) {
        let rows = usize::from(height);
        values.fill_line();
        let scale = match self.storage {
            // Each column has a scale of its own.
            Storage::Int8 => 1.0,
            storage => {
                let numbers = entries.iter().flat_map(|entry| self.numbers(entry, rows));
                PackedNumbers::scale(storage, largest(numbers))
            }
        };
        let first_entry = packed.entries.len() as u32;
        for entry in entries {
            let start = values.len() as u32;
            for column in self.numbers(entry, rows).chunks(rows) {
                let scale = match self.storage {
                    Storage::Int8 => {
                        let scale = PackedNumbers::scale(Storage::Int8, largest(column));
                        packed.column_scales.push(scale);
                        scale
                    }
                    _ => scale,
                };
                for &value in column {
                    values.push(value, scale);
                }
                packed.multiply_adds += 3 * rows;
            }
            let first = entry.source.get() as u32 * self.block_stride;
            let columns = self.columns[entry.columns.clone()].iter();
            let columns = columns.map(|&column| first + u32::from(column));
            let columns = packed.columns.push(columns);
            packed.entries.push(TransportEntry {
                source: entry.source,
                gate: entry.gate,
                columns: columns.start as u32..columns.end as u32,
                start,
            });
        }
        let gated = entries.partition_point(|entry| entry.gate != NO_GATE);
        self.pad_to_pairs(&entries[gated..], rows, packed, values);
        packed.tiles.push(TransportTile {
            entries: first_entry..packed.entries.len() as u32,
            gated: gated as u32,
            scale,
            height,
        });
    }

    fn numbers(&self, entry: &Pending, rows: usize) -> &[f32] {
        &self.values[entry.start..][..entry.columns.len() * rows]
    }

    /// Kernels of 8 and 16 lanes take columns in pairs. If the entries of a tile that pass no gate have an odd number
    /// of columns, the last entry gets a column of zeros.
    fn pad_to_pairs(
        &self,
        open: &[Pending],
        rows: usize,
        packed: &mut PackedTransport,
        values: &mut PackedNumbers,
    ) {
        let columns: usize = open.iter().map(|p| p.columns.len()).sum();
        if columns.is_multiple_of(2) || self.storage == Storage::Int8 {
            return;
        }
        if let Some(last) = packed.entries.last_mut() {
            let column = last.source.get() as u32 * self.block_stride;
            last.columns.end = packed.columns.push([column]).end as u32;
            for _ in 0..rows {
                values.push(0.0, 1.0);
            }
            packed.multiply_adds += 3 * rows;
        }
    }

    /// Lists, by source, the blocks that light reaches.
    fn list_reached(&self, packed: &mut PackedTransport) {
        let mut pairs: Vec<(BlockRank, BlockRank)> =
            self.pending.iter().map(|p| (p.source, p.target)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        for source in (0..self.shape_of_block.len()).map(BlockRank::new) {
            let start = pairs.partition_point(|pair| pair.0 < source);
            packed.reached_by.push(start as u32);
        }
        packed.reached_by.push(pairs.len() as u32);
        packed.reached = pairs.into_iter().map(|pair| pair.1).collect();
    }
}

/// One column of an operator's rows in one tile.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct TileColumn {
    /// Energy of the light that it carries.
    energy: f64,
    tile: u32,
    column: u16,
}

/// The columns of all tiles of an operator. Energy is that of the light on the receiving walls of unit light on the
/// sending ones.
fn tile_columns(to: &PackedShape, from: &PackedShape, operator: &Matrix<f32>) -> Vec<TileColumn> {
    let mut parts = Vec::new();
    for (tile, rows) in (0u32..).zip(&to.row_tiles) {
        let modes = to.modes_of(rows.rows());
        for column in 0..operator.columns() {
            let size =
                |mode: usize| f64::from(to.joint_norms[mode]) * f64::from(operator[(mode, column)]);
            let sizes = modes.clone().flatten().map(size);
            let energy: f64 = sizes.map(|size| size * size).sum();
            let light = f64::from(from.coefficient_norms[column]);
            parts.push(TileColumn {
                energy: energy * light * light,
                tile,
                column: column as u16,
            });
        }
    }
    parts
}

/// The parts, as (tile, column) in ascending order, that remain when the weakest are left out, up to a `share` of the
/// light in L2. None if there is no light at all.
fn strongest(mut parts: Vec<TileColumn>, share: f64) -> Vec<(u32, u16)> {
    let total: f64 = parts.iter().map(|part| part.energy).sum();
    if total == 0.0 {
        return Vec::new();
    }
    parts.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    let mut left_out = 0.0;
    let first = parts
        .iter()
        .position(|part| {
            left_out += part.energy;
            left_out > share * share * total
        })
        .unwrap_or(0);
    let kept = parts[first..].iter();
    let mut kept: Vec<(u32, u16)> = kept.map(|part| (part.tile, part.column)).collect();
    kept.sort_unstable();
    kept
}

fn largest<'n>(numbers: impl IntoIterator<Item = &'n f32>) -> f32 {
    numbers.into_iter().fold(0.0f32, |m, x| m.max(x.abs()))
}

/// [`TransportEntry::gate`] of light that passes no gate.
const NO_GATE: u32 = u32::MAX;

/// Default share of light that may be left out, for a block with `modes` modes.
fn negligible(modes: usize) -> f32 {
    (0.02 * (32.0 / modes as f32).powi(2)).clamp(0.02, 0.15)
}

/// Share of a pair's light that is always left out: rounding leaves this much where symmetry would give zero.
const ROUNDING: f64 = 1e-6;

impl PackedTransport {
    /// Bytes of numbers and of their lists.
    pub fn bytes(&self) -> usize {
        self.values.as_ref().map_or(0, PackedNumbers::bytes)
            + self.columns.bytes()
            + size_of_val(self.column_scales.as_slice())
            + size_of_val(self.tiles.as_slice())
            + size_of_val(self.entries.as_slice())
            + size_of_val(self.reached_by.as_slice())
            + size_of_val(self.reached.as_slice())
    }

    /// Multiply-adds of one product of three channels: with the columns that are kept, padding included; and with dense
    /// operators of all pairs.
    pub fn multiply_adds(&self) -> [usize; 2] {
        [self.multiply_adds, self.dense_multiply_adds]
    }

    /// Multiply-adds of one product of three channels with the columns that are kept, if only blocks with
    /// `is_lit[rank]` have light.
    ///
    /// # Panics
    /// If there are fewer flags than blocks.
    pub fn multiply_adds_from(&self, is_lit: &[bool]) -> usize {
        let of_tile = |tile: &TransportTile| {
            let entries = &self.entries[tile.entries.start as usize..tile.entries.end as usize];
            let lit = entries.iter().filter(|e| is_lit[e.source.get()]);
            let columns: usize = lit.map(|entry| entry.columns.len()).sum();
            3 * columns * usize::from(tile.height)
        };
        self.tiles.iter().map(of_tile).sum()
    }

    /// The blocks that a block sends light to.
    pub(crate) fn reached(&self, block: BlockRank) -> &[BlockRank] {
        let block = block.get();
        &self.reached[self.reached_by[block] as usize..self.reached_by[block + 1] as usize]
    }
}
