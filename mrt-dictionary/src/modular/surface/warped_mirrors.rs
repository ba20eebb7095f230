//! The symmetries that a warped block still has, acting on its texels.
//!
//! A symmetry of the cube (a signed exchange of axes) is one of the warped block if it keeps all
//! distances between the warped corners. Those that are their own inverse and commute split signals into
//! parity classes, as [`crate::modular::surface::mirrors`] does for canonical shapes: a box keeps the mirrors of all three
//! axes, a parallelepiped the inversion through its centre, a twisted tower half turns, and a general
//! hexahedron nothing.

use crate::modular::one_bounce::warped::WarpedWalls;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::linalg::parity::ParityClasses;
use std::collections::HashMap;

/// Fraction of a block's diagonal by which distances may differ and still be called equal: rounding of
/// level files in decimal text, and far below what light would show.
const EQUAL_DISTANCE: f64 = 1e-9;

/// Takes axis k to `axes[k]`, reversed where `reversed[k]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CubeSymmetry {
    axes: [usize; 3],
    reversed: [bool; 3],
}

impl CubeSymmetry {
    const IDENTITY: Self = Self {
        axes: [0, 1, 2],
        reversed: [false; 3],
    };

    /// All 48, those that exchange no axes first.
    fn all() -> impl Iterator<Item = Self> {
        const EXCHANGES: [[usize; 3]; 6] = [
            [0, 1, 2],
            [2, 1, 0],
            [1, 0, 2],
            [0, 2, 1],
            [1, 2, 0],
            [2, 0, 1],
        ];
        // Mirrors of one axis come before the half turns and the inversion that they compose.
        const REVERSALS: [usize; 8] = [0, 1, 2, 4, 3, 5, 6, 7];
        EXCHANGES.into_iter().flat_map(|axes| {
            REVERSALS.into_iter().map(move |bits| Self {
                axes,
                reversed: [0, 1, 2].map(|axis| bits >> axis & 1 == 1),
            })
        })
    }

    fn then(self, next: Self) -> Self {
        Self {
            axes: self.axes.map(|axis| next.axes[axis]),
            reversed: [0, 1, 2].map(|k| self.reversed[k] ^ next.reversed[self.axes[k]]),
        }
    }

    fn point(self, point: DVec3) -> DVec3 {
        let mut image = DVec3::ZERO;
        for k in 0..3 {
            image[self.axes[k]] = if self.reversed[k] {
                1.0 - point[k]
            } else {
                point[k]
            };
        }
        image
    }

    fn face(self, face: Face) -> Face {
        let axis = face.axis();
        Face::from_axis(self.axes[axis], face.is_positive() != self.reversed[axis])
    }

    fn corner(self, k: usize) -> usize {
        let image = self.point(Hexahedron::unit_corner(k));
        (0..3)
            .map(|axis| usize::from(image[axis] > 0.5) << axis)
            .sum()
    }

    fn keeps(self, walls: &WarpedWalls) -> bool {
        let corners = &walls.warp.corners;
        let slack = EQUAL_DISTANCE * walls.warp.diagonal();
        let keeps_distance = |a: usize, b: usize| {
            let image = corners[self.corner(a)].distance(corners[self.corner(b)]);
            (corners[a].distance(corners[b]) - image).abs() <= slack
        };
        walls
            .faces
            .iter()
            .all(|&f| walls.faces.contains(&self.face(f)))
            && (0..8).all(|a| (0..a).all(|b| keeps_distance(a, b)))
    }
}

/// Parity classes of the texels under a largest set of commuting symmetries of the warped walls that are
/// their own inverses; a single class where there is none.
pub fn warped_parity_classes(walls: &WarpedWalls) -> ParityClasses {
    let mut generated = vec![CubeSymmetry::IDENTITY];
    let mut generators = Vec::new();
    for symmetry in CubeSymmetry::all() {
        let is_new = !generated.contains(&symmetry)
            && symmetry.then(symmetry) == CubeSymmetry::IDENTITY
            && generated
                .iter()
                .all(|&g| g.then(symmetry) == symmetry.then(g));
        if is_new && symmetry.keeps(walls) {
            let composed: Vec<_> = generated.iter().map(|g| g.then(symmetry)).collect();
            generated.extend(composed);
            generators.push(symmetry);
        }
    }
    // Texel centres are odd multiples of half a texel: exact as integers.
    let key = |face: Face, p: DVec3| {
        let scaled = p * (2 * walls.resolution) as f64;
        (face, scaled.round().as_ivec3().to_array())
    };
    let texels: Vec<(Face, DVec3)> = walls.unit_texels().collect();
    let index: HashMap<_, u32> = texels
        .iter()
        .enumerate()
        .map(|(k, &(face, p))| (key(face, p), k as u32))
        .collect();
    let permutations: Vec<Vec<u32>> = generators
        .into_iter()
        .map(|symmetry| {
            texels
                .iter()
                .map(|&(face, p)| index[&key(symmetry.face(face), symmetry.point(p))])
                .collect()
        })
        .collect();
    ParityClasses::new(texels.len(), &permutations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::surface::mirrors::texel_parity_classes;
    use mrt_runtime::low_level::level::shape::{Outline, Shape, cubes};

    fn class_count(corner: impl Fn(DVec3) -> DVec3) -> usize {
        let warp = Hexahedron {
            corners: std::array::from_fn(|k| corner(Hexahedron::unit_corner(k))),
        };
        assert_eq!(warp.check(), Ok(()));
        warped_parity_classes(&WarpedWalls::new(&Face::ALL, 4, &warp)).class_count()
    }

    #[test]
    fn warps_keep_the_symmetries_that_one_expects() {
        assert_eq!(class_count(|p| p * DVec3::new(1.0, 2.0, 3.0)), 8);
        // A shear keeps the inversion, and here the mirror across the plane that it acts in.
        assert_eq!(class_count(|p| p + DVec3::X * (0.5 * p.y)), 4);
        assert_eq!(
            class_count(|p| p + DVec3::new(0.5 * p.y + 0.1 * p.z, 0.2 * p.z, 0.0)),
            2
        );
        // A frustum keeps the mirrors beside its axis, a twist half turns about three axes.
        let centered = |p: DVec3| p - DVec3::new(0.5, 0.0, 0.5);
        assert_eq!(
            class_count(|p| centered(p) * DVec3::new(1.0 - 0.4 * p.y, 1.0, 1.0 - 0.4 * p.y)),
            4
        );
        let twisted = |p: DVec3| glam::DQuat::from_rotation_y(0.5 * p.y) * centered(p);
        assert_eq!(class_count(twisted), 4);
        assert_eq!(
            class_count(|p| p + DVec3::new(0.1, 0.2, 0.3) * (p.x * p.y * p.z)),
            1
        );
        // One corner pulled along its diagonal.
        assert_eq!(
            class_count(|p| p + DVec3::splat(0.3) * (p.x * p.y * p.z)),
            2
        );
    }

    #[test]
    fn unwarped_shapes_have_the_classes_of_the_dictionary() {
        // Walls do not know of holes, which is why shapes with one are not rebuilt.
        let has_hole = |shape: &&Shape| shape.openings.iter().any(|o| o.outline != Outline::Whole);
        for shape in cubes().filter(|shape| !has_hole(shape) && shape.wall_count() > 0) {
            let faces: Vec<Face> = shape.walls().collect();
            let walls = WarpedWalls::new(&faces, 4, &Hexahedron::cell(DVec3::ZERO));
            assert_eq!(
                warped_parity_classes(&walls).class_count(),
                texel_parity_classes(shape, 4).class_count()
            );
        }
    }
}
