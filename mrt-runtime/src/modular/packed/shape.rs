//! Folded and packed operators of one shape.

use crate::level::shape::Shape;
use crate::modular::packed::folding::{Classes, Folding};
use crate::modular::packed::numbers::PackedNumbers;
use crate::output::probe_order::PROBE_COEFFICIENTS;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::simd::Aligned;
use mrt_core::simd::rows::DOT_ROWS;
use mrt_core::simd::tiles::{ColumnLists, HALF_TILE, TILE};
use mrt_core::storage::Storage;
use std::ops::Range;

/// The operators of a shape as frames read them.
#[derive(Clone, Debug)]
pub struct PackedShape {
    /// The slots of texels.
    pub folding: Folding,
    /// Number of modes `k_b`.
    pub modes: usize,
    /// Number of joint modes.
    pub joint_modes: usize,
    /// Number of rows of coefficients in each channel: joint modes and padding. A coefficient b is in the row of its
    /// joint mode; the other rows of coefficients b are zero.
    ///
    /// Modes of one class have neighbouring rows. Light that goes from block to block keeps its parity under the
    /// mirrors that the blocks share, so half of the columns of a tile, or more, are zero and left out.
    pub rows: usize,
    /// By joint mode: its row. The first joint modes belong to coefficients b.
    pub(crate) row_of_mode: Vec<u16>,
    /// By row: its joint mode; `u16::MAX` for padding.
    mode_of_row: Vec<u16>,
    /// `T_d->b` in groups of rows; each row has one number for each orbit.
    pub(crate) from_direct: PackedNumbers,
    pub(crate) groups: Vec<Group>,
    /// The joint basis: tile after tile of orbits, in a tile one column for each mode, class after class.
    pub(crate) joint: PackedNumbers,
    /// By class: the rows of its joint modes.
    pub(crate) joint_classes: Vec<Range<usize>>,
    /// By row: the scale that multiplies joint coefficients before the joint basis; empty if all are 1.
    pub(crate) joint_scales: Vec<f32>,
    /// Tiles that cover all rows.
    pub(crate) row_tiles: Vec<RowTile>,
    /// By joint mode: a power of two near the norm of its light. Transport is stored in these units, so that strong
    /// modes do not use up the digits of weak ones.
    pub(crate) units: Vec<f32>,
    /// By row: 1 / the unit of its mode; 0 for padding.
    pub(crate) row_inverses: Aligned<f32>,
    /// By row: the largest magnitude in its mode, over texels and the coefficients of probes and of vector irradiance.
    pub(crate) peaks: Aligned<f32>,
    /// Area of the walls, in areas of a canonical texel.
    pub(crate) area: f32,
    /// By joint mode: norm of its light.
    pub(crate) joint_norms: Vec<f32>,
    /// By coefficient b: norm of its row of `T_d->b`.
    pub(crate) coefficient_norms: Vec<f32>,
    /// SH coefficients of probes: for each coefficient, probe by probe.
    pub(crate) probes: Tiled,
    /// Vector irradiance: for each texel, coefficient by coefficient.
    pub(crate) vector: Tiled,
}

/// Rows that are computed together.
#[derive(Clone, Copy, Debug)]
pub struct RowTile {
    /// The first row.
    pub start: u16,
    /// Number of rows: [`TILE`] or [`HALF_TILE`].
    pub height: u8,
}

/// Up to [`DOT_ROWS`] modes of one class, or exactly [`DOT_ROWS`] modes of several classes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Group {
    /// Number of modes.
    pub count: u8,
    /// Whether the modes are not consecutive rows of one class.
    pub is_mixed: bool,
    /// Class of each mode.
    pub classes: [u8; DOT_ROWS],
    /// Row of each mode.
    pub rows: [u16; DOT_ROWS],
    /// Scale of each mode.
    pub scales: [f32; DOT_ROWS],
}

/// A matrix in tiles that use all columns.
#[derive(Clone, Debug)]
pub struct Tiled {
    /// Number of rows without padding.
    pub rows: usize,
    pub(crate) values: PackedNumbers,
    pub(crate) columns: ColumnLists,
    pub(crate) scales: Vec<f32>,
}

