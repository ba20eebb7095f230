//! Meshes far from their origin, and meshes that are too large.

use super::error::ImportError;
use super::limits::MAX_COORDINATE_M;
use super::raw_mesh::RawMesh;
use glam::{DAffine3, DVec3};
use std::path::Path;

/// A mesh whose centre is farther from its origin than this many of its diagonals is moved there. Up to that distance `f32`
/// rounds positions by less than 6e-6 of the diagonal, which is less than the 1e-5 at which rays start before surfaces.
const FAR: f64 = 100.0;

/// Smallest and largest coordinates of all triangles with finite corners, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    low: DVec3,
    high: DVec3,
}

impl Extent {
    /// `None` if no triangle has finite corners.
    pub(super) fn new(raw: &RawMesh, metres_from_file: &DAffine3) -> Option<Self> {
        let mut bounds: Option<[DVec3; 2]> = None;
        for vertices in &raw.triangles {
            let corners = vertices.map(|v| raw.positions[v as usize]);
            if corners.iter().all(|corner| corner.is_finite()) {
                for corner in corners {
                    let [low, high] = bounds.get_or_insert([corner; 2]);
                    (*low, *high) = (low.min(corner), high.max(corner));
                }
            }
        }
        let corners = bounds?.map(|corner| metres_from_file.transform_point3(corner));
        Some(Self {
            low: corners[0].min(corners[1]),
            high: corners[0].max(corners[1]),
        })
    }

    /// Refuses coordinates beyond [`MAX_COORDINATE_M`].
    ///
    /// # Errors
    /// [`ImportError::OutOfRange`].
    pub(super) fn check(&self, path: &Path) -> Result<(), ImportError> {
        let found = self.low.abs().max(self.high.abs()).max_element();
        if found <= MAX_COORDINATE_M {
            return Ok(());
        }
        Err(ImportError::OutOfRange {
            path: path.to_owned(),
            found,
            size: (self.high - self.low).max_element(),
        })
    }

    /// Whole metres near the mesh's centre if it is [`FAR`] from the origin, else zero.
    pub(super) fn origin(&self) -> DVec3 {
        let center = (self.low + self.high) / 2.0;
        if center.length() > FAR * (self.high - self.low).length() {
            center.round()
        } else {
            DVec3::ZERO
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_far_meshes_get_an_origin_of_whole_metres() {
        let origin = |place: DVec3| {
            let raw = RawMesh {
                positions: [DVec3::ZERO, DVec3::new(4.0, 3.0, 4.0), DVec3::NAN, DVec3::X]
                    .map(|corner| corner + place)
                    .to_vec(),
                triangles: vec![[0, 1, 3], [0, 1, 2]],
                ..RawMesh::default()
            };
            let extent = Extent::new(&raw, &DAffine3::IDENTITY).expect("a triangle");
            extent.origin()
        };
        assert_eq!(origin(DVec3::X * 500.0), DVec3::ZERO);
        assert_eq!(origin(DVec3::X * 1e7), DVec3::new(1e7 + 2.0, 2.0, 2.0));
        let only_nan = RawMesh {
            positions: vec![DVec3::NAN],
            triangles: vec![[0; 3]],
            ..RawMesh::default()
        };
        assert_eq!(Extent::new(&only_nan, &DAffine3::IDENTITY), None);
    }
}
