//! Cuts free space into cells along grid lines, and finds out what lies beyond their sides.

use super::cell::{Cell, Cells, GridLines, SharedSide};
use super::column_runs::ColumnRuns;
use super::storeys::Shaft;
use super::voxels::FreeSpace;
use std::collections::BTreeMap;

/// Cuts the free space into cells along the lines.
pub fn cut_into_cells(space: &FreeSpace, columns: &ColumnRuns, lines: &GridLines) -> Cells {
    let mut cut = Cut {
        space,
        columns,
        lines,
        cells: Vec::new(),
        cell_of_run: vec![None; columns.runs.len()],
    };
    cut.find_cells();
    cut.find_outside();
    let sides = [0, 1].map(|axis| cut.shared_sides(axis)).concat();
    Cells {
        cells: cut.cells,
        sides,
    }
}

struct Cut<'a> {
    space: &'a FreeSpace,
    columns: &'a ColumnRuns,
    lines: &'a GridLines,
    cells: Vec<Cell>,
    /// By run of the columns; `None` for runs in no storey.
    cell_of_run: Vec<Option<usize>>,
}

impl Cut<'_> {
    fn find_cells(&mut self) {
        let [nx, nz] = self.lines.gaps();
        for k in 0..nz {
            for i in 0..nx {
                let shaft = Shaft {
                    columns: self.columns,
                    xs: self.lines.gap(0, i),
                    zs: self.lines.gap(1, k),
                };
                for storey in shaft.storeys(&self.space.grid) {
                    for run in storey.runs {
                        self.cell_of_run[run] = Some(self.cells.len());
                    }
                    self.cells.push(Cell {
                        column: [i, k],
                        ..storey.cell
                    });
                }
            }
        }
    }

    /// Measures how much of each cell's sides is open to places that are no free space.
    fn find_outside(&mut self) {
        let (space, grid) = (self.space, &self.space.grid);
        for (run, cell) in self.columns.runs.iter().zip(&self.cell_of_run) {
            let Some(cell) = *cell else {
                continue;
            };
            for axis in 0..2 {
                let gap = self.lines.gap(axis, self.cells[cell].column[axis]);
                let (at, stride) = (run.column[axis], grid.stride(2 * axis));
                let open_rows = |is_out: &dyn Fn(usize) -> bool| {
                    let index = |y: usize| grid.index([run.column[0], y, run.column[1]]);
                    run.rows.clone().filter(|&y| is_out(index(y))).count() as f64
                };
                let cut = &space.cut[2 * axis];
                if at == gap.start && at > 0 {
                    let is_out = |i: usize| !space.free[i - stride] && cut[i - stride].is_nan();
                    self.cells[cell].outside[2 * axis] += open_rows(&is_out);
                }
                if at + 1 == gap.end && at + 1 < self.columns.count[axis] {
                    let is_out = |i: usize| !space.free[i + stride] && cut[i].is_nan();
                    self.cells[cell].outside[2 * axis + 1] += open_rows(&is_out);
                }
            }
        }
        for cell in 0..self.cells.len() {
            for side in 0..4 {
                let area = self.side_area(cell, side / 2, side % 2 == 1);
                let outside = &mut self.cells[cell].outside[side];
                *outside = (*outside / area).min(1.0);
            }
        }
    }

    /// Area of a cell's side, voxel sides; at least 1.
    fn side_area(&self, cell: usize, axis: usize, positive: bool) -> f64 {
        let height = self.cells[cell].side_height(axis, positive);
        self.area(cell, axis, height)
    }

    /// Area of a side of this height that is as wide as the cell, voxel sides; at least 1.
    fn area(&self, cell: usize, axis: usize, height: f64) -> f64 {
        let across = 1 - axis;
        let width = self
            .lines
            .gap(across, self.cells[cell].column[across])
            .len() as f64;
        (width * height / self.space.grid.edge).max(1.0)
    }

    /// The sides that cells share across an axis: for each side of a cell the one with the widest opening.
    fn shared_sides(&self, axis: usize) -> Vec<SharedSide> {
        let links = self.links(axis).into_iter();
        let mut candidates: Vec<SharedSide> = links
            .map(|([low, high], open)| {
                let low_height = self.cells[low].side_height(axis, true);
                let height = low_height.min(self.cells[high].side_height(axis, false));
                let area = self.area(low, axis, height);
                SharedSide {
                    low,
                    high,
                    axis,
                    openness: (open as f64 / area).min(1.0),
                    area,
                    overlap: overlap(&self.cells[low], &self.cells[high], axis),
                }
            })
            .collect();
        candidates.sort_by(|p, q| {
            let open = |p: &SharedSide| p.openness * p.area;
            open(q)
                .total_cmp(&open(p))
                .then((p.low, p.high).cmp(&(q.low, q.high)))
        });
        let mut taken = vec![[false; 2]; self.cells.len()];
        candidates.retain(|side| {
            let is_free = !taken[side.low][1] && !taken[side.high][0];
            if is_free {
                taken[side.low][1] = true;
                taken[side.high][0] = true;
            }
            is_free
        });
        candidates
    }

    /// For each pair of cells that meet across an inner line, the number of links between their voxels.
    fn links(&self, axis: usize) -> BTreeMap<[usize; 2], usize> {
        let across = 1 - axis;
        let lines = &self.lines.lines[axis];
        let mut links = BTreeMap::new();
        for &line in &lines[1..lines.len() - 1] {
            for other in 0..self.columns.count[across] {
                let (mut low, mut high) = ([0; 2], [0; 2]);
                (low[axis], high[axis]) = (line - 1, line);
                (low[across], high[across]) = (other, other);
                for low_run in self.columns.runs_of(low[0], low[1]) {
                    for high_run in self.columns.runs_of(high[0], high[1]) {
                        let cells = (self.cell_of_run[low_run], self.cell_of_run[high_run]);
                        if let (Some(a), Some(b)) = cells {
                            let open = self.open_rows([low_run, high_run], 2 * axis);
                            *links.entry([a, b]).or_default() += open;
                        }
                    }
                }
            }
        }
        links
    }

    /// Rows in which two runs of neighbouring columns are linked along an axis of the world.
    fn open_rows(&self, runs: [usize; 2], world_axis: usize) -> usize {
        let [low, high] = runs.map(|run| &self.columns.runs[run]);
        let [x, z] = low.column;
        let rows = low.rows.start.max(high.rows.start)..low.rows.end.min(high.rows.end);
        let index = |y: usize| self.space.grid.index([x, y, z]);
        rows.filter(|&y| self.space.is_linked(index(y), world_axis))
            .count()
    }
}

/// Shared over total height of the sides of two cells that meet.
fn overlap(low: &Cell, high: &Cell, axis: usize) -> f64 {
    let (a, b) = (low.side_range(axis, true), high.side_range(axis, false));
    let shared = a[1].min(b[1]) - a[0].max(b[0]);
    (shared / (a[1].max(b[1]) - a[0].min(b[0]))).max(0.0)
}
