//! Cells: the free space between neighbouring grid lines, one for each storey, and the passages
//! between them.

use super::columns::Columns;
use super::voxels::{FreeSpace, VoxelGrid};
use std::collections::BTreeMap;
use std::ops::Range;

/// A storey exists at the heights where at least this share of the columns between the lines is free.
const LEAST_COVERAGE: f64 = 0.35;

/// Positions of grid lines, as voxel boundaries along x and z, ascending; the first and the last
/// bound the level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GridLines {
    /// Along x and along z.
    pub lines: [Vec<usize>; 2],
}

/// One storey between two neighbouring lines along x and along z.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Position between the lines along x and z.
    pub column: [usize; 2],
    /// Floor near the corners (-x-z, +x-z, -x+z, +x+z), metres.
    pub floor: [f64; 4],
    /// Ceiling near the corners, metres.
    pub ceiling: [f64; 4],
    /// Free volume, voxels.
    pub volume: usize,
    /// Share of each side (-x, +x, -z, +z) through which free space ends without a surface: the level
    /// is open there, as at a window or the missing front of a stage.
    pub outside: [f64; 4],
}

/// The common side of two cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Cell on the side of smaller coordinates.
    pub low: usize,
    /// Cell on the side of larger coordinates.
    pub high: usize,
    /// 0 when the side is perpendicular to x, 1 when to z.
    pub axis: usize,
    /// Share of the smaller side that nothing blocks.
    pub openness: f64,
    /// Area of the smaller side, voxel sides.
    pub area: f64,
    /// Height that both sides share over the height that both reach through: 1 for equal sides.
    pub overlap: f64,
}

/// Cells and the sides they share.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Sorted by column and height.
    pub cells: Vec<Cell>,
    /// At most one for each side of a cell: the one with the widest opening.
    pub passages: Vec<Passage>,
}

impl GridLines {
    /// Number of gaps between lines along x and z.
    pub fn gaps(&self) -> [usize; 2] {
        [self.lines[0].len() - 1, self.lines[1].len() - 1]
    }

    /// Voxel columns between a pair of neighbouring lines.
    pub fn gap(&self, axis: usize, position: usize) -> Range<usize> {
        self.lines[axis][position]..self.lines[axis][position + 1]
    }
}

impl Cell {
    /// Mean height of the side across `axis` (0: x, 1: z) at the larger or smaller coordinate.
    fn side_height(&self, axis: usize, positive: bool) -> f64 {
        let corners = side_corners(axis, positive);
        corners
            .map(|k| self.ceiling[k] - self.floor[k])
            .iter()
            .sum::<f64>()
            / 2.0
    }
}

/// Corners (bit 0: +x, bit 1: +z) of the side across an axis.
pub fn side_corners(axis: usize, positive: bool) -> [usize; 2] {
    match (axis, positive) {
        (0, false) => [0, 2],
        (0, true) => [1, 3],
        (_, false) => [0, 1],
        (_, true) => [2, 3],
    }
}

/// Cuts the free space into cells along the lines.
pub fn cut_into_cells(space: &FreeSpace, columns: &Columns, lines: &GridLines) -> Cells {
    let [nx, nz] = lines.gaps();
    let mut cells = Vec::new();
    let mut cell_of_run = vec![None; columns.runs.len()];
    for k in 0..nz {
        for i in 0..nx {
            let (xs, zs) = (lines.gap(0, i), lines.gap(1, k));
            for storey in storeys(columns, &xs, &zs) {
                let cell = cells.len();
                if let Some(found) = gather(
                    &space.grid,
                    columns,
                    [&xs, &zs],
                    &storey,
                    &mut cell_of_run,
                    cell,
                ) {
                    cells.push(Cell {
                        column: [i, k],
                        ..found
                    });
                }
            }
        }
    }
    find_outside(space, columns, lines, &mut cells, &cell_of_run);
    let passages = passages(space, columns, lines, &cells, &cell_of_run);
    Cells { cells, passages }
}