impl Tiled {
    /// Packs a matrix with one column for each joint mode. Packed row k is row `row(k)` of the matrix.
    fn new(
        matrix: &Matrix<f32>,
        row: impl Fn(usize) -> usize,
        order: &RowOrder,
        storage: Storage,
    ) -> Self {
        let rows = matrix.rows();
        let scales = scales(matrix, storage);
        let mut values = PackedNumbers::new(storage);
        for tile in (0..rows).step_by(TILE) {
            for (j, &scale) in scales.iter().enumerate() {
                for k in tile..tile + TILE {
                    let value = if k < rows { matrix[(row(k), j)] } else { 0.0 };
                    values.push(value, scale);
                }
            }
        }
        let mut lists = ColumnLists::default();
        lists.push(order.row_of_mode.iter().map(|&row| u32::from(row)));
        Self {
            rows,
            values,
            columns: lists,
            scales: order.scales_by_row(&scales, storage),
        }
    }

    fn bytes(&self) -> usize {
        self.values.bytes() + size_of_val(self.scales.as_slice()) + self.columns.bytes()
    }
}

/// The matrices that a shape is packed from.
pub struct Operators<'a> {
    /// `T_d->b`, modes x texels.
    pub coefficients_from_direct: &'a Matrix<f32>,
    /// Texels x joint modes.
    pub joint_basis: &'a Matrix<f32>,
    /// 9 probes³ x joint modes.
    pub probe_basis: &'a Matrix<f32>,
    /// 4 texels x joint modes, or no rows.
    pub vector_basis: &'a Matrix<f32>,
    /// By texel: area in areas of a canonical texel; empty if all are 1.
    pub areas: &'a [f32],
}

impl Operators<'_> {
    /// The largest number of a joint mode in all bases; 0 if there is no such mode.
    fn peak(&self, mode: usize) -> f32 {
        [self.joint_basis, self.probe_basis, self.vector_basis]
            .into_iter()
            .filter(|basis| mode < basis.columns())
            .flat_map(|basis| basis.column(mode))
            .fold(0.0f32, |m, x| m.max(x.abs()))
    }
}

/// The joint basis: tile after tile of orbits, in a tile one column for each mode, class after class.
fn joint_tiles(
    folding: &Folding,
    order: &RowOrder,
    basis: &Matrix<f32>,
    scales: &[f32],
    storage: Storage,
) -> PackedNumbers {
    let mut numbers = PackedNumbers::new(storage);
    for tile in (0..folding.stride).step_by(TILE) {
        for rows in &order.classes {
            for &mode in &order.mode_of_row[rows.clone()] {
                let mode = usize::from(mode);
                for orbit in tile..tile + TILE {
                    let texel = folding.first(orbit);
                    let value = texel.map_or(0.0, |texel| basis[(texel, mode)]);
                    numbers.push(value, scales[mode]);
                }
            }
        }
    }
    numbers
}

impl PackedShape {
    pub(crate) fn new(
        shape: &Shape,
        resolution: usize,
        operators: &Operators<'_>,
        storage: Storage,
    ) -> Self {
        let (t, j) = (operators.coefficients_from_direct, operators.joint_basis);
        let (folding, classes) = Folding::new(shape, resolution, t, j, operators.areas);
        let order = RowOrder::new(&folding, &classes.joint);
        let scales = scales(j, storage);
        let joint = joint_tiles(&folding, &order, j, &scales, storage);
        let norm =
            |values: &mut dyn Iterator<Item = f32>| values.map(|x| x * x).sum::<f32>().sqrt();
        let joint_norms: Vec<f32> = (0..j.columns())
            .map(|mode| norm(&mut j.column(mode).iter().copied()))
            .collect();
        let units: Vec<f32> = joint_norms.iter().map(|&n| power_of_two(n)).collect();
        let inverse = |&mode: &u16| units.get(usize::from(mode)).map_or(0.0, |unit| 1.0 / unit);
        let row_inverses = order.mode_of_row.iter().map(inverse).collect();
        let peak = |&mode: &u16| operators.peak(usize::from(mode));
        let peaks = order.mode_of_row.iter().map(peak).collect();
        let area = folding.weight.iter().sum::<f32>() * folding.elements() as f32;
        let coefficient_norms = (0..t.rows())
            .map(|mode| norm(&mut (0..j.rows()).map(|texel| t[(mode, texel)])))
            .collect();
        let (from_direct, groups) = coefficient_rows(&folding, &classes, &order, t, storage);
        let probes = operators.probe_basis.rows() / SH_COEFFICIENTS;
        Self {
            modes: t.rows(),
            joint_modes: j.columns(),
            rows: order.mode_of_row.len(),
            from_direct,
            groups,
            joint,
            joint_scales: order.scales_by_row(&scales, storage),
            units,
            row_inverses,
            peaks,
            area,
            joint_norms,
            coefficient_norms,
            probes: Tiled::new(
                operators.probe_basis,
                |k| k % probes * SH_COEFFICIENTS + k / probes,
                &order,
                storage,
            ),
            vector: Tiled::new(operators.vector_basis, |k| k, &order, storage),
            joint_classes: order.classes,
            row_tiles: order.tiles,
            row_of_mode: order.row_of_mode,
            mode_of_row: order.mode_of_row,
            folding,
        }
    }

