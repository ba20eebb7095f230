//! The operators of one shape, folded and packed.

use super::Values;
use super::folding::{Classes, Folding};
use crate::shape::Shape;
use mrt_core::matrix::Matrix;
use mrt_core::simd::tiles::{ColumnLists, DOT_ROWS, HALF_TILE, TILE};
use mrt_core::storage::Storage;
use std::ops::Range;

/// Operators of a shape as frames read them.
#[derive(Clone, Debug)]
pub struct PackedShape {
    /// Where texels are kept.
    pub folding: Folding,
    /// Number of modes `k_b`.
    pub modes: usize,
    /// Number of joint modes.
    pub joint_modes: usize,
    /// `T_d->b`, in groups of rows of one class; each row has one number an orbit.
    pub(crate) rows: Values,
    pub(crate) groups: Vec<Group>,
    /// The joint basis: class after class, in a class tile after tile of orbits, in a tile one column a mode.
    pub(crate) joint: Values,
    pub(crate) joint_columns: ColumnLists,
    /// By class: which of `joint_columns`.
    pub(crate) joint_classes: Vec<Range<usize>>,
    /// What coefficients are multiplied by, by joint mode; empty if by 1.
    pub(crate) joint_scales: Vec<f32>,
    /// The order in which responses are computed, modes of one class together, and tiles of it: light that goes from
    /// block to block keeps its parity under the mirrors that the blocks share, and then half of a tile's columns or more
    /// are zero.
    pub(crate) row_order: Vec<u16>,
    pub(crate) row_tiles: Vec<RowTile>,
    /// By joint mode: a power of two near the size of its light. Responses are stored in such units, so that strong modes
    /// do not take all the digits.
    pub(crate) row_units: Vec<f32>,
    /// One over the unit of each mode, in the order of rows.
    pub(crate) row_inverses: Vec<f32>,
    /// Size of the light of each joint mode, and of the light that makes each coefficient.
    pub(crate) joint_norms: Vec<f32>,
    pub(crate) coefficient_norms: Vec<f32>,
    /// SH coefficients of probes, coefficient by coefficient and in that probe by probe.
    pub(crate) probes: Tiled,
    /// Vector irradiance, texel by texel and in that coefficient by coefficient.
    pub(crate) vector: Tiled,
}

/// Some joint modes that are computed together.
#[derive(Clone, Copy, Debug)]
pub struct RowTile {
    /// The first of them in the order of rows.
    pub start: u16,
    /// How many.
    pub count: u8,
    /// Rows of the tile: [`TILE`], or [`HALF_TILE`].
    pub height: u8,
}

/// Up to [`DOT_ROWS`] modes of one class.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Their class.
    pub class: u8,
    /// How many.
    pub count: u8,
    /// Which.
    pub modes: [u16; DOT_ROWS],
    /// Scale of each.
    pub scales: [f32; DOT_ROWS],
}

/// A matrix in tiles, all of whose columns are used.
#[derive(Clone, Debug)]
pub struct Tiled {
    /// Rows before padding.
    pub rows: usize,
    pub(crate) values: Values,
    pub(crate) columns: ColumnLists,
    pub(crate) scales: Vec<f32>,
}

impl Tiled {
    /// Packs a matrix, of whose rows `row(k)` is number k of `rows`.
    pub(crate) fn new(
        matrix: &Matrix<f32>,
        rows: usize,
        row: impl Fn(usize) -> usize,
        storage: Storage,
    ) -> Self {
        let columns = matrix.columns();
        let scales: Vec<f32> = (0..columns)
            .map(|j| {
                let largest = matrix.column(j).iter().fold(0.0f32, |m, x| m.max(x.abs()));
                Values::scale(storage, largest)
            })
            .collect();
        let mut values = Values::new(storage);
        for tile in (0..rows).step_by(TILE) {
            for (j, &scale) in scales.iter().enumerate() {
                for k in tile..tile + TILE {
                    let value = if k < rows { matrix[(row(k), j)] } else { 0.0 };
                    values.push(value, scale);
                }
            }
        }
        let mut lists = ColumnLists::default();
        lists.push((0..columns).map(|j| j as u32));
        Self {
            rows,
            values,
            columns: lists,
            scales: if storage == Storage::F32 {
                Vec::new()
            } else {
                scales
            },
        }
    }

