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
    let slack: Vec<Slack> = level.blocks.iter().map(|b| Slack::of(&b.warp)).collect();
    let mut work = 0;
    for_each_pair(&bounds, |a, b| {
        let (warp_a, warp_b) = (&level.blocks[a].warp, &level.blocks[b].warp);
        let expected = slack[a].with(slack[b]);
        let (found, axes) = penetration(warp_a, warp_b, expected);
        work += WORK_OF_PAIR + axes;
        if found > expected {
            return Err(LevelError::Overlap {
                a: a.min(b),
                b: a.max(b),
                expected,
                found,
            });
        }
        if work > MAX_WORK_PER_BLOCK * bounds.len() {
            return Err(LevelError::TooCrowded {
                expected: MAX_WORK_PER_BLOCK,
            });
        }
        Ok(())
    })?;
    Ok(())
}

/// Most axes on which shadows are compared, for each block of the level. Blocks of real levels have a dozen neighbours
/// whose bounds overlap theirs, and most pairs are told apart by one of the first axes.
pub(crate) const MAX_WORK_PER_BLOCK: usize = 4096;

/// What else a pair takes, in axes.
const WORK_OF_PAIR: usize = 16;

/// What decides how deep a block may enter others, metres.
#[derive(Clone, Copy)]
struct Slack {
    diagonal: f64,
    bend: f64,
}

impl Slack {
    fn of(block: &Hexahedron) -> Self {
        Self {
            diagonal: block.diagonal(),
            bend: bend(block),
        }
    }

    /// How deep two blocks may enter each other. The hull of a bent block reaches beyond the block by no more than its
    /// faces are bent.
    fn with(self, other: Self) -> f64 {
        OVERLAP_TOLERANCE * self.diagonal.min(other.diagonal) + self.bend + other.bend
    }
}

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

/// Depth, metres, by which two hulls enter each other, and the number of axes looked at: the smallest overlap of their
/// shadows over all candidate axes, negative when an axis separates them. The search ends at the first overlap of at most
/// `enough`.
fn penetration(a: &Hexahedron, b: &Hexahedron, enough: f64) -> (f64, usize) {
    let mut smallest = f64::MAX;
    let mut axes = 0;
    // True once an axis is found that ends the search.
    let mut try_axis = |axis: DVec3| {
        axes += 1;
        if let Some(axis) = axis.try_normalize() {
            smallest = smallest.min(shadow_overlap(a, b, axis));
        }
        smallest <= enough
    };
    let is_found = [a, b].into_iter().any(|block| {
        let mut faces = Face::ALL.into_iter();
        faces.any(|face| {
            let mut normals = triangle_normals(&block.face_corners(face)).into_iter();
            normals.any(&mut try_axis)
        })
    });
    if !is_found {
        let edges_b = edges(b);
        let mut edges_a = edges(a).into_iter();
        edges_a.any(|x| edges_b.iter().any(|&y| try_axis(x.cross(y))));
    }
    (smallest, axes)
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
        assert!(penetration(&a, &Hexahedron::cell(DVec3::X), -1.0).0.abs() < 1e-12);
        let (depth, _) = penetration(&a, &Hexahedron::cell(DVec3::new(0.7, 0.1, 0.0)), -1.0);
        assert!((depth - 0.3).abs() < 1e-12);
        assert!(penetration(&a, &Hexahedron::cell(DVec3::new(3.0, 0.0, 0.0)), -9.0).0 < 0.0);
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

    #[test]
    fn crowded_levels_are_refused_before_they_take_long() {
        use crate::level::block::Level;
        use glam::Vec3;
        // Thin slabs, one behind the other along the diagonal of their bounds, which all overlap.
        let slab = |k: u32| {
            let across = DVec3::new(1.0, -1.0, 0.0);
            let low = 0.01 * f64::from(k) * across;
            let corner = |i: usize| {
                let along = DVec3::new(3.0, 3.0, 0.0) * (i & 1) as f64;
                low + along
                    + 0.004 * across * (1 - (i >> 1 & 1)) as f64
                    + 3.0 * DVec3::Z * (i >> 2) as f64
            };
            Hexahedron {
                corners: std::array::from_fn(corner),
            }
        };
        let mut level = Level::from_cells(&[[0, 0, 0]], Vec3::ONE).expect("a cell");
        let block = level.blocks[0].clone();
        let fill = |level: &mut Level, count: u32| {
            let slabs = (0..count).map(|k| crate::level::block::Block {
                warp: slab(k),
                ..block.clone()
            });
            level.blocks = slabs.collect();
        };
        fill(&mut level, 100);
        assert_eq!(level.check(), Ok(()));
        fill(&mut level, 2000);
        let error = level.check();
        assert!(
            matches!(error, Err(LevelError::TooCrowded { .. })),
            "{error:?}"
        );
    }
}