    /// The joint modes of a range of rows; `None` for padding.
    pub(crate) fn modes_of(
        &self,
        rows: Range<usize>,
    ) -> impl Iterator<Item = Option<usize>> + Clone {
        let modes = self.mode_of_row[rows].iter();
        modes.map(|&mode| (mode != u16::MAX).then_some(usize::from(mode)))
    }

    /// Bytes of all operators.
    pub fn bytes(&self) -> usize {
        self.stage_bytes().iter().sum::<usize>() + self.probes.bytes() + self.vector.bytes()
    }

    /// Bytes of `T_d->b`, and of the joint basis.
    pub fn stage_bytes(&self) -> [usize; 2] {
        [
            self.from_direct.bytes() + size_of_val(self.groups.as_slice()),
            self.joint.bytes() + size_of_val(self.joint_scales.as_slice()),
        ]
    }

    /// Multiply-adds of `T_d->b`, and of the joint basis, for one block and three channels, without padding.
    pub fn multiply_adds(&self) -> [usize; 2] {
        let orbits = self.folding.multiplicity.iter().filter(|&&m| m > 0.0);
        let orbits = orbits.count();
        [3 * orbits * self.modes, 3 * orbits * self.joint_modes]
    }
}

/// The order of rows: classes of joint modes, in tiles.
struct RowOrder {
    row_of_mode: Vec<u16>,
    /// `u16::MAX` for padding.
    mode_of_row: Vec<u16>,
    /// By class: its rows.
    classes: Vec<Range<usize>>,
    tiles: Vec<RowTile>,
}

impl RowOrder {
    fn new(folding: &Folding, class_of_mode: &[u8]) -> Self {
        let mut order = Self {
            row_of_mode: vec![0; class_of_mode.len()],
            mode_of_row: Vec::new(),
            classes: vec![0..0; folding.elements()],
            tiles: Vec::new(),
        };
        // Most levels are flat, and blocks on one floor share the mirror that exchanges floor and ceiling. So a tile
        // has only modes that are even under that mirror, or only odd ones.
        let is_odd = |class: usize| folding.up_mirror.is_some_and(|k| class >> k & 1 == 1);
        for odd in [false, true] {
            for class in (0..folding.elements()).filter(|&class| is_odd(class) == odd) {
                let first = order.mode_of_row.len();
                let modes = (0u16..).zip(class_of_mode);
                for (mode, _) in modes.filter(|&(_, &c)| usize::from(c) == class) {
                    order.row_of_mode[usize::from(mode)] = order.mode_of_row.len() as u16;
                    order.mode_of_row.push(mode);
                }
                order.classes[class] = first..order.mode_of_row.len();
            }
            let rows = order.mode_of_row.len().next_multiple_of(HALF_TILE);
            order.mode_of_row.resize(rows, u16::MAX);
            let mut start = order.tiles.last().map_or(0, RowTile::end);
            while start < rows {
                let height = TILE.min(rows - start);
                order.tiles.push(RowTile {
                    start: start as u16,
                    height: height as u8,
                });
                start += height;
            }
        }
        order
    }

    /// Scales by row, 1 for padding; empty for `f32`, which has no scales.
    fn scales_by_row(&self, scales: &[f32], storage: Storage) -> Vec<f32> {
        if storage == Storage::F32 {
            return Vec::new();
        }
        let scale = |&mode: &u16| scales.get(usize::from(mode)).copied().unwrap_or(1.0);
        self.mode_of_row.iter().map(scale).collect()
    }
}

impl RowTile {
    /// The rows of the tile.
    pub(crate) fn rows(&self) -> Range<usize> {
        usize::from(self.start)..self.end()
    }

    fn end(&self) -> usize {
        usize::from(self.start) + usize::from(self.height)
    }
}

