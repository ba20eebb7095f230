//! What free space is cut into: cells between grid lines, one for each storey, and the sides that they share.

use std::ops::Range;

/// Positions of grid lines, as voxel boundaries along x and z, ascending; the first and the last bound the level.
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
    /// Share of each side (-x, +x, -z, +z) through which free space ends without a surface: the level is open there, as at
    /// a window or the missing front of a stage.
    pub outside: [f64; 4],
}

/// The common side of two cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedSide {
    /// Cell on the side of smaller coordinates.
    pub low: usize,
    /// Cell on the side of larger coordinates.
    pub high: usize,
    /// 0 when the side is perpendicular to x, 1 when to z.
    pub axis: usize,
    /// Share of the smaller cell's side that nothing blocks.
    pub openness: f64,
    /// Area of the smaller cell's side, voxel sides.
    pub area: f64,
    /// Height that both cells have at the side over the height from the lower floor to the higher ceiling: 1 if the sides
    /// are equal.
    pub overlap: f64,
}

/// Cells and the sides they share.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Sorted by column and height.
    pub cells: Vec<Cell>,
    /// At most one for each side of a cell: the one with the widest opening.
    pub sides: Vec<SharedSide>,
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
    /// Mean floor and ceiling at the side across `axis` (0: x, 1: z) at the larger or smaller coordinate, metres.
    pub fn side_range(&self, axis: usize, positive: bool) -> [f64; 2] {
        let corners = side_corners(axis, positive);
        [&self.floor, &self.ceiling]
            .map(|heights| corners.map(|k| heights[k]).iter().sum::<f64>() / 2.0)
    }

    /// Mean height of that side, metres.
    pub fn side_height(&self, axis: usize, positive: bool) -> f64 {
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
