//! Levels of unit cells, named by their smallest corners: neighbours, distances, and the cell of a
//! point.

use crate::geometry::cube::Face;
use glam::DVec3;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};

/// Finds cells in constant time.
#[derive(Clone, Debug)]
pub struct CellIndex {
    /// Position in the list of cells.
    positions: HashMap<[i32; 3], usize>,
}

impl CellIndex {
    /// An index of a list of cells, and the position of the first that is listed before.
    pub fn new(cells: &[[i32; 3]]) -> (Self, Option<usize>) {
        let mut positions = HashMap::with_capacity(cells.len());
        let mut twice = None;
        for (position, &cell) in cells.iter().enumerate() {
            match positions.entry(cell) {
                Entry::Vacant(entry) => {
                    entry.insert(position);
                }
                Entry::Occupied(_) => {
                    twice.get_or_insert(position);
                }
            }
        }
        (Self { positions }, twice)
    }

    /// The position of a cell in the list.
    pub fn position(&self, cell: [i32; 3]) -> Option<usize> {
        self.positions.get(&cell).copied()
    }

    /// The position of the cell across a face; `None` if there is none.
    pub fn across(&self, cell: [i32; 3], face: Face) -> Option<usize> {
        self.position(neighbour_cell(cell, face)?)
    }

    /// The position of the first cell of the list that contains a point, its faces included.
    pub fn of_point(&self, point: DVec3) -> Option<usize> {
        // A point on a face is in the cells on both sides, so there are up to two along each axis. Numbers that are not
        // finite or too large are moved to the ends of the range, where the comparison below refuses them.
        let (high, low) = (point.floor().as_ivec3(), (point.ceil() - 1.0).as_ivec3());
        let mut first: Option<usize> = None;
        for x in [low.x, high.x] {
            for y in [low.y, high.y] {
                for z in [low.z, high.z] {
                    let found = self.position([x, y, z]).filter(|_| {
                        let corner = DVec3::from_array([x, y, z].map(f64::from));
                        point.cmpge(corner).all() && point.cmple(corner + DVec3::ONE).all()
                    });
                    first = match (first, found) {
                        (Some(a), Some(b)) => Some(a.min(b)),
                        (a, b) => a.or(b),
                    };
                }
            }
        }
        first
    }
}

/// Number of openings between the cell at index `start` and every cell, breadth first through shared
/// faces; `u32::MAX` for cells that cannot be reached. Of a cell that is listed twice, only the first counts.
pub fn cell_hops(cells: &[[i32; 3]], start: usize) -> Vec<u32> {
    let (index, _) = CellIndex::new(cells);
    let mut hops = vec![u32::MAX; cells.len()];
    let mut queue = VecDeque::new();
    if let Some(hop) = hops.get_mut(start) {
        *hop = 0;
        queue.push_back(start);
    }
    while let Some(from) = queue.pop_front() {
        for face in Face::ALL {
            if let Some(to) = index.across(cells[from], face)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hops_count_openings_along_the_shortest_way() {
        let cells = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [5, 5, 5]];
        assert_eq!(cell_hops(&cells, 0), [0, 1, 2, 1, u32::MAX]);
    }

    #[test]
    fn a_point_is_in_the_first_cell_that_contains_it() {
        let cells = [
            [1, 0, 0],
            [0, 0, 0],
            [-1, 0, 0],
            [0, 1, 0],
            [i32::MAX, 0, 0],
        ];
        let (index, twice) = CellIndex::new(&cells);
        assert_eq!(twice, None);
        let by_search = |point: DVec3| {
            cells.iter().position(|cell| {
                let low = DVec3::from_array(cell.map(f64::from));
                point.cmpge(low).all() && point.cmple(low + DVec3::ONE).all()
            })
        };
        let numbers = [-1.5, -1.0, -0.5, -0.0, 0.0, 0.3, 1.0, 1.7, 2.0, 2.5];
        let others = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            2_147_483_647.5,
            1e300,
        ];
        let numbers = || numbers.into_iter().chain(others);
        for x in numbers() {
            for y in numbers() {
                for z in [0.0, 0.5, 1.0, 1.5, f64::NAN] {
                    let point = DVec3::new(x, y, z);
                    assert_eq!(index.of_point(point), by_search(point), "{point}");
                }
            }
        }
        assert_eq!(CellIndex::new(&[[0; 3], [1; 3], [0; 3], [1; 3]]).1, Some(2));
    }
}
