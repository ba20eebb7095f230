//! The symmetries that a warped block still has, acting on its texels.
//!
//! A symmetry of the cube (a signed exchange of axes) is one of the warped block if it keeps all
//! distances between the warped corners. A box keeps the mirrors of all three axes, a parallelepiped the inversion
//! through its centre, a twisted tower half turns, and a general hexahedron nothing.

use crate::modular::surface::walls::warped::WarpedWalls;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::geometry::texel_permutation::texel_permutation;
use mrt_core::linalg::parity::ParityClasses;

/// Fraction of a block's diagonal by which distances may differ and still count as equal. Level files in decimal text
/// round by less, and light shows no difference before far more.
const EQUAL_DISTANCE: f64 = 1e-9;

/// All 48 symmetries of the cube in the order in which they are tried: those that exchange no axes come first, and of
/// these the mirrors of one axis before the half turns and the inversion that they compose.
fn candidates() -> impl Iterator<Item = CubeSymmetry> {
    const EXCHANGES: [[usize; 3]; 6] = [
        [0, 1, 2],
        [2, 1, 0],
        [1, 0, 2],
        [0, 2, 1],
        [1, 2, 0],
        [2, 0, 1],
    ];
    /// Bit k is set where axis k is reversed.
    const REVERSALS: [usize; 8] = [0, 1, 2, 4, 3, 5, 6, 7];
    EXCHANGES.into_iter().flat_map(|axes| {
        REVERSALS.into_iter().filter_map(move |reversed| {
            let image = |axis: usize| Face::from_axis(axes[axis], reversed >> axis & 1 == 0);
            CubeSymmetry::from_images(image(0), image(1), image(2))
        })
    })
}

/// True if the symmetry takes walls to walls and keeps all distances between warped corners.
fn keeps(symmetry: CubeSymmetry, walls: &WarpedWalls) -> bool {
    let corners = &walls.warp.corners;
    let slack = EQUAL_DISTANCE * walls.warp.diagonal();
    let corner_image = |k: usize| {
        let image = symmetry.point(Hexahedron::unit_corner(k));
        let bits = (0..3).map(|axis| usize::from(image[axis] > 0.5) << axis);
        corners[bits.sum::<usize>()]
    };
    let keeps_distance = |a: usize, b: usize| {
        let image = corner_image(a).distance(corner_image(b));
        (corners[a].distance(corners[b]) - image).abs() <= slack
    };
    let faces = &walls.faces;
    faces.iter().all(|&f| faces.contains(&symmetry.face(f)))
        && (0..8).all(|a| (0..a).all(|b| keeps_distance(a, b)))
}

/// Parity classes of the texels under a largest set of symmetries of the warped walls that commute and are their own
/// inverses; a single class where there is none.
pub fn warped_parity_classes(walls: &WarpedWalls) -> ParityClasses {
    let mut generated = vec![CubeSymmetry::IDENTITY];
    let mut generators = Vec::new();
    for symmetry in candidates() {
        let is_new = !generated.contains(&symmetry)
            && symmetry.after(symmetry) == CubeSymmetry::IDENTITY
            && generated
                .iter()
                .all(|&g| symmetry.after(g) == g.after(symmetry));
        if is_new && keeps(symmetry, walls) {
            let composed: Vec<_> = generated.iter().map(|&g| symmetry.after(g)).collect();
            generated.extend(composed);
            generators.push(symmetry);
        }
    }
    let texels: Vec<(Face, DVec3)> = walls.unit_texels().collect();
    let permutations: Vec<Vec<u32>> = generators
        .into_iter()
        .map(|symmetry| texel_permutation(&texels, walls.resolution, symmetry))
        .collect();
    ParityClasses::new(texels.len(), &permutations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::surface::mirrors::cube::texel_parity_classes;
    use mrt_runtime::low_level::level::shape::{Outline, Shape, cubes};

    fn class_count(corner: impl Fn(DVec3) -> DVec3) -> usize {
        let warp = Hexahedron {
            corners: std::array::from_fn(|k| corner(Hexahedron::unit_corner(k))),
        };
        assert_eq!(warp.check(), Ok(()));
        warped_parity_classes(&WarpedWalls::new(&Face::ALL, 4, &warp)).class_count()
    }

    #[test]
    fn boxes_shears_frustums_and_twists_keep_their_symmetries() {
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
    fn unwarped_walls_have_the_classes_of_their_shape() {
        // Warped walls know no holes, which is why shapes with a hole are not rebuilt.
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
