//! A cube camera in a block's centre (Loos et al. 2011, section 7.2): which part of the mesh each face of the block sees.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;

/// Pixels along an edge of each face's picture.
const RESOLUTION: usize = 64;

/// A point counts as the one seen in a pixel if it is at most this many times as far away: pixels have a size, and
/// surfaces are slanted.
const SLACK: f64 = 1.08;

/// Distances to the mesh through every pixel of the six faces, seen from the centre.
#[derive(Clone, Debug)]
pub(super) struct CubeCamera {
    warp: Hexahedron,
    center: DVec3,
    /// In lengths from the centre to the block's own face; infinite where nothing is seen.
    depth: Vec<f32>,
}

impl CubeCamera {
    /// Casts a ray through every pixel. `first_hit` gives the distance from an origin along a direction to the mesh, in
    /// lengths of the direction; infinite where the ray meets nothing.
    pub fn new(warp: &Hexahedron, first_hit: impl Fn(Vec3, Vec3) -> f32) -> Self {
        let center = warp.point(DVec3::splat(0.5));
        let mut depth = Vec::with_capacity(6 * RESOLUTION * RESOLUTION);
        for face in Face::ALL {
            for j in 0..RESOLUTION {
                for i in 0..RESOLUTION {
                    let target = warp.point(face.texel_center(RESOLUTION, j, i));
                    depth.push(first_hit(center.as_vec3(), (target - center).as_vec3()));
                }
            }
        }
        Self {
            warp: *warp,
            center,
            depth,
        }
    }

    /// The face through which the camera sees a point, whose place in the unit cube is `unit`; `None` if something hides
    /// it.
    pub fn face_that_sees(&self, point: DVec3, unit: DVec3) -> Option<Face> {
        let from_center = unit - 0.5;
        let size = from_center.abs();
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]))?;
        if size[axis] == 0.0 {
            return None;
        }
        let face = Face::from_axis(axis, from_center[axis] > 0.0);
        let on_face = from_center * (0.5 / size[axis]) + 0.5;
        let pixel = |coordinate: f64| {
            let k = (coordinate * RESOLUTION as f64).floor();
            k.clamp(0.0, RESOLUTION as f64 - 1.0) as usize
        };
        let (i, j) = (pixel(on_face[face.u_axis()]), pixel(on_face[face.v_axis()]));
        let seen = self.depth[(face.index() * RESOLUTION + j) * RESOLUTION + i];
        let full = self.warp.point(on_face).distance(self.center);
        let distance = point.distance(self.center) / full;
        (distance <= f64::from(seen) * SLACK).then_some(face)
    }
}