/// Measures how much of each cell's sides is open to places that are no free space.
fn find_outside(
    space: &FreeSpace,
    columns: &Columns,
    lines: &GridLines,
    cells: &mut [Cell],
    cell_of_run: &[Option<usize>],
) {
    let grid = &space.grid;
    for (run, cell) in columns.runs.iter().zip(cell_of_run) {
        let Some(cell) = *cell else {
            continue;
        };
        for axis in 0..2 {
            let gap = lines.gap(axis, cells[cell].column[axis]);
            let (at, stride) = (run.column[axis], grid.stride(2 * axis));
            let open_rows = |is_out: &dyn Fn(usize) -> bool| {
                let index = |y: usize| grid.index([run.column[0], y, run.column[1]]);
                run.rows.clone().filter(|&y| is_out(index(y))).count() as f64
            };
            let cut = &space.cut[2 * axis];
            if at == gap.start && at > 0 {
                let is_out = |i: usize| !space.free[i - stride] && cut[i - stride].is_nan();
                cells[cell].outside[2 * axis] += open_rows(&is_out);
            }
            if at + 1 == gap.end && at + 1 < columns.count[axis] {
                let is_out = |i: usize| !space.free[i + stride] && cut[i].is_nan();
                cells[cell].outside[2 * axis + 1] += open_rows(&is_out);
            }
        }
    }
    for cell in cells {
        for side in 0..4 {
            let (axis, positive) = (side / 2, side % 2 == 1);
            let width = lines.gap(1 - axis, cell.column[1 - axis]).len() as f64;
            let area = (width * cell.side_height(axis, positive) / grid.edge).max(1.0);
            cell.outside[side] = (cell.outside[side] / area).min(1.0);
        }
    }
}

