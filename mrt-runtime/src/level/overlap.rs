//! Finds blocks that share a volume, by separating axes over candidate pairs.

use crate::level::block::Level;
use crate::level::box_pairs::for_each_pair;
use crate::level::error::{LevelError, OVERLAP_TOLERANCE};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;

/// Checks that no two blocks of the level enter each other deeper than [`OVERLAP_TOLERANCE`].
///
/// Each block is replaced by the convex hull of its corners, which contains the warped block. Only blocks whose bounds
/// overlap are tested, and the cost of finding those is near-linear.
pub(crate) fn check(level: &Level) -> Result<(), LevelError> {
    let bounds: Vec<_> = level.blocks.iter().map(|b| b.warp.bounds()).collect();
    let mut tests = 0;
    for_each_pair(&bounds, |a, b| {
        tests += 1;
        if tests > MAX_TESTS_PER_BLOCK * bounds.len() {
            return Err(LevelError::TooCrowded {
                expected: MAX_TESTS_PER_BLOCK,
            });
        }
        check_pair(level, a, b)
    })?;
    Ok(())
}

fn check_pair(level: &Level, a: usize, b: usize) -> Result<(), LevelError> {
    let (warp_a, warp_b) = (&level.blocks[a].warp, &level.blocks[b].warp);
    // The hull of a bent block reaches beyond the block by no more than its faces are bent.
    let expected =
        OVERLAP_TOLERANCE * warp_a.diagonal().min(warp_b.diagonal()) + bend(warp_a) + bend(warp_b);
    let found = penetration(warp_a, warp_b, expected);
    if found > expected {
        return Err(LevelError::Overlap {
            a: a.min(b),
            b: a.max(b),
            expected,
            found,
        });
    }
    Ok(())
}

/// Most pairs of blocks with overlapping bounds that are tested, for each block of the level. Blocks of real levels
/// have a dozen neighbours.
pub(crate) const MAX_TESTS_PER_BLOCK: usize = 256;

/// How far the faces of a block are from planar, metres: the largest distance between the two diagonals of a face.
fn bend(block: &Hexahedron) -> f64 {
    Face::ALL
        .into_iter()
        .map(|face| {
            let [a, b, c, d] = block.face_corners(face);
            let normal = (c - a).cross(d - b);
            normal
                .try_normalize()
                .map_or(0.0, |normal| normal.dot(b - a).abs())
        })
        .fold(0.0, f64::max)
}

/// Depth, metres, by which two hulls enter each other: the smallest overlap of their shadows over all candidate axes,
/// negative when an axis separates them. The search ends at the first overlap of at most `enough`.
fn penetration(a: &Hexahedron, b: &Hexahedron, enough: f64) -> f64 {
    let (edges_a, edges_b) = (edges(a), edges(b));
    let normals = [a, b].into_iter().flat_map(|block| {
        Face::ALL
            .into_iter()
            .flat_map(move |face| triangle_normals(&block.face_corners(face)))
    });
    let crossed = edges_a
        .iter()
        .flat_map(|&x| edges_b.iter().map(move |&y| x.cross(y)));
    let mut smallest = f64::MAX;
    for axis in normals.chain(crossed).filter_map(DVec3::try_normalize) {
        smallest = smallest.min(shadow_overlap(a, b, axis));
        if smallest <= enough {
            break;
        }
    }
    smallest
}

/// Overlap, metres, of the projections of two hulls on a unit axis.
fn shadow_overlap(a: &Hexahedron, b: &Hexahedron, axis: DVec3) -> f64 {
    let shadow = |block: &Hexahedron| {
        block
            .corners
            .iter()
            .map(|corner| corner.dot(axis))
            .fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)))
    };
    let ((a_min, a_max), (b_min, b_max)) = (shadow(a), shadow(b));
    (a_max - b_min).min(b_max - a_min)
}

/// Normals, not of unit length, of the triangles that a face may have in the hull: where it is bent, either diagonal
/// may be a ridge.
fn triangle_normals(quad: &[DVec3; 4]) -> [DVec3; 4] {
    std::array::from_fn(|k| {
        let [p, q, r] = [quad[k], quad[(k + 1) % 4], quad[(k + 2) % 4]];
        (q - p).cross(r - p)
    })
}

/// Directions of all possible edges of the hull: the edges of the cube, and both diagonals of each face, since a bent
/// face may have a ridge along either.
fn edges(block: &Hexahedron) -> Vec<DVec3> {
    let mut edges = Vec::with_capacity(24);
    for k in 0..8usize {
        for axis in (0..3).filter(|axis| k >> axis & 1 == 0) {
            edges.push(block.corners[k | 1 << axis] - block.corners[k]);
        }
    }
    for face in Face::ALL {
        let [a, b, c, d] = block.face_corners(face);
        edges.extend([c - a, d - b]);
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_cells_do_not_overlap_and_shifted_ones_do() {
        let a = Hexahedron::cell(DVec3::ZERO);
        assert!(penetration(&a, &Hexahedron::cell(DVec3::X), -1.0).abs() < 1e-12);
        let depth = penetration(&a, &Hexahedron::cell(DVec3::new(0.7, 0.1, 0.0)), -1.0);
        assert!((depth - 0.3).abs() < 1e-12);
        assert!(penetration(&a, &Hexahedron::cell(DVec3::new(3.0, 0.0, 0.0)), -9.0) < 0.0);
    }

    #[test]
    fn joined_blocks_may_share_a_bent_face() {
        use crate::level::block::Level;
        use glam::Vec3;
        let mut level =
            Level::from_cells(&[[0, 0, 0], [1, 0, 0]], Vec3::ONE).expect("two flat cells");
        for bent in [0.02, 0.1, 0.2] {
            let corner = DVec3::new(1.0 + bent, 1.0, 1.0);
            level.blocks[0].warp.corners[7] = corner;
            level.blocks[1].warp.corners[6] = corner;
            assert_eq!(level.check(), Ok(()), "bent by {bent}");
        }
    }
}