    fn bytes(&self) -> usize {
        self.values.bytes() + size_of_val(self.scales.as_slice()) + self.columns.bytes()
    }
}

/// The matrices that a shape is packed from.
pub(crate) struct Operators<'a> {
    /// `T_d->b`, modes x texels.
    pub coefficients_from_direct: &'a Matrix<f32>,
    /// Texels x joint modes.
    pub joint_basis: &'a Matrix<f32>,
    /// 9 probes³ x joint modes.
    pub probe_basis: &'a Matrix<f32>,
    /// 4 texels x joint modes, or no rows.
    pub vector_basis: &'a Matrix<f32>,
    /// By texel; empty if all are 1.
    pub areas: &'a [f32],
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
        let (rows, groups) = coefficient_rows(&folding, &classes, t, storage);
        let mut lists = ColumnLists::default();
        let of_class = |class: usize| {
            let modes = classes.joint.iter().zip(0u16..);
            modes.filter_map(move |(&c, mode)| (usize::from(c) == class).then_some(mode))
        };
        let joint_classes: Vec<Range<usize>> = (0..folding.elements())
            .map(|class| lists.push(of_class(class).map(u32::from)))
            .collect();
        let scales: Vec<f32> = (0..j.columns())
            .map(|mode| {
                let column = j.column(mode).iter();
                Values::scale(storage, column.fold(0.0f32, |m, x| m.max(x.abs())))
            })
            .collect();
        let mut joint = Values::new(storage);
        for class in 0..folding.elements() {
            for tile in (0..folding.stride).step_by(TILE) {
                for mode in of_class(class) {
                    let mode = usize::from(mode);
                    for orbit in tile..tile + TILE {
                        let value = folding.first(orbit).map_or(0.0, |texel| j[(texel, mode)]);
                        joint.push(value, scales[mode]);
                    }
                }
            }
        }
        // Levels are flat more often than not: blocks on one floor share the mirror between floor and ceiling.
        let is_odd = |mode: u16| {
            let class = classes.joint[usize::from(mode)];
            folding.up_mirror.is_some_and(|k| class >> k & 1 == 1)
        };
        let mut row_order: Vec<u16> = (0..j.columns() as u16).collect();
        row_order.sort_by_key(|&mode| (is_odd(mode), classes.joint[usize::from(mode)], mode));
        let even = row_order.partition_point(|&mode| !is_odd(mode));
        let row_tiles = row_tiles(0..even).chain(row_tiles(even..row_order.len()));
        let row_tiles = row_tiles.collect();
        let norm =
            |values: &mut dyn Iterator<Item = f32>| values.map(|x| x * x).sum::<f32>().sqrt();
        let coefficients = operators.probe_basis.rows() / SH_COEFFICIENTS.max(1);
        let texels = j.rows();
        let joint_norms: Vec<f32> = (0..j.columns())
            .map(|mode| norm(&mut j.column(mode).iter().copied()))
            .collect();
        Self {
            modes: t.rows(),
            joint_modes: j.columns(),
            rows,
            groups,
            joint,
            joint_columns: lists,
            joint_classes,
            row_inverses: row_order
                .iter()
                .map(|&mode| 1.0 / power_of_two(joint_norms[usize::from(mode)]))
                .collect(),
            row_units: joint_norms.iter().map(|&n| power_of_two(n)).collect(),
            joint_norms,
            coefficient_norms: (0..t.rows())
                .map(|mode| norm(&mut (0..texels).map(|texel| t[(mode, texel)])))
                .collect(),
            joint_scales: if storage == Storage::F32 {
                Vec::new()
            } else {
                scales
            },
            row_order,
            row_tiles,
            probes: Tiled::new(
                operators.probe_basis,
                operators.probe_basis.rows(),
                |k| k % coefficients * SH_COEFFICIENTS + k / coefficients,
                storage,
            ),
            vector: Tiled::new(
                operators.vector_basis,
                operators.vector_basis.rows(),
                |k| k,
                storage,
            ),
            folding,
        }
    }

    /// Bytes of all operators.
    pub fn bytes(&self) -> usize {
        self.stage_bytes().iter().sum::<usize>() + self.probes.bytes() + self.vector.bytes()
    }

    /// Bytes of `T_d->b` and of the joint basis.
    pub fn stage_bytes(&self) -> [usize; 2] {
        [
            self.rows.bytes() + size_of_val(self.groups.as_slice()),
            self.joint.bytes()
                + self.joint_columns.bytes()
                + size_of_val(self.joint_scales.as_slice()),
        ]
    }

    /// Multiply-adds of `T_d->b` and of the joint basis for one block, three channels, without padding.
    pub fn multiply_adds(&self) -> [usize; 2] {
        let orbits = self.folding.multiplicity.iter().filter(|&&m| m > 0.0);
        let orbits = orbits.count();
        [3 * orbits * self.modes, 3 * orbits * self.joint_modes]
    }
}

