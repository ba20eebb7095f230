//! Finds the blocks near a point in constant time: a uniform grid over the bounds of all blocks.

use crate::level::block_index::BlockIndex;
use glam::{DVec3, UVec3};

/// Cells of a grid for each block, at most: few enough that the grid takes less memory than the blocks.
const CELLS_PER_BLOCK: f64 = 2.0;

/// Cells along an axis, at most.
const MAX_CELLS_PER_AXIS: f64 = 1024.0;

/// Blocks whose bounds reach into each cell of a grid.
#[derive(Clone, Debug)]
pub(crate) struct BlockGrid {
    low: DVec3,
    cells_per_metre: DVec3,
    cells: UVec3,
    /// The blocks of cell k, ascending, are `blocks[first[k]..first[k + 1]]`.
    first: Vec<u32>,
    blocks: Vec<BlockIndex>,
}

impl BlockGrid {
    /// A grid over these bounds (smallest, largest), metres, in the order of the blocks. Points that miss bounds by up
    /// to `slack` of their diagonal count as inside.
    pub(crate) fn new(bounds: &[(DVec3, DVec3)], slack: f64) -> Self {
        let widened = |&(low, high): &(DVec3, DVec3)| {
            // Twice, so that the sums below may be rounded.
            let margin = DVec3::splat(2.0 * slack * (high - low).length());
            (low - margin, high + margin)
        };
        let low = bounds.iter().map(|b| widened(b).0);
        let low = low.reduce(DVec3::min).unwrap_or(DVec3::ZERO);
        let high = bounds.iter().map(|b| widened(b).1);
        let high = high.reduce(DVec3::max).unwrap_or(DVec3::ZERO);
        let size = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let cells = cells_along_axes(bounds, size);
        let mut grid = Self {
            low,
            cells_per_metre: cells.as_dvec3() / size,
            cells,
            first: Vec::new(),
            blocks: Vec::new(),
        };
        let mut pairs: Vec<(u32, BlockIndex)> = Vec::new();
        for (index, bounds) in bounds.iter().enumerate() {
            let (low, high) = widened(bounds);
            let (from, to) = (grid.cell_of(low), grid.cell_of(high));
            for z in from.z..=to.z {
                for y in from.y..=to.y {
                    for x in from.x..=to.x {
                        let cell = grid.position(UVec3::new(x, y, z));
                        pairs.push((cell as u32, BlockIndex::new(index)));
                    }
                }
            }
        }
        pairs.sort_unstable();
        let count = cells.element_product() as usize;
        let mut next = 0;
        for cell in 0..=count as u32 {
            next += pairs[next..].partition_point(|pair| pair.0 < cell);
            grid.first.push(next as u32);
        }
        grid.blocks = pairs.into_iter().map(|pair| pair.1).collect();
        grid
    }

    /// Blocks whose widened bounds may contain a point, ascending.
    pub(crate) fn near(&self, point: DVec3) -> &[BlockIndex] {
        let place = (point - self.low) * self.cells_per_metre;
        // NaN is in no range.
        let is_inside = place.cmpge(DVec3::ZERO).all() && place.cmple(self.cells.as_dvec3()).all();
        if !is_inside {
            return &[];
        }
        let cell = self.position(self.cell_of(point));
        &self.blocks[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    /// The cell of a point; of points outside the grid the nearest.
    fn cell_of(&self, point: DVec3) -> UVec3 {
        let place = (point - self.low) * self.cells_per_metre;
        let last = (self.cells - 1).as_dvec3();
        place.floor().clamp(DVec3::ZERO, last).as_uvec3()
    }

    fn position(&self, cell: UVec3) -> usize {
        ((cell.z * self.cells.y + cell.y) * self.cells.x + cell.x) as usize
    }
}

/// Cells about as large as a mean block, and not many more than blocks.
fn cells_along_axes(bounds: &[(DVec3, DVec3)], size: DVec3) -> UVec3 {
    let count = bounds.len().max(1) as f64;
    let sum: DVec3 = bounds.iter().map(|(low, high)| *high - *low).sum();
    let mean = (sum / count).max(DVec3::splat(f64::MIN_POSITIVE));
    let wanted = (size / mean)
        .round()
        .clamp(DVec3::ONE, DVec3::splat(MAX_CELLS_PER_AXIS));
    let excess = wanted.element_product() / (CELLS_PER_BLOCK * count);
    let cells = if excess > 1.0 {
        // Axes of one cell stay; the others share the excess.
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
        // Blocks of many sizes, one of them around the others, and one far away.
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
    fn cells_hold_few_blocks_however_many_there_are() {
        let flat = (0..10_000).map(|k| DVec3::new(f64::from(k % 100), 0.0, f64::from(k / 100)));
        let bounds: Vec<_> = flat.map(|low| (low, low + DVec3::ONE)).collect();
        let grid = BlockGrid::new(&bounds, 1e-4);
        let most = grid.first.windows(2).map(|w| w[1] - w[0]).max();
        assert!(most <= Some(9), "{most:?}");
        assert!(grid.first.len() <= 2 * bounds.len() + 2);
    }
}