/// Scale of each column of a matrix.
fn scales(matrix: &Matrix<f32>, storage: Storage) -> Vec<f32> {
    (0..matrix.columns())
        .map(|j| {
            let largest = matrix.column(j).iter().fold(0.0f32, |m, x| m.max(x.abs()));
            PackedNumbers::scale(storage, largest)
        })
        .collect()
}

/// The largest power of two that is not above a number; 1 for numbers so small that no light is left of them.
fn power_of_two(x: f32) -> f32 {
    if x < 1e-30 {
        return 1.0;
    }
    f32::from_bits(x.to_bits() & 0x7f80_0000)
}

/// SH coefficients of a probe.
const SH_COEFFICIENTS: usize = PROBE_COEFFICIENTS;

/// Packs `T_d->b`, and the list of its groups.
fn coefficient_rows(
    folding: &Folding,
    classes: &Classes,
    order: &RowOrder,
    t: &Matrix<f32>,
    storage: Storage,
) -> (PackedNumbers, Vec<Group>) {
    let mut numbers = PackedNumbers::new(storage);
    let mut groups = Vec::new();
    for members in grouped_rows(order, classes, t.rows()) {
        let is_mixed = are_mixed(&members);
        let mut group = Group {
            is_mixed,
            ..Group::default()
        };
        // Kernels take mixed groups as full: the last row fills them up.
        let count = if is_mixed { DOT_ROWS } else { members.len() };
        group.count = count as u8;
        for k in 0..count {
            let GroupRow { row, mode, class } = members[k.min(members.len() - 1)];
            let value = |orbit: usize| {
                let texel = folding.first(orbit)?;
                Some(t[(mode, texel)] * folding.multiplicity[orbit])
            };
            let orbits = 0..folding.stride;
            let largest = orbits
                .clone()
                .filter_map(value)
                .fold(0.0f32, |m, x| m.max(x.abs()));
            let scale = PackedNumbers::scale(storage, largest);
            for orbit in orbits {
                numbers.push(value(orbit).unwrap_or(0.0), scale);
            }
            (group.rows[k], group.classes[k], group.scales[k]) = (row, class, scale);
        }
        groups.push(group);
    }
    (numbers, groups)
}

/// A row that a coefficient b has.
#[derive(Clone, Copy)]
struct GroupRow {
    row: u16,
    mode: usize,
    class: u8,
}

impl GroupRow {
    /// True if `next` is the next row, and of the same class.
    fn is_followed_by(&self, next: &GroupRow) -> bool {
        next.row == self.row + 1 && next.class == self.class
    }
}

/// Whether rows are not consecutive rows of one class.
fn are_mixed(rows: &[GroupRow]) -> bool {
    !rows.windows(2).all(|pair| pair[0].is_followed_by(&pair[1]))
}

/// The rows of coefficients b in groups of up to [`DOT_ROWS`]. Groups of one class come first, in ascending order:
/// kernels write zeros to the rows after a group that is not full, and those rows get their values from later groups.
fn grouped_rows(order: &RowOrder, classes: &Classes, modes: usize) -> Vec<Vec<GroupRow>> {
    let rows = (0u16..).zip(&order.mode_of_row);
    let own: Vec<GroupRow> = rows
        .map(|(row, &mode)| (row, usize::from(mode)))
        .filter(|&(_, mode)| mode < modes)
        .map(|(row, mode)| GroupRow {
            row,
            mode,
            class: classes.coefficients[mode],
        })
        .collect();
    // A mixed group needs folded light of several classes, but fewer rows of padding than several groups of few rows.
    let mut few: Vec<GroupRow> = Vec::new();
    let mut groups: Vec<Vec<GroupRow>> = Vec::new();
    for run in own.chunk_by(GroupRow::is_followed_by) {
        let (full, rest) = run.split_at(run.len() / DOT_ROWS * DOT_ROWS);
        groups.extend(full.chunks(DOT_ROWS).map(<[_]>::to_vec));
        if rest.len() > FEW_ROWS {
            groups.push(rest.to_vec());
        } else {
            few.extend(rest);
        }
    }
    groups.extend(few.chunks(DOT_ROWS).map(<[_]>::to_vec));
    groups.sort_by_key(|rows| (are_mixed(rows), rows[0].row));
    groups
}

/// Up to this many rows of one class are too few for a group of their own.
const FEW_ROWS: usize = 2;
