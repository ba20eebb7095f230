//! Points spread evenly over a mesh's area.

use glam::{Vec2, Vec3};
use mrt_core::geometry::mesh::{TriangleMesh, areas, face_normals};
use mrt_core::lighting::sampling::hammersley_point;

/// A point of a mesh that stands for some area around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSample {
    /// World position, metres.
    pub position: Vec3,
    /// Unit normal of the triangle.
    pub normal: Vec3,
    /// Which triangle it lies on.
    pub triangle: usize,
    /// Weights of the triangle's second and third corner.
    pub barycentric: Vec2,
    /// The area that it stands for, square metres.
    pub area: f64,
}

/// About `count` points, spread evenly; every triangle has at least one.
pub fn sample_mesh(mesh: &TriangleMesh, count: usize) -> Vec<MeshSample> {
    let areas = areas(mesh);
    let normals = face_normals(mesh);
    let total: f64 = areas.iter().sum();
    let mut points = Vec::with_capacity(count + areas.len());
    for (triangle, (&area, &normal)) in areas.iter().zip(&normals).enumerate() {
        let share = (area / total * count as f64)
            .ceil()
            .clamp(1.0, count as f64) as u32;
        let [a, b, c] = mesh.corners(triangle);
        for k in 0..share {
            // Folding the unit square along its diagonal takes it to a triangle.
            let mut unit = hammersley_point(k, share);
            if unit.x + unit.y > 1.0 {
                unit = 1.0 - unit;
            }
            points.push(MeshSample {
                position: a + (b - a) * unit.x as f32 + (c - a) * unit.y as f32,
                normal,
                triangle,
                barycentric: unit.as_vec2(),
                area: area / f64::from(share),
            });
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_of_all_points_add_up_to_the_mesh() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, 9.0 * Vec3::X];
        let mesh = TriangleMesh::from_triangles(corners, vec![[0, 1, 2], [0, 3, 2]]);
        let points = sample_mesh(&mesh, 1000);
        let area: f64 = points.iter().map(|point| point.area).sum();
        assert!((area - 5.0).abs() < 1e-9);
        let of_first = points.iter().filter(|point| point.triangle == 0).count();
        assert_eq!(of_first, 100);
    }
}
