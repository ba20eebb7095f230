//! Finds the blocks near a point in constant time: a uniform grid over the bounds of all blocks.

use crate::level::block_index::BlockIndex;
use glam::{DVec3, UVec3};

/// Cells that a grid has for each block, about: few enough that the grid takes less memory than the blocks.
const CELLS_PER_BLOCK: f64 = 2.0;

/// Most cells along an axis.
const MAX_CELLS_PER_AXIS: f64 = 1024.0;

/// Most entries in a grid's lists for each block. Unit cells in rows reach into 27 cells each; in a level with many
/// large blocks among small ones, the grid gets coarser until its lists are this short.
const ENTRIES_PER_BLOCK: usize = 64;

/// For each cell of a uniform grid, the blocks whose bounds reach into it.
#[derive(Clone, Debug)]
pub(crate) struct BlockGrid {
    low: DVec3,
    cells_per_metre: DVec3,
    cells: UVec3,
    /// Cell k has the blocks `blocks[first[k]..first[k + 1]]`, ascending.
    first: Vec<u32>,
    blocks: Vec<BlockIndex>,
}

impl BlockGrid {
    /// A grid over the bounds (smallest, largest) of each block, metres, in the order of the blocks. A point that is
    /// outside some bounds by at most `slack` of their diagonal counts as inside.
    pub(crate) fn new(bounds: &[(DVec3, DVec3)], slack: f64) -> Self {
        let widened: Vec<(DVec3, DVec3)> = bounds
            .iter()
            .map(|&(low, high)| {
                // Twice the slack: a point that counts as inside stays inside when the comparison below is rounded.
                let margin = DVec3::splat(2.0 * slack * (high - low).length());
                (low - margin, high + margin)
            })
            .collect();
        let lows = widened.iter().map(|b| b.0);
        let low = lows.reduce(DVec3::min).unwrap_or(DVec3::ZERO);
        let highs = widened.iter().map(|b| b.1);
        let high = highs.reduce(DVec3::max).unwrap_or(DVec3::ZERO);
        let size = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut grid = Self::without_blocks(low, size, cells_along_axes(bounds, size));
        while grid.entry_count(&widened) > ENTRIES_PER_BLOCK * bounds.len() {
            let cells = (grid.cells / 2).max(UVec3::ONE);
            if cells == grid.cells {
                break;
            }
            grid = Self::without_blocks(low, size, cells);
        }
        grid.list_blocks(&widened);
        grid
    }

    fn without_blocks(low: DVec3, size: DVec3, cells: UVec3) -> Self {
        Self {
            low,
            cells_per_metre: cells.as_dvec3() / size,
            cells,
            first: Vec::new(),
            blocks: Vec::new(),
        }
    }

    /// Number of pairs of a block and a cell that its bounds reach into.
    fn entry_count(&self, bounds: &[(DVec3, DVec3)]) -> usize {
        let cells = |&(low, high): &(DVec3, DVec3)| {
            let reach = self.cell_of(high) - self.cell_of(low) + 1;
            reach
                .to_array()
                .map(|n| n as usize)
                .iter()
                .product::<usize>()
        };
        bounds.iter().map(cells).sum()
    }

    fn list_blocks(&mut self, bounds: &[(DVec3, DVec3)]) {
        let mut pairs: Vec<(u32, BlockIndex)> = Vec::new();
        for (index, &(low, high)) in bounds.iter().enumerate() {
            let (from, to) = (self.cell_of(low), self.cell_of(high));
            for z in from.z..=to.z {
                for y in from.y..=to.y {
                    for x in from.x..=to.x {
                        let cell = self.position(UVec3::new(x, y, z));
                        pairs.push((cell as u32, BlockIndex::new(index)));
                    }
                }
            }
        }
        pairs.sort_unstable();
        let mut next = 0;
        for cell in 0..=self.cells.element_product() {
            next += pairs[next..].partition_point(|pair| pair.0 < cell);
            self.first.push(next as u32);
        }
        self.blocks = pairs.into_iter().map(|pair| pair.1).collect();
    }