/// Heights (voxel rows) where enough of the columns are free and run on into one another.
fn storeys(columns: &Columns, xs: &Range<usize>, zs: &Range<usize>) -> Vec<Range<usize>> {
    let least = ((xs.len() * zs.len()) as f64 * LEAST_COVERAGE).ceil() as usize;
    // Rises and falls of the number of free columns, and of the links from row to row.
    let mut change: BTreeMap<usize, [isize; 2]> = BTreeMap::new();
    for z in zs.clone() {
        for x in xs.clone() {
            for run in &columns.runs[columns.runs_of(x, z)] {
                change.entry(run.rows.start).or_default()[0] += 1;
                change.entry(run.rows.end).or_default()[0] -= 1;
                change.entry(run.rows.start + 1).or_default()[1] += 1;
                change.entry(run.rows.end).or_default()[1] -= 1;
            }
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

/// Claims the runs that belong to a storey and measures its corners.
fn gather(
    grid: &VoxelGrid,
    columns: &Columns,
    [xs, zs]: [&Range<usize>; 2],
    storey: &Range<usize>,
    cell_of_run: &mut [Option<usize>],
    cell: usize,
) -> Option<Cell> {
    let mut floors: [Vec<f64>; 4] = Default::default();
    let mut ceilings: [Vec<f64>; 4] = Default::default();
    let mut volume = 0;
    for z in zs.clone() {
        for x in xs.clone() {
            for index in columns.runs_of(x, z) {
                let run = &columns.runs[index];
                let shared = run.rows.end.min(storey.end) as isize
                    - run.rows.start.max(storey.start) as isize;
                if shared <= 0 || 2 * (shared as usize) < run.rows.len().min(storey.len()) {
                    continue;
                }
                // A shaft or stairwell must not pull the storey's ceiling or floor through others.
                let (low, high) = (grid.boundary(1, storey.start), grid.boundary(1, storey.end));
                let slack = 0.5 * (high - low);
                // Quarters overlap by a half, so that a narrow pillar cannot decide for a corner.
                for (k, (floors, ceilings)) in floors.iter_mut().zip(&mut ceilings).enumerate() {
                    if is_near_corner(x, xs, k & 1) && is_near_corner(z, zs, k >> 1) {
                        floors.push(run.floor.max(low - slack));
                        ceilings.push(run.ceiling.min(high + slack));
                    }
                }
                cell_of_run[index] = Some(cell);
                volume += run.rows.len();
            }
        }
    }
    let fallback_floor = median(&mut floors.concat())?;
    let fallback_ceiling = median(&mut ceilings.concat())?;
    let floor = floors.map(|mut heights| median(&mut heights).unwrap_or(fallback_floor));
    let ceiling = ceilings.map(|mut heights| median(&mut heights).unwrap_or(fallback_ceiling));
    Some(Cell {
        column: [0, 0],
        floor,
        ceiling,
        volume,
        outside: [0.0; 4],
    })
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

/// Shared over total height of the sides of two cells that meet.
fn overlap(low: &Cell, high: &Cell, axis: usize) -> f64 {
    let range = |cell: &Cell, positive: bool| {
        let corners = side_corners(axis, positive);
        let mean = |heights: &[f64; 4]| corners.map(|k| heights[k]).iter().sum::<f64>() / 2.0;
        (mean(&cell.floor), mean(&cell.ceiling))
    };
    let (a, b) = (range(low, true), range(high, false));
    let shared = a.1.min(b.1) - a.0.max(b.0);
    (shared / (a.1.max(b.1) - a.0.min(b.0))).max(0.0)
}

/// Counts the links between cells across every inner line and keeps the widest for each side.
fn passages(
    space: &FreeSpace,
    columns: &Columns,
    lines: &GridLines,
    cells: &[Cell],
    cell_of_run: &[Option<usize>],
) -> Vec<Passage> {
    let grid = &space.grid;
    let mut found = Vec::new();
    for axis in 0..2 {
        let world_axis = 2 * axis;
        let across = 1 - axis;
        let mut links: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for &line in &lines.lines[axis][1..lines.lines[axis].len() - 1] {
            for other in 0..columns.count[across] {
                let (mut low, mut high) = ([0; 2], [0; 2]);
                (low[axis], high[axis]) = (line - 1, line);
                (low[across], high[across]) = (other, other);
                for low_run in columns.runs_of(low[0], low[1]) {
                    for high_run in columns.runs_of(high[0], high[1]) {
                        let (Some(a), Some(b)) = (cell_of_run[low_run], cell_of_run[high_run])
                        else {
                            continue;
                        };
                        let (a_rows, b_rows) =
                            (&columns.runs[low_run].rows, &columns.runs[high_run].rows);
                        let rows = a_rows.start.max(b_rows.start)..a_rows.end.min(b_rows.end);
                        let open = rows
                            .filter(|&y| {
                                space.is_linked(grid.index([low[0], y, low[1]]), world_axis)
                            })
                            .count();
                        *links.entry((a, b)).or_default() += open;
                    }
                }
            }
        }
        let mut candidates: Vec<Passage> = links
            .into_iter()
            .map(|((low, high), open)| {
                let height = cells[low]
                    .side_height(axis, true)
                    .min(cells[high].side_height(axis, false));
                let width = lines.gap(across, cells[low].column[across]).len() as f64;
                let area = (width * height / grid.edge).max(1.0);
                let openness = (open as f64 / area).min(1.0);
                Passage {
                    low,
                    high,
                    axis,
                    openness,
                    area,
                    overlap: overlap(&cells[low], &cells[high], axis),
                }
            })
            .collect();
        candidates.sort_by(|p, q| {
            let open = |p: &Passage| p.openness * p.area;
            open(q)
                .total_cmp(&open(p))
                .then((p.low, p.high).cmp(&(q.low, q.high)))
        });
        let mut taken = vec![[false; 2]; cells.len()];
        for passage in candidates {
            if !taken[passage.low][1] && !taken[passage.high][0] {
                taken[passage.low][1] = true;
                taken[passage.high][0] = true;
                found.push(passage);
            }
        }
    }
    found
}
