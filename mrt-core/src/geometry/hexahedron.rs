//! A cube warped by its eight corners: the trilinear map, its inverse, and its faces.

use crate::geometry::cube::Face;
use glam::{DMat3, DVec3};

/// A warped cube. Corner k is the image of the point of the unit cube with x = bit 0, y = bit 1 and
/// z = bit 2 of k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hexahedron {
    /// World positions of the corners.
    pub corners: [DVec3; 8],
}

/// Why eight corners are not the image of a cube.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HexahedronError {
    /// A coordinate is NaN or infinite.
    #[error("corner {corner} is not finite")]
    NotFinite {
        /// Which corner.
        corner: usize,
    },
    /// At a corner the map folds over, is mirrored or has no volume.
    #[error(
        "the warp has volume factor {found:.3e} at corner {corner}; expected above {expected:.3e} \
         (corners in the wrong order, mirrored, folded or flat)"
    )]
    Folded {
        /// Which corner.
        corner: usize,
        /// Smallest accepted determinant of the Jacobian.
        expected: f64,
        /// Determinant of the Jacobian at the corner.
        found: f64,
    },
}

impl Hexahedron {
    /// The unit cell whose smallest corner is `min`.
    pub fn cell(min: DVec3) -> Self {
        Self::cuboid(min, min + DVec3::ONE)
    }

    /// The axis-aligned box from `min` to `max`.
    pub fn cuboid(min: DVec3, max: DVec3) -> Self {
        Self {
            corners: std::array::from_fn(|k| {
                let unit = Self::unit_corner(k);
                min + (max - min) * unit
            }),
        }
    }

