//! The mirrors that leave a canonical shape as it is, acting on its texels.

use glam::DVec3;
use mrt_core::cube::Face;
use mrt_core::parity::ParityClasses;
use mrt_runtime::shape::Shape;
use std::collections::HashMap;

/// A reflection of the unit cube: a signed exchange of axes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mirror {
    /// Reverses one axis.
    Axis(usize),
    /// Exchanges x and z.
    Diagonal,
}

impl Mirror {
    fn point(self, mut point: DVec3) -> DVec3 {
        match self {
            Mirror::Axis(axis) => point[axis] = 1.0 - point[axis],
            Mirror::Diagonal => point = DVec3::new(point.z, point.y, point.x),
        }
        point
    }

    fn face(self, face: Face) -> Face {
        match self {
            Mirror::Axis(axis) if face.axis() == axis => face.opposite(),
            Mirror::Axis(_) => face,
            Mirror::Diagonal => Face::from_axis(2 - face.axis(), face.is_positive()),
        }
    }

    fn keeps(self, shape: &Shape) -> bool {
        shape
            .openings
            .iter()
            .all(|&face| shape.is_open(self.face(face)))
    }
}

/// A largest set of commuting mirrors of the shape: the axis mirrors that keep its openings, or the
/// diagonal one where only that of y does (the exchange of x and z commutes with it).
fn mirrors(shape: &Shape) -> Vec<Mirror> {
    let axes: Vec<Mirror> = (0..3)
        .map(Mirror::Axis)
        .filter(|mirror| mirror.keeps(shape))
        .collect();
    let has_x_or_z = axes.contains(&Mirror::Axis(0)) || axes.contains(&Mirror::Axis(2));
    if !has_x_or_z && Mirror::Diagonal.keeps(shape) {
        return axes.into_iter().chain([Mirror::Diagonal]).collect();
    }
    axes
}

/// Parity classes of the shape's texels: eight for cube, straight and cross, four for the others.
pub fn texel_parity_classes(shape: &Shape, resolution: usize) -> ParityClasses {
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    // Texel centres are odd multiples of half a texel: exact as integers.
    let key = |face: Face, p: DVec3| {
        let scaled = p * (2 * resolution) as f64;
        (face, scaled.round().as_ivec3().to_array())
    };
    let index: HashMap<_, u32> = texels
        .iter()
        .enumerate()
        .map(|(k, &(face, p))| (key(face, p), k as u32))
        .collect();
    let permutations: Vec<Vec<u32>> = mirrors(shape)
        .into_iter()
        .map(|mirror| {
            texels
                .iter()
                .map(|&(face, p)| index[&key(mirror.face(face), mirror.point(p))])
                .collect()
        })
        .collect();
    ParityClasses::new(texels.len(), &permutations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_runtime::shape::SHAPES;

    #[test]
    fn fold_factors_are_those_of_the_shapes() {
        let factors: Vec<usize> = SHAPES
            .iter()
            .map(|shape| texel_parity_classes(shape, 4).class_count())
            .collect();
        assert_eq!(factors, [8, 4, 8, 4, 4, 8]);
    }
}
