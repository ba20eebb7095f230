//! Runs of free voxels from floor to ceiling in every column of voxels.

use super::voxels::FreeSpace;
use std::ops::Range;

/// A stretch of free space between a floor and a ceiling.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Column along x and z.
    pub column: [usize; 2],
    /// Voxels along y.
    pub rows: Range<usize>,
    /// Height of the surface below, metres.
    pub floor: f64,
    /// Height of the surface above, metres; under the open sky the top of the highest free voxel.
    pub ceiling: f64,
}

/// All runs, column by column.
#[derive(Clone, Debug)]
pub struct ColumnRuns {
    /// Number of columns along x and z.
    pub count: [usize; 2],
    /// Sorted by z, then x, then height.
    pub runs: Vec<Run>,
    /// The runs of column k are `starts[k]..starts[k + 1]`.
    starts: Vec<usize>,
}

impl ColumnRuns {
    /// Finds the runs that are at least `headroom` metres high.
    pub fn new(space: &FreeSpace, headroom: f64) -> Self {
        let grid = &space.grid;
        let count = [grid.count[0], grid.count[2]];
        let mut columns = Self {
            count,
            runs: Vec::new(),
            starts: vec![0],
        };
        for z in 0..count[1] {
            for x in 0..count[0] {
                let runs = rows_of_runs(space, [x, z])
                    .into_iter()
                    .map(|rows| run_of(space, [x, z], rows))
                    .filter(|run| run.ceiling - run.floor >= headroom);
                columns.runs.extend(runs);
                columns.starts.push(columns.runs.len());
            }
        }
        columns
    }

    /// Indices of a column's runs, from the lowest.
    pub fn runs_of(&self, x: usize, z: usize) -> Range<usize> {
        let column = z * self.count[0] + x;
        self.starts[column]..self.starts[column + 1]
    }

    /// The rooms' height as a person would call it, metres: half of the free volume is in runs up to this height. `None`
    /// without runs.
    pub fn typical_height(&self) -> Option<f64> {
        let mut heights: Vec<f64> = self.runs.iter().map(|r| r.ceiling - r.floor).collect();
        heights.sort_by(f64::total_cmp);
        let half = heights.iter().sum::<f64>() / 2.0;
        let mut volume = 0.0;
        heights.into_iter().find(|height| {
            volume += height;
            volume >= half
        })
    }
}

/// Stretches of free voxels of a column that nothing cuts, from the lowest.
fn rows_of_runs(space: &FreeSpace, [x, z]: [usize; 2]) -> Vec<Range<usize>> {
    let grid = &space.grid;
    let height = grid.count[1];
    let mut runs = Vec::new();
    let mut y = 0;
    while y < height {
        let first = y;
        while y < height && space.free[grid.index([x, y, z])] {
            y += 1;
            let last = grid.index([x, y - 1, z]);
            if y < height && !space.is_linked(last, 1) {
                break;
            }
        }
        if y > first {
            runs.push(first..y);
        } else {
            y += 1;
        }
    }
    runs
}

/// Takes floor and ceiling from the surfaces, but from none more than a voxel beyond the free voxels: where the free space
/// ends without a surface, the next surface can be anywhere.
fn run_of(space: &FreeSpace, column: [usize; 2], rows: Range<usize>) -> Run {
    let grid = &space.grid;
    let at = |y: usize| grid.index([column[0], y, column[1]]);
    let (bottom, top) = (grid.boundary(1, rows.start), grid.boundary(1, rows.end));
    let floor = f64::from(space.floor[at(rows.start)]).max(bottom - grid.edge);
    let ceiling = f64::from(space.ceiling[at(rows.end - 1)]);
    let ceiling = if ceiling > top + grid.edge {
        top
    } else {
        ceiling
    };
    Run {
        column,
        rows,
        floor,
        ceiling,
    }
}
