//! The 48 symmetries of the unit cube: its 24 rotations, and each of them with a mirror.

use crate::geometry::cube::{CubeRotation, Face};
use glam::DVec3;

/// A rotation or a mirrored rotation that maps the unit cube to itself: one of 48.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CubeSymmetry {
    /// Where +x, +y and +z point after the map.
    images: [Face; 3],
}

impl CubeSymmetry {
    /// The map that changes nothing.
    pub const IDENTITY: CubeSymmetry = CubeSymmetry {
        images: [Face::PosX, Face::PosY, Face::PosZ],
    };

    /// The map that takes +x, +y and +z to `x`, `y` and `z`; `None` unless they lie on three axes.
    pub fn from_images(x: Face, y: Face, z: Face) -> Option<CubeSymmetry> {
        let axes_differ = x.axis() != y.axis() && y.axis() != z.axis() && z.axis() != x.axis();
        axes_differ.then_some(CubeSymmetry { images: [x, y, z] })
    }

    /// The map that exchanges two axes (0, 1, 2); the identity if they are the same.
    pub fn exchange(a: usize, b: usize) -> CubeSymmetry {
        let mut images = Self::IDENTITY.images;
        images.swap(a, b);
        CubeSymmetry { images }
    }

    /// The map that reverses an axis (0, 1, 2).
    pub fn mirror(axis: usize) -> CubeSymmetry {
        let mut images = Self::IDENTITY.images;
        images[axis] = images[axis].opposite();
        CubeSymmetry { images }
    }

    /// All 48 maps.
    pub fn all() -> impl Iterator<Item = CubeSymmetry> {
        Face::ALL.into_iter().flat_map(|x| {
            Face::ALL.into_iter().flat_map(move |y| {
                Face::ALL
                    .into_iter()
                    .filter_map(move |z| CubeSymmetry::from_images(x, y, z))
            })
        })
    }

    /// Where the map takes a face.
    pub fn face(self, face: Face) -> Face {
        face.image(self.images)
    }

    /// Where the map takes a direction.
    pub fn direction(self, direction: DVec3) -> DVec3 {
        let mut out = DVec3::ZERO;
        for (axis, image) in self.images.into_iter().enumerate() {
            let sign = if image.is_positive() { 1.0 } else { -1.0 };
            out[image.axis()] = sign * direction[axis];
        }
        out
    }

    /// Where the map takes a point of the unit cube.
    ///
    /// Coordinates are copied or subtracted from one, so texel centres go to texel centres, up to rounding.
    pub fn point(self, point: DVec3) -> DVec3 {
        let mut out = DVec3::ZERO;
        for (axis, image) in self.images.into_iter().enumerate() {
            out[image.axis()] = if image.is_positive() {
                point[axis]
            } else {
                1.0 - point[axis]
            };
        }
        out
    }

    /// The map that undoes this one.
    pub fn inverse(self) -> CubeSymmetry {
        let mut images = Self::IDENTITY.images;
        for (axis, image) in self.images.into_iter().enumerate() {
            images[image.axis()] = Face::from_axis(axis, image.is_positive());
        }
        CubeSymmetry { images }
    }

    /// The map that applies `first` and then this one.
    pub fn after(self, first: CubeSymmetry) -> CubeSymmetry {
        CubeSymmetry {
            images: first.images.map(|image| self.face(image)),
        }
    }

    /// True for the 24 maps without a mirror.
    pub fn is_rotation(self) -> bool {
        let [x, y, z] = self.images.map(Face::outward);
        x.cross(y) == z
    }
}

impl From<CubeRotation> for CubeSymmetry {
    fn from(rotation: CubeRotation) -> Self {
        CubeSymmetry {
            images: Self::IDENTITY.images.map(|face| rotation.face(face)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_48_symmetries_and_half_are_rotations() {
        let all: Vec<_> = CubeSymmetry::all().collect();
        assert_eq!(all.len(), 48);
        assert_eq!(all.iter().filter(|s| s.is_rotation()).count(), 24);
        for rotation in CubeRotation::all() {
            assert!(CubeSymmetry::from(rotation).is_rotation());
        }
    }

    #[test]
    fn composition_and_inverse_act_as_maps_of_points() {
        let p = DVec3::new(0.1, 0.35, 0.8);
        for a in CubeSymmetry::all() {
            assert_eq!(a.inverse().after(a), CubeSymmetry::IDENTITY);
            for b in CubeSymmetry::all() {
                let once = a.after(b).point(p);
                // Each step rounds once, where it subtracts from one.
                assert!((once - a.point(b.point(p))).length() < 1e-15);
            }
            let moved = a.point(p) - a.point(DVec3::ZERO);
            assert!((moved - a.direction(p)).length() < 1e-15);
        }
    }
}
