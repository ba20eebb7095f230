//! A coarse grid over the level; each cell lists the blocks that matter to points in it, nearest first.

use glam::DVec3;

/// Cells along each axis.
const CELLS: usize = 24;

/// Boxes by place.
#[derive(Clone, Debug)]
pub(super) struct Lookup {
    min: DVec3,
    edge: DVec3,
    candidates: Vec<Vec<u32>>,
}

impl Lookup {
    /// Sorts boxes, given by their smallest and largest corners, into the grid. A cell gets every box that can be nearest
    /// to a point in it, or at most `margin` metres further than the nearest.
    pub fn new(boxes: &[(DVec3, DVec3)], margin: f64) -> Self {
        let min = boxes.iter().map(|b| b.0).fold(DVec3::MAX, DVec3::min);
        let max = boxes.iter().map(|b| b.1).fold(DVec3::MIN, DVec3::max);
        // Meshes reach beyond the blocks. Points beyond the grid use its outermost cells.
        let around = (max - min) * 0.1;
        let (min, max) = (min - around, max + around);
        let edge = (max - min) / CELLS as f64;
        let half = edge / 2.0;
        let mut candidates = Vec::with_capacity(CELLS.pow(3));
        for z in 0..CELLS {
            for y in 0..CELLS {
                for x in 0..CELLS {
                    let center = min + (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * edge;
                    let nearest = boxes
                        .iter()
                        .map(|&bounds| box_distance(center, bounds))
                        .fold(f64::MAX, f64::min);
                    // The nearest box may hold a slanted block whose wall is further away.
                    let reach = nearest + 2.0 * half.length() + margin;
                    let mut near: Vec<(f64, u32)> = boxes
                        .iter()
                        .enumerate()
                        .filter(|&(_, &(low, high))| {
                            box_distance(center, (low - half, high + half)) <= reach
                        })
                        .map(|(index, &bounds)| (box_distance(center, bounds), index as u32))
                        .collect();
                    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    candidates.push(near.into_iter().map(|(_, index)| index).collect());
                }
            }
        }
        Self {
            min,
            edge,
            candidates,
        }
    }

    /// Boxes that can be nearest to a point, or nearly so.
    pub fn candidates(&self, point: DVec3) -> &[u32] {
        let cell = ((point - self.min) / self.edge)
            .clamp(DVec3::ZERO, DVec3::splat(CELLS as f64 - 1.0))
            .as_usizevec3();
        self.candidates
            .get((cell.z * CELLS + cell.y) * CELLS + cell.x)
            .map_or(&[], Vec::as_slice)
    }
}

/// Distance from a point to a box, zero inside.
pub(super) fn box_distance(point: DVec3, (min, max): (DVec3, DVec3)) -> f64 {
    point.distance(point.clamp(min, max))
}
