//! Relative errors of a level's irradiance, over the whole level and by distance from the light.

use std::collections::VecDeque;

use crate::geometry::cube::Face;

/// Distances that errors are reported for: 0, 1, 2, and 3 or more openings.
pub const HOP_GROUPS: usize = 4;

/// Relative L2 error |approximation - reference| / |reference| over all elements; 0 for two zero
/// vectors, infinite if only the reference is zero.
///
/// # Panics
/// If the lengths differ.
pub fn rel_l2(approximation: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(approximation.len(), reference.len(), "vector lengths");
    ratio(squares(approximation, reference))
}

/// [`rel_l2`] over the walls at 0, 1, 2, and 3 or more openings from the light; `None` where the
/// level has no such wall.
///
/// `wall_hops` holds one distance a wall; both vectors hold the same number of elements for each
/// wall, wall by wall. Walls that no opening leads to (`u32::MAX`) belong to no group.
///
/// # Panics
/// If the lengths differ or are no multiple of the number of walls.
pub fn rel_l2_by_hop(
    approximation: &[f64],
    reference: &[f64],
    wall_hops: &[u32],
) -> [Option<f64>; HOP_GROUPS] {
    assert_eq!(approximation.len(), reference.len(), "vector lengths");
    let per_wall = reference.len() / wall_hops.len().max(1);
    assert_eq!(
        per_wall * wall_hops.len(),
        reference.len(),
        "whole number of elements a wall"
    );
    let mut sums: [Option<(f64, f64)>; HOP_GROUPS] = [None; HOP_GROUPS];
    for (wall, &hop) in wall_hops.iter().enumerate() {
        if hop == u32::MAX {
            continue;
        }
        let range = wall * per_wall..(wall + 1) * per_wall;
        let (miss, size) = squares(&approximation[range.clone()], &reference[range]);
        let sum = sums[(hop as usize).min(HOP_GROUPS - 1)].get_or_insert((0.0, 0.0));
        sum.0 += miss;
        sum.1 += size;
    }
    sums.map(|sum| sum.map(ratio))
}

/// Openings between the cell at `start` and every cell, breadth first through shared faces;
/// `u32::MAX` where no way leads.
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

/// The cell across a face; `None` at the end of the number range.
pub(crate) fn neighbour_cell(cell: [i32; 3], face: Face) -> Option<[i32; 3]> {
    let mut across = cell;
    let step = if face.is_positive() { 1 } else { -1 };
    across[face.axis()] = across[face.axis()].checked_add(step)?;
    Some(across)
}

fn squares(approximation: &[f64], reference: &[f64]) -> (f64, f64) {
    let pairs = approximation.iter().zip(reference);
    pairs.fold((0.0, 0.0), |(miss, size), (a, r)| {
        (miss + (a - r) * (a - r), size + r * r)
    })
}

fn ratio((miss, size): (f64, f64)) -> f64 {
    if miss == 0.0 {
        0.0
    } else {
        (miss / size).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_to_the_reference() {
        assert_eq!(rel_l2(&[3.0, 4.0], &[3.0, 0.0]), 4.0 / 3.0);
        assert_eq!(rel_l2(&[0.0], &[0.0]), 0.0);
        assert_eq!(rel_l2(&[1.0], &[0.0]), f64::INFINITY);
    }

    #[test]
    fn hops_group_walls_and_leave_empty_groups_out() {
        let errors = rel_l2_by_hop(&[2.0, 1.0, 3.0], &[1.0, 1.0, 1.0], &[0, 1, 7]);
        assert_eq!(errors, [Some(1.0), Some(0.0), None, Some(2.0)]);
    }

    #[test]
    fn hops_count_openings_along_the_shortest_way() {
        let cells = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [5, 5, 5]];
        assert_eq!(cell_hops(&cells, 0), [0, 1, 2, 1, u32::MAX]);
    }
}