    /// Blocks whose widened bounds may contain a point, ascending.
    pub(crate) fn near(&self, point: DVec3) -> &[BlockIndex] {
        let place = (point - self.low) * self.cells_per_metre;
        // Comparisons with NaN are false, so a point with a NaN is outside.
        let is_inside = place.cmpge(DVec3::ZERO).all() && place.cmple(self.cells.as_dvec3()).all();
        if !is_inside {
            return &[];
        }
        let cell = self.position(self.cell_of(point));
        &self.blocks[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    /// The cell that contains a point, or the nearest cell to a point outside the grid. It never decreases where a
    /// coordinate increases, whatever the rounding: a point within bounds is in a cell that lists their block.
    fn cell_of(&self, point: DVec3) -> UVec3 {
        let place = (point - self.low) * self.cells_per_metre;
        let last = (self.cells - 1).as_dvec3();
        place.floor().clamp(DVec3::ZERO, last).as_uvec3()
    }

    /// Index of a cell, x fastest, then y, then z.
    fn position(&self, cell: UVec3) -> usize {
        ((cell.z * self.cells.y + cell.y) * self.cells.x + cell.x) as usize
    }
}

/// Number of cells along each axis: cells about as large as the mean block, and about [`CELLS_PER_BLOCK`] times as many
/// as blocks at most.
fn cells_along_axes(bounds: &[(DVec3, DVec3)], size: DVec3) -> UVec3 {
    let count = bounds.len().max(1) as f64;
    let sum: DVec3 = bounds.iter().map(|(low, high)| *high - *low).sum();
    let mean = (sum / count).max(DVec3::splat(f64::MIN_POSITIVE));
    let wanted = (size / mean)
        .round()
        .clamp(DVec3::ONE, DVec3::splat(MAX_CELLS_PER_AXIS));
    let excess = wanted.element_product() / (CELLS_PER_BLOCK * count);
    let cells = if excess > 1.0 {
        // Axes of one cell stay; the others are divided by the same factor.
        let axes = wanted.to_array().iter().filter(|&&n| n > 1.0).count();
        wanted * excess.powf(-1.0 / axes.max(1) as f64)
    } else {
        wanted
    };
    cells.floor().max(DVec3::ONE).as_uvec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_is_found_wherever_its_bounds_are() {
        // Blocks of many sizes, one that encloses the others, and one far away.
        let mut bounds = vec![(DVec3::splat(-2.0), DVec3::splat(9.0))];
        for k in 0..60 {
            let k = f64::from(k);
            let low = DVec3::new((k * 0.77) % 7.0, (k * 0.31) % 5.0, (k * 1.7) % 6.0);
            let size = DVec3::new(0.1 + (k * 0.13) % 1.5, 0.2, 0.01 + (k * 0.07) % 2.0);
            bounds.push((low, low + size));
        }
        bounds.push((DVec3::splat(400.0), DVec3::splat(401.0)));
        let grid = BlockGrid::new(&bounds, 1e-4);
        for (index, (low, high)) in bounds.iter().enumerate() {
            for corner in 0..27 {
                let part = |axis: u32| f64::from(corner / 3i32.pow(axis) % 3) / 2.0;
                let at = DVec3::new(part(0), part(1), part(2));
                let point = *low + (*high - *low) * at;
                let near = grid.near(point);
                assert!(near.contains(&BlockIndex::new(index)), "{index} at {point}");
                assert!(near.is_sorted());
            }
        }
        assert!(grid.near(DVec3::splat(f64::NAN)).is_empty());
        assert!(grid.near(DVec3::splat(-3.0)).is_empty());
        assert!(grid.near(DVec3::splat(f64::INFINITY)).is_empty());
    }

    #[test]
    fn large_blocks_among_small_ones_do_not_fill_the_memory() {
        let small = (0..4000).map(|k| (DVec3::splat(f64::from(k) * 0.01), DVec3::splat(0.005)));
        let large = (0..2000).map(|k| (DVec3::splat(f64::from(k) * 1e-4), DVec3::splat(39.0)));
        let bounds: Vec<_> = small
            .chain(large)
            .map(|(low, size)| (low, low + size))
            .collect();
        let grid = BlockGrid::new(&bounds, 1e-4);
        assert!(grid.blocks.len() <= ENTRIES_PER_BLOCK * bounds.len());
        assert!(grid.near(bounds[9].0).contains(&BlockIndex::new(9)));
    }

    #[test]
    fn cells_hold_few_blocks_however_many_there_are() {
        let flat = (0..10_000).map(|k| DVec3::new(f64::from(k % 100), 0.0, f64::from(k / 100)));
        let bounds: Vec<_> = flat.map(|low| (low, low + DVec3::ONE)).collect();
        let grid = BlockGrid::new(&bounds, 1e-4);
        let most = grid.first.windows(2).map(|w| w[1] - w[0]).max();
        assert!(most <= Some(9), "{most:?}");
        assert!(grid.first.len() <= 2 * bounds.len() + 2);
    }
}