    /// Corner k of the unit cube.
    pub fn unit_corner(k: usize) -> DVec3 {
        DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2 & 1) as f64)
    }

    /// Checks that all corners are finite, and that the map is right-handed and unfolded at each.
    ///
    /// # Errors
    /// [`HexahedronError`], for the first corner at fault.
    pub fn check(&self) -> Result<(), HexahedronError> {
        if let Some(corner) = self.corners.iter().position(|c| !c.is_finite()) {
            return Err(HexahedronError::NotFinite { corner });
        }
        let size = self.diagonal();
        // A millionth of the volume of the cube on the diagonal. A flatter block is a mistake, and its
        // inverse map would have too few digits.
        let expected = 1e-6 * size * size * size;
        for corner in 0..8 {
            let found = self.jacobian(Self::unit_corner(corner)).determinant();
            // Written so that NaN, from huge coordinates, counts as folded.
            let is_unfolded = found > expected;
            if !is_unfolded {
                return Err(HexahedronError::Folded {
                    corner,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }

    /// Length of the diagonal of the bounding box, metres.
    pub fn diagonal(&self) -> f64 {
        let (min, max) = self.bounds();
        (max - min).length()
    }

    /// Smallest and largest coordinates of the corners.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let first = self.corners[0];
        self.corners
            .iter()
            .fold((first, first), |(lo, hi), &c| (lo.min(c), hi.max(c)))
    }

    /// Mean of the corners.
    pub fn center(&self) -> DVec3 {
        self.corners.iter().copied().sum::<DVec3>() / 8.0
    }

    /// World position of a point of the unit cube.
    pub fn point(&self, unit: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (k, &corner) in self.corners.iter().enumerate() {
            sum += corner * Self::weight(k, unit);
        }
        sum
    }

    /// Derivatives of [`Hexahedron::point`] by the x, y and z of the unit cube, as columns.
    pub fn jacobian(&self, unit: DVec3) -> DMat3 {
        let mut columns = [DVec3::ZERO; 3];
        for (k, &corner) in self.corners.iter().enumerate() {
            let bits = Self::unit_corner(k);
            for (axis, column) in columns.iter_mut().enumerate() {
                let mut weight = if bits[axis] > 0.5 { 1.0 } else { -1.0 };
                for other in (0..3).filter(|&other| other != axis) {
                    weight *= if bits[other] > 0.5 {
                        unit[other]
                    } else {
                        1.0 - unit[other]
                    };
                }
                *column += corner * weight;
            }
        }
        DMat3::from_cols(columns[0], columns[1], columns[2])
    }

    /// The point in or outside the unit cube that maps to `world`, by Newton's method; `None` where the
    /// method does not converge, which happens far outside a warped block.
    pub fn inverse(&self, world: DVec3) -> Option<DVec3> {
        let size = self.diagonal();
        let mut unit = DVec3::splat(0.5);
        for _ in 0..32 {
            let miss = self.point(unit) - world;
            if miss.length() <= 1e-12 * size {
                return Some(unit);
            }
            let jacobian = self.jacobian(unit);
            if jacobian.determinant() == 0.0 {
                return None;
            }
            // Limited steps cannot jump from far away into a folded region.
            let step = jacobian.inverse() * miss;
            unit -= step.clamp(DVec3::splat(-2.0), DVec3::splat(2.0));
            if !unit.is_finite() {
                return None;
            }
        }
        let miss = self.point(unit) - world;
        (miss.length() <= 1e-9 * size).then_some(unit)
    }

    /// True if `world` is inside the block, or within `tolerance` of it in unit-cube coordinates.
    pub fn contains(&self, world: DVec3, tolerance: f64) -> bool {
        let (min, max) = self.bounds();
        let slack = DVec3::splat(tolerance * self.diagonal());
        if world.cmplt(min - slack).any() || world.cmpgt(max + slack).any() {
            return false;
        }
        self.inverse(world).is_some_and(|unit| {
            unit.cmpge(DVec3::splat(-tolerance)).all()
                && unit.cmple(DVec3::splat(1.0 + tolerance)).all()
        })
    }

    /// World corners of a face, in the order (u, v) = (0, 0), (1, 0), (1, 1), (0, 1).
    pub fn face_corners(&self, face: Face) -> [DVec3; 4] {
        // As `point` has them, at a hundredth of its cost: there, negative zero becomes zero.
        face.rectangle([0.0, 1.0], [0.0, 1.0]).map(|unit| {
            let bits = unit.to_array().map(|x| usize::from(x > 0.5));
            self.corners[bits[0] | bits[1] << 1 | bits[2] << 2] + DVec3::ZERO
        })
    }

    /// Unit normal into the block at (u, v) of a face.
    pub fn face_normal(&self, face: Face, u: f64, v: f64) -> DVec3 {
        let jacobian = self.jacobian(face.point(u, v));
        // The gradient of a unit coordinate transforms by the inverse transpose, and stays on its side
        // of the face.
        let inward = jacobian.inverse().transpose() * -face.outward();
        inward.normalize()
    }

    /// The weight of corner k at a point of the unit cube.
    fn weight(k: usize, unit: DVec3) -> f64 {
        let bits = Self::unit_corner(k);
        (0..3)
            .map(|axis| {
                if bits[axis] > 0.5 {
                    unit[axis]
                } else {
                    1.0 - unit[axis]
                }
            })
            .product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A cell with the corners moved by the given offsets, x, y and z of each.
    fn warped(offsets: &[f64]) -> Hexahedron {
        let mut block = Hexahedron::cell(DVec3::new(2.0, -1.0, 5.0));
        for (corner, offset) in block.corners.iter_mut().zip(offsets.chunks_exact(3)) {
            *corner += DVec3::from_slice(offset);
        }
        block
    }

    proptest! {
        #[test]
        fn the_inverse_undoes_the_map(
            offsets in prop::collection::vec(-0.2f64..0.2, 24),
            x in 0.0f64..1.0, y in 0.0f64..1.0, z in 0.0f64..1.0,
        ) {
            let block = warped(&offsets);
            prop_assume!(block.check().is_ok());
            let unit = DVec3::new(x, y, z);
            let back = block.inverse(block.point(unit)).expect("converges inside");
            // Newton stops at 1e-12 of the diagonal.
            prop_assert!((back - unit).length() < 1e-9);
            prop_assert!(block.contains(block.point(unit), 1e-9));
        }

        #[test]
        fn corners_of_faces_are_the_ends_of_the_map(
            offsets in prop::collection::vec(-3.0f64..3.0, 24),
        ) {
            let block = warped(&offsets);
            for face in Face::ALL {
                let ends = face.rectangle([0.0, 1.0], [0.0, 1.0]);
                prop_assert_eq!(block.face_corners(face), ends.map(|unit| block.point(unit)));
            }
        }
    }

    #[test]
    fn normals_point_inwards() {
        let block = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(2.0, 3.0, 4.0));
        for face in Face::ALL {
            let miss = block.face_normal(face, 0.3, 0.6) + face.outward();
            // A few roundings in the inverse Jacobian.
            assert!(miss.length() < 1e-14, "{face}: {miss}");
        }
    }

    #[test]
    fn mirrored_corners_are_refused() {
        let mut block = Hexahedron::cell(DVec3::ZERO);
        block.corners.swap(0, 1);
        assert!(matches!(block.check(), Err(HexahedronError::Folded { .. })));
        block.corners[3].y = f64::NAN;
        assert_eq!(block.check(), Err(HexahedronError::NotFinite { corner: 3 }));
    }
}
