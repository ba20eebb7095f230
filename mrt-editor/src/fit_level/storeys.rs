//! Storeys: the heights at which the columns between four grid lines are free.

use super::cell::Cell;
use super::column_runs::ColumnRuns;
use super::voxels::VoxelGrid;
use std::collections::BTreeMap;
use std::ops::Range;

/// A storey exists at the heights where at least this share of the columns between the lines is free.
const LEAST_COVERAGE: f64 = 0.35;

/// Columns between neighbouring lines along x and z, and the free space in them.
#[derive(Clone, Debug)]
pub(super) struct Shaft<'a> {
    pub(super) columns: &'a ColumnRuns,
    pub(super) xs: Range<usize>,
    pub(super) zs: Range<usize>,
}

/// A cell, and the runs that make it up.
pub(super) struct Storey {
    pub(super) cell: Cell,
    /// Indices into [`ColumnRuns::runs`].
    pub(super) runs: Vec<usize>,
}

impl Shaft<'_> {
    /// The storeys of the shaft as cells, from the lowest; their column and what is outside are left at zero.
    pub(super) fn storeys(&self, grid: &VoxelGrid) -> Vec<Storey> {
        let rows = self.rows_of_storeys();
        rows.iter()
            .filter_map(|rows| self.gather(grid, rows))
            .collect()
    }

    fn columns(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let zs = self.zs.clone();
        zs.flat_map(|z| self.xs.clone().map(move |x| [x, z]))
    }

    /// Heights (voxel rows) where enough of the columns are free and run on into one another.
    fn rows_of_storeys(&self) -> Vec<Range<usize>> {
        let least = ((self.xs.len() * self.zs.len()) as f64 * LEAST_COVERAGE).ceil() as usize;
        // By row: how the number of free columns changes, and the number of links from row to row.
        let mut change: BTreeMap<usize, [isize; 2]> = BTreeMap::new();
        for [x, z] in self.columns() {
            for run in &self.columns.runs[self.columns.runs_of(x, z)] {
                change.entry(run.rows.start).or_default()[0] += 1;
                change.entry(run.rows.end).or_default()[0] -= 1;
                change.entry(run.rows.start + 1).or_default()[1] += 1;
                change.entry(run.rows.end).or_default()[1] -= 1;
            }
        }
        let mut storeys: Vec<Range<usize>> = Vec::new();
        let (mut free, mut linked) = (0, 0);
        let rows: Vec<usize> = change.keys().copied().collect();
        for (k, (&row, &[free_change, linked_change])) in change.iter().enumerate() {
            free += free_change;
            linked += linked_change;
            let end = rows.get(k + 1).copied().unwrap_or(row + 1);
            if (free as usize) < least {
                continue;
            }
            match storeys.last_mut() {
                Some(last) if last.end == row && linked as usize >= least => last.end = end,
                _ => storeys.push(row..end),
            }
        }
        storeys
    }

    /// The runs that belong to a storey, and the cell that they make; `None` if there are none.
    fn gather(&self, grid: &VoxelGrid, rows: &Range<usize>) -> Option<Storey> {
        let mut floors: [Vec<f64>; 4] = Default::default();
        let mut ceilings: [Vec<f64>; 4] = Default::default();
        let (mut volume, mut runs) = (0, Vec::new());
        // A shaft or stairwell must not pull the storey's ceiling or floor through others.
        let (low, high) = (grid.boundary(1, rows.start), grid.boundary(1, rows.end));
        let slack = 0.5 * (high - low);
        for [x, z] in self.columns() {
            for index in self.columns.runs_of(x, z) {
                let run = &self.columns.runs[index];
                if !is_mostly_in(&run.rows, rows) {
                    continue;
                }
                // Quarters overlap by a half, so that a narrow pillar cannot decide for a corner.
                for (k, (floors, ceilings)) in floors.iter_mut().zip(&mut ceilings).enumerate() {
                    if is_near_corner(x, &self.xs, k & 1) && is_near_corner(z, &self.zs, k >> 1) {
                        floors.push(run.floor.max(low - slack));
                        ceilings.push(run.ceiling.min(high + slack));
                    }
                }
                runs.push(index);
                volume += run.rows.len();
            }
        }
        let fallback_floor = median(&mut floors.concat())?;
        let fallback_ceiling = median(&mut ceilings.concat())?;
        let cell = Cell {
            column: [0; 2],
            floor: floors.map(|mut heights| median(&mut heights).unwrap_or(fallback_floor)),
            ceiling: ceilings.map(|mut heights| median(&mut heights).unwrap_or(fallback_ceiling)),
            volume,
            outside: [0.0; 4],
        };
        Some(Storey { cell, runs })
    }
}

/// True if the common rows are at least half of the shorter range.
fn is_mostly_in(run: &Range<usize>, storey: &Range<usize>) -> bool {
    let end = run.end.min(storey.end);
    let shared = end.saturating_sub(run.start.max(storey.start));
    shared > 0 && 2 * shared >= run.len().min(storey.len())
}

/// True in the half of the range on the side of the corner.
fn is_near_corner(position: usize, range: &Range<usize>, side: usize) -> bool {
    let twice = 2 * (position - range.start) + 1;
    if side == 0 {
        twice <= range.len() + 1
    } else {
        twice + 1 >= range.len()
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
