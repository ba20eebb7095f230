//! Where to cut the free space: unequally spaced grid lines that follow the walls.
//!
//! First the lines are placed, axis by axis, by dynamic programming: a line earns the wall area that it stands at and pays
//! for gaps that differ from the cell size asked for. Then lines across which the cells agree are taken out again, the
//! least needed first.

use super::cell::{Cell, Cells, GridLines};
use super::column_runs::ColumnRuns;
use super::cut::cut_into_cells;
use super::voxels::FreeSpace;
use std::ops::Range;

/// How coarse the cells are to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineConfig {
    /// Wanted width of a gap, metres.
    pub cell: f64,
    /// Lines are taken out until at most this many cells are left.
    pub max_cells: usize,
    /// Lines whose sides disagree by less than this are taken out, as long as gaps stay below [`WIDEST_GAP`].
    pub tolerance: f64,
}

/// Narrowest gap, in cells.
const NARROWEST_GAP: f64 = 0.5;

/// Widest gap that placing or taking out lines may leave, in cells: transport in a box stretched 1:1.5 errs by 15 %, in one
/// of 1:2 by 25 %.
pub const WIDEST_GAP: f64 = 1.6;

/// What a gap twice as wide as asked for costs, in what the line with the most walls earns.
const STRETCH_COST: f64 = 0.4;

/// Chooses lines for both axes and takes out the unneeded ones.
pub fn choose_lines(space: &FreeSpace, columns: &ColumnRuns, config: &LineConfig) -> GridLines {
    let mut lines = GridLines {
        lines: std::array::from_fn(|axis| place_lines(space, columns, axis, config.cell)),
    };
    loop {
        let cells = cut_into_cells(space, columns, &lines);
        let is_over = cells.cells.len() > config.max_cells;
        let Some((axis, position)) = least_needed(space, &cells, &lines, config, is_over) else {
            return lines;
        };
        lines.lines[axis].remove(position);
    }
}

/// The columns that have runs, along one axis.
fn occupied(columns: &ColumnRuns, axis: usize) -> Range<usize> {
    let used = || columns.runs.iter().map(|run| run.column[axis]);
    used().min().unwrap_or(0)..used().max().map_or(1, |last| last + 1)
}

/// The best set of lines along one axis.
fn place_lines(space: &FreeSpace, columns: &ColumnRuns, axis: usize, cell: f64) -> Vec<usize> {
    let range = occupied(columns, axis);
    let wall = wall_area(space, columns, axis);
    let strongest = wall[range.start..=range.end]
        .iter()
        .copied()
        .fold(1.0, f64::max);
    let wanted = cell / space.grid.edge;
    let narrowest = (NARROWEST_GAP * wanted).ceil().max(1.0) as usize;
    let widest = (WIDEST_GAP * wanted).ceil() as usize;
    if range.len() < 2 * narrowest {
        return vec![range.start, range.end];
    }
    // best[p]: largest profit of lines up to a line at range.start + p, and the line before it.
    let mut best: Vec<Option<(f64, usize)>> = vec![None; range.len() + 1];
    best[0] = Some((0.0, 0));
    for p in 1..=range.len() {
        let is_end = p == range.len();
        for gap in narrowest..=widest.min(p) {
            let Some((profit, _)) = best[p - gap] else {
                continue;
            };
            let stretch = (gap as f64 / wanted).log2();
            let earned = if is_end {
                0.0
            } else {
                wall[range.start + p] / strongest
            };
            let total = profit + earned - STRETCH_COST * stretch * stretch;
            if best[p].is_none_or(|(other, _)| total > other) {
                best[p] = Some((total, p - gap));
            }
        }
    }
    let mut lines = vec![range.end];
    let mut p = range.len();
    while p > 0 {
        // Every length of at least two narrowest gaps is a sum of legal gaps.
        p = best[p].map_or(0, |(_, previous)| previous);
        lines.push(range.start + p);
    }
    lines.reverse();
    lines
}

