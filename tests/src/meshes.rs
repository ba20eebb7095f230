//! Meshes for the path tracer.

use glam::{DVec3, Vec3};
use mrt_core::geometry::mesh::{Material, TriangleMesh};

/// A mesh of patches, all of one albedo. A patch gives a point for u and v in [0, 1], and becomes `squares`² flat squares
/// of two triangles each.
pub fn patch_mesh<Patch: Fn(f64, f64) -> DVec3>(
    patches: impl IntoIterator<Item = Patch>,
    squares: u32,
    albedo: f32,
) -> TriangleMesh {
    let line = squares + 1;
    let along = |k: u32| f64::from(k) / f64::from(squares);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for patch in patches {
        let first = positions.len() as u32;
        let points = (0..line * line).map(|k| patch(along(k % line), along(k / line)));
        positions.extend(points.map(|point| point.as_vec3()));
        for row in 0..squares {
            for column in 0..squares {
                let [a, b] = [
                    first + row * line + column,
                    first + (row + 1) * line + column,
                ];
                triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
    }
    painted(TriangleMesh::from_triangles(positions, triangles), albedo)
}

/// The mesh in one material.
pub fn painted(mut mesh: TriangleMesh, albedo: f32) -> TriangleMesh {
    mesh.materials = vec![Material {
        name: "paint".into(),
        albedo: Vec3::splat(albedo),
    }];
    mesh
}