/// Tiles of rows that belong together; the last is a half one if that is enough.
fn row_tiles(rows: Range<usize>) -> impl Iterator<Item = RowTile> {
    rows.clone().step_by(TILE).map(move |start| {
        let count = TILE.min(rows.end - start);
        RowTile {
            start: start as u16,
            count: count as u8,
            height: if count <= HALF_TILE { HALF_TILE } else { TILE } as u8,
        }
    })
}

/// The largest power of two that is not above a number; 1 for what is no light.
fn power_of_two(x: f32) -> f32 {
    if x < 1e-30 {
        return 1.0;
    }
    f32::from_bits(x.to_bits() & 0x7f80_0000)
}

/// SH coefficients of a probe.
const SH_COEFFICIENTS: usize = crate::probes::PROBE_COEFFICIENTS;

fn coefficient_rows(
    folding: &Folding,
    classes: &Classes,
    t: &Matrix<f32>,
    storage: Storage,
) -> (Values, Vec<Group>) {
    let mut rows = Values::new(storage);
    let mut groups = Vec::new();
    for class in 0..folding.elements() {
        let modes: Vec<usize> = (0..t.rows())
            .filter(|&mode| usize::from(classes.coefficients[mode]) == class)
            .collect();
        // Groups of nearly equal size: five rows are three and two.
        let count = modes.len().div_ceil(DOT_ROWS);
        let part = |k: usize| &modes[k * modes.len() / count..(k + 1) * modes.len() / count];
        for members in (0..count).map(part) {
            let mut group = Group {
                class: class as u8,
                count: members.len() as u8,
                modes: [0; DOT_ROWS],
                scales: [1.0; DOT_ROWS],
            };
            for (k, &mode) in members.iter().enumerate() {
                let value = |orbit: usize| {
                    let texel = folding.first(orbit)?;
                    Some(t[(mode, texel)] * folding.multiplicity[orbit])
                };
                let orbits = 0..folding.stride;
                let largest = orbits
                    .clone()
                    .filter_map(value)
                    .fold(0.0f32, |m, x| m.max(x.abs()));
                group.modes[k] = mode as u16;
                group.scales[k] = Values::scale(storage, largest);
                for orbit in orbits {
                    rows.push(value(orbit).unwrap_or(0.0), group.scales[k]);
                }
            }
            groups.push(group);
        }
    }
    (rows, groups)
}