/// For each voxel boundary along the axis, the number of sides of free voxels that something stands against.
fn wall_area(space: &FreeSpace, columns: &ColumnRuns, axis: usize) -> Vec<f64> {
    let mut wall = vec![0.0; columns.count[axis] + 1];
    let world_axis = 2 * axis;
    let stride = space.grid.stride(world_axis);
    for run in &columns.runs {
        let at = run.column[axis];
        for y in run.rows.clone() {
            let index = space.grid.index([run.column[0], y, run.column[1]]);
            if at + 1 < columns.count[axis] && !space.is_linked(index, world_axis) {
                wall[at + 1] += 1.0;
            }
            if at > 0 && !space.is_linked(index - stride, world_axis) {
                wall[at] += 1.0;
            }
        }
    }
    wall
}

/// Axis and position of the inner line whose removal changes least; `None` when all are needed. `is_over` if there are too
/// many cells.
fn least_needed(
    space: &FreeSpace,
    cells: &Cells,
    lines: &GridLines,
    config: &LineConfig,
    is_over: bool,
) -> Option<(usize, usize)> {
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in 0..2 {
        let changes = disagreements(cells, lines, axis);
        for (position, change) in changes.into_iter().enumerate().skip(1) {
            let line = &lines.lines[axis];
            if position + 1 >= line.len() {
                continue;
            }
            let gap = (line[position + 1] - line[position - 1]) as f64 * space.grid.edge;
            let is_stretched = gap > WIDEST_GAP * config.cell;
            if !is_over && (is_stretched || change > config.tolerance) {
                continue;
            }
            // Where lines must go, those that leave no stretched gap go first.
            let cost = change + (gap / (WIDEST_GAP * config.cell)).max(1.0) - 1.0;
            if best.is_none_or(|(least, _, _)| cost < least) {
                best = Some((cost, axis, position));
            }
        }
    }
    best.map(|(_, axis, position)| (axis, position))
}

/// For each line, the share of the sides along it at which the cells on both sides are not one room with one floor and one
/// ceiling.
fn disagreements(cells: &Cells, lines: &GridLines, axis: usize) -> Vec<f64> {
    let mut agreed = vec![0.0; lines.lines[axis].len()];
    let mut total = vec![0.0; lines.lines[axis].len()];
    let side_area = |cell: &Cell| {
        let height: f64 = (0..4).map(|k| cell.ceiling[k] - cell.floor[k]).sum();
        height * lines.gap(1 - axis, cell.column[1 - axis]).len() as f64 / 4.0
    };
    for cell in &cells.cells {
        let position = cell.column[axis];
        total[position] += side_area(cell);
        total[position + 1] += side_area(cell);
    }
    for side in cells.sides.iter().filter(|side| side.axis == axis) {
        let (low, high) = (&cells.cells[side.low], &cells.cells[side.high]);
        let area = side_area(low) + side_area(high);
        agreed[high.column[axis]] += area * side.openness * likeness(low, high);
    }
    (0..total.len())
        .map(|line| {
            if total[line] > 0.0 {
                1.0 - agreed[line] / total[line]
            } else {
                0.0
            }
        })
        .collect()
}

/// 1 for cells of the same floor and ceiling; 0 if floor and ceiling together differ by the height of the lower cell.
fn likeness(a: &Cell, b: &Cell) -> f64 {
    let mean = |heights: &[f64; 4]| heights.iter().sum::<f64>() / 4.0;
    let (floor, ceiling) = (
        mean(&a.floor) - mean(&b.floor),
        mean(&a.ceiling) - mean(&b.ceiling),
    );
    let height = (mean(&a.ceiling) - mean(&a.floor)).min(mean(&b.ceiling) - mean(&b.floor));
    (1.0 - (floor.abs() + ceiling.abs()) / height.max(1e-9)).max(0.0)
}
