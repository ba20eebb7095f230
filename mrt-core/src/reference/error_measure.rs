//! Relative errors of a level's irradiance, over the whole level and by distance from the light.

/// Number of distances that errors are reported for: 0, 1, 2, and 3 or more openings.
pub const HOP_GROUPS: usize = 4;

/// Relative L2 error |approximation - reference| / |reference| over all elements.
///
/// It is 0 if both vectors are zero, and infinite if only the reference is.
///
/// # Panics
/// If the lengths differ.
pub fn rel_l2(approximation: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(approximation.len(), reference.len(), "vector lengths");
    SquareSums::new(approximation, reference).relative_error()
}

/// [`rel_l2`] over the walls at 0, 1, 2, and 3 or more openings from the light; `None` for a distance
/// at which the level has no wall.
///
/// `wall_hops` holds one distance for each wall. Both vectors hold the same number of elements for each wall,
/// wall by wall. Walls that cannot be reached (`u32::MAX`) belong to no group.
///
/// # Panics
/// If the lengths differ or are not a multiple of the number of walls.
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
    let mut sums: [Option<SquareSums>; HOP_GROUPS] = [None; HOP_GROUPS];
    for (wall, &hop) in wall_hops.iter().enumerate() {
        if hop == u32::MAX {
            continue;
        }
        let range = wall * per_wall..(wall + 1) * per_wall;
        let of_wall = SquareSums::new(&approximation[range.clone()], &reference[range]);
        let sum = sums[(hop as usize).min(HOP_GROUPS - 1)].get_or_insert_default();
        sum.difference += of_wall.difference;
        sum.reference += of_wall.reference;
    }
    sums.map(|sum| sum.map(SquareSums::relative_error))
}

/// Sums of squares of the difference and of the reference.
#[derive(Clone, Copy, Default)]
struct SquareSums {
    difference: f64,
    reference: f64,
}

impl SquareSums {
    fn new(approximation: &[f64], reference: &[f64]) -> Self {
        let mut sums = Self::default();
        for (a, r) in approximation.iter().zip(reference) {
            sums.difference += (a - r) * (a - r);
            sums.reference += r * r;
        }
        sums
    }

    fn relative_error(self) -> f64 {
        if self.difference == 0.0 {
            0.0
        } else {
            (self.difference / self.reference).sqrt()
        }
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
    fn walls_are_grouped_by_distance_and_empty_groups_are_left_out() {
        let errors = rel_l2_by_hop(&[2.0, 1.0, 3.0], &[1.0, 1.0, 1.0], &[0, 1, 7]);
        assert_eq!(errors, [Some(1.0), Some(0.0), None, Some(2.0)]);
    }
}
