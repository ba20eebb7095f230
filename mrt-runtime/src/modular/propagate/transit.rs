//! Light that passes through a warped block on its way. Operators of paths are made of unit cubes; a factor corrects
//! how much of the light that entered by one opening leaves through the next.
//!
//! For even light, the factor is exact. The distribution of light over the next opening stays that of the cube.

use crate::level::placed::PlacedBlock;
use crate::level::shape::Aperture;
use crate::modular::dictionary::{Dictionary, ShapeOperators};
use crate::modular::scene::SceneData;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
use mrt_core::geometry::hexahedron::Hexahedron;

/// Factors by the face that light enters by, then the face that it leaves by.
type Factors = [[f32; 6]; 6];

/// By shape of a scene: factors of blocks whose operators were made for their warp. Blocks with canonical operators
/// count as cubes.
pub(crate) struct Transits(Vec<Option<Factors>>);

impl Transits {
    pub(super) fn new<M>(
        scene: &SceneData,
        dictionary: &Dictionary<M>,
        used_shapes: &[&ShapeOperators<M>],
    ) -> Self {
        let is_canonical = |entry: &&ShapeOperators<M>| {
            let mut shapes = dictionary.shapes.iter();
            shapes.any(|shape| std::ptr::eq(shape, *entry))
        };
        let factors = used_shapes.iter().enumerate().map(|(index, entry)| {
            let block = scene.blocks.iter().position(|b| b.shape_index == index);
            let block = block.filter(|_| !is_canonical(entry));
            block.map(|block| factors(&scene.level.blocks[block]))
        });
        Self(factors.collect())
    }

    /// Factor of light that enters a block of a shape by one face and leaves by another.
    pub(super) fn factor(&self, shape_index: usize, entered: Face, left: Face) -> f32 {
        self.0[shape_index]
            .as_ref()
            .map_or(1.0, |factors| factors[entered.index()][left.index()])
    }
}

fn factors(block: &PlacedBlock) -> Factors {
    let cube = Hexahedron::cell(DVec3::ZERO);
    let mut factors = [[1.0; 6]; 6];
    for entered in block.shape.openings {
        for left in block.shape.openings {
            if entered.face != left.face {
                let there = form_factor(&cube, left, entered);
                let here = form_factor(&block.warp, left, entered);
                factors[entered.face.index()][left.face.index()] = (here / there) as f32;
            }
        }
    }
    factors
}

/// Number of points along each axis of an opening at which form factors are averaged. With 24 instead, the factors of
/// boxes up to 1:4 change by less than 0.1 %.
const POINTS: usize = 12;

/// Mean form factor from one opening of a warped cube to another.
fn form_factor(warp: &Hexahedron, from: &Aperture, to: &Aperture) -> f64 {
    let target: Vec<DVec3> = to.corners().iter().map(|&unit| warp.point(unit)).collect();
    let corners = from.corners();
    let (along_u, along_v) = (corners[1] - corners[0], corners[3] - corners[0]);
    let (u_axis, v_axis) = (from.face.u_axis(), from.face.v_axis());
    let (mut sum, mut weights) = (0.0, 0.0);
    let mut scratch = Vec::new();
    for k in 0..POINTS * POINTS {
        let at = |k: usize| (k as f64 + 0.5) / POINTS as f64;
        let unit = corners[0] + along_u * at(k % POINTS) + along_v * at(k / POINTS);
        let jacobian = warp.jacobian(unit);
        let area = jacobian.col(u_axis).cross(jacobian.col(v_axis)).length();
        let point = warp.point(unit);
        let normal = warp.face_normal(from.face, unit[u_axis], unit[v_axis]);
        let mut polygon = target.clone();
        clip_polygon(
            &mut polygon,
            &HalfSpace::through(point, normal),
            &mut scratch,
        );
        sum += area * point_to_polygon(point, normal, &polygon);
        weights += area;
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::shape::Shape;

    #[test]
    fn form_factors_of_boxes_are_those_of_the_textbook() {
        let cross = Shape::from_name("cross").expect("a shape");
        let opening = |face: Face| cross.opening(face).expect("a cross has four");
        // Howell's catalogue: opposite squares at their own distance, at twice it, and squares side by side.
        for (length, expected) in [(1.0, 0.1998), (2.0, 0.0686)] {
            let warp = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(length, 1.0, 1.0));
            let found = form_factor(&warp, opening(Face::NegX), opening(Face::PosX));
            // The midpoint rule of 12² points adds 2.3e-4 to the cube's.
            assert!((found - expected).abs() < 3e-4, "{length}: {found}");
        }
        let cube = Hexahedron::cell(DVec3::ZERO);
        let found = form_factor(&cube, opening(Face::NegX), opening(Face::PosZ));
        // Midpoints next to the common edge miss a little.
        assert!((found - 0.2000).abs() < 1e-3, "{found}");
    }
}
