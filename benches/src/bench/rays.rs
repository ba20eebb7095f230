//! What ray methods share: the level's walls as triangles, and its lights.

use super::reference::Receiver;
use super::setting::Setting;
use glam::{DVec3, Vec3};
use mrt_core::geometry::bvh::{Bvh, Hit};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_core::lighting::sphere_light::sphere_light_irradiance;

/// How far off a wall rays start, metres.
const OFFSET: f32 = 1e-4;

/// Walls in a tree, and lights.
pub struct RayScene {
    bvh: Bvh,
    mesh: TriangleMesh,
    lights: Vec<(Vec3, f32, Vec3)>,
}

/// A point of a wall.
#[derive(Clone, Copy, Debug)]
pub struct WallPoint {
    /// World position, a little off the wall.
    pub position: Vec3,
    /// Unit normal, into the block.
    pub normal: Vec3,
}

impl WallPoint {
    /// A texel's centre.
    pub fn of(receiver: &Receiver) -> Self {
        let normal = receiver.normal.as_vec3();
        Self {
            position: receiver.position.as_vec3() + OFFSET * normal,
            normal,
        }
    }
}

impl RayScene {
    /// Two triangles a wall.
    pub fn new(setting: &Setting) -> Self {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for block in &setting.level.blocks {
            for face in Face::ALL.into_iter().filter(|&face| !block.is_open(face)) {
                let first = positions.len() as u32;
                let corners = block.warp.face_corners(face);
                positions.extend(corners.map(|corner| corner.as_vec3()));
                triangles.push([first, first + 1, first + 2]);
                triangles.push([first, first + 2, first + 3]);
            }
        }
        let mesh = TriangleMesh::from_triangles(positions, triangles);
        Self {
            bvh: Bvh::build(&mesh),
            mesh,
            lights: setting.spheres(),
        }
    }

    /// Position, radius and intensity of each light.
    pub fn lights(&self) -> &[(Vec3, f32, Vec3)] {
        &self.lights
    }

    /// Bytes of triangles and tree, roughly: corners twice, indices, and two nodes of 32 bytes a triangle.
    pub fn bytes(&self) -> usize {
        self.mesh.triangles.len() * (36 + 36 + 12 + 64)
    }

    /// The first wall that a ray meets. Walls have two sides: where blocks are not joined, theirs coincide.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3) -> Option<WallPoint> {
        let Hit { triangle, t, .. } = self.bvh.closest_hit(origin, direction, f32::INFINITY)?;
        let [a, b, c] = self.mesh.corners(triangle as usize);
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(direction) > 0.0 {
            -normal
        } else {
            normal
        };
        Some(WallPoint {
            position: origin + t * direction + OFFSET * normal,
            normal,
        })
    }

    /// True if nothing stands between two points.
    pub fn sees(&self, from: Vec3, to: Vec3) -> bool {
        !self.bvh.is_occluded(from, to - from, 1.0)
    }

    /// Direct irradiance at a point of a wall, by one shadow ray a light that is above its horizon.
    pub fn direct(&self, at: &WallPoint) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for &(position, radius, intensity) in &self.lights {
            let offset: DVec3 = (position - at.position).as_dvec3();
            let e = sphere_light_irradiance(offset, at.normal.as_dvec3(), f64::from(radius)) as f32;
            if e > 0.0 && self.sees(at.position, position) {
                sum += e * intensity;
            }
        }
        sum
    }
}

/// Time and result of a ray method at the receivers.
#[derive(Clone, Debug, Default)]
pub struct Traced {
    /// Seconds that do not depend on the number of texels.
    pub start_seconds: f64,
    /// Seconds of each receiver.
    pub receiver_seconds: f64,
    /// Indirect irradiance.
    pub irradiance: Vec<[f64; 3]>,
}
