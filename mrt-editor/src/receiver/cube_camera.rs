//! A cube camera in a block's centre (Loos et al. 2011, section 7.2): what part of the mesh each face of
//! the block sees.

use glam::DVec3;
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;

/// Pixels along an edge of each face's picture.
const RESOLUTION: usize = 64;

/// A point is the one seen in a pixel if it is at most this much further away: pixels have a size, and
/// surfaces are slanted.
const SLACK: f64 = 1.08;

/// Distances to the mesh through every pixel of the six faces, seen from the centre.
#[derive(Clone, Debug)]
pub struct CubeCamera {
    warp: Hexahedron,
    center: DVec3,
    /// In lengths from the centre to the block's own face; infinite where nothing is seen.
    depth: Vec<f32>,
}

impl CubeCamera {
    /// Casts a ray through every pixel.
    pub fn new(warp: &Hexahedron, bvh: &Bvh) -> Self {
        let center = warp.point(DVec3::splat(0.5));
        let mut depth = Vec::with_capacity(6 * RESOLUTION * RESOLUTION);
        for face in Face::ALL {
            for j in 0..RESOLUTION {
                for i in 0..RESOLUTION {
                    let target = warp.point(face.texel_center(RESOLUTION, j, i));
                    let direction = (target - center).as_vec3();
                    let hit = bvh.closest_hit(center.as_vec3(), direction, f32::INFINITY);
                    depth.push(hit.map_or(f32::INFINITY, |hit| hit.t));
                }
            }
        }
        Self {
            warp: *warp,
            center,
            depth,
        }
    }

    /// The face through which the point of the unit cube is seen; `None` when something hides it.
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
