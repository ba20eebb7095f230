//! Levels of unit cells, named by their smallest corners: neighbours, distances, and the cell of a
//! point.

use crate::geometry::cube::Face;
use glam::DVec3;
use std::collections::VecDeque;

/// Number of openings between the cell at index `start` and every cell, breadth first through shared
/// faces; `u32::MAX` for cells that cannot be reached.
pub fn cell_hops(cells: &[[i32; 3]], start: usize) -> Vec<u32> {
    let mut hops = vec![u32::MAX; cells.len()];
    let mut queue = VecDeque::new();
    if let Some(hop) = hops.get_mut(start) {
        *hop = 0;
        queue.push_back(start);
    }
    while let Some(from) = queue.pop_front() {
        for face in Face::ALL {
            let across = neighbour_cell(cells[from], face);
            let found = cells.iter().position(|&cell| Some(cell) == across);
            if let Some(to) = found
                && hops[to] == u32::MAX
            {
                hops[to] = hops[from] + 1;
                queue.push_back(to);
            }
        }
    }
    hops
}

/// The cell across a face; `None` if its coordinate does not fit an `i32`.
pub(crate) fn neighbour_cell(cell: [i32; 3], face: Face) -> Option<[i32; 3]> {
    let mut across = cell;
    let step = if face.is_positive() { 1 } else { -1 };
    across[face.axis()] = across[face.axis()].checked_add(step)?;
    Some(across)
}

/// Index of the first cell that contains a point, its faces included.
pub(crate) fn cell_of(cells: &[[i32; 3]], point: DVec3) -> Option<usize> {
    cells.iter().position(|cell| {
        let low = DVec3::from_array(cell.map(f64::from));
        point.cmpge(low).all() && point.cmple(low + DVec3::ONE).all()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hops_count_openings_along_the_shortest_way() {
        let cells = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [5, 5, 5]];
        assert_eq!(cell_hops(&cells, 0), [0, 1, 2, 1, u32::MAX]);
    }
}
