//! Lightmap coordinates for a whole mesh: every triangle on one wall of one block.

use crate::output::receiver::map::ReceiverMap;
use crate::output::receiver::wall_receiver::WallReceiver;
use glam::Vec3;
use mrt_core::geometry::mesh::{TriangleMesh, face_normals};

/// Triangles that reach into several blocks are halved until they do not, at most this often.
const MAX_HALVINGS: u32 = 12;

/// Nothing is halved any more once there are this many triangles.
const MAX_TRIANGLES: usize = 10_000_000;

/// Edges shorter than this share of the smallest block's diagonal are not halved: a triangle along a border reaches into
/// both blocks however small it is.
const SHORTEST_EDGE: f64 = 0.1;

/// How far corners are moved towards the centre to see which block they belong to, as a share of the way: corners lie on
/// borders.
const INWARD: f32 = 0.05;

/// A triangle of a mesh, or a part of one, with its receivers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnwrappedTriangle {
    /// World positions, metres.
    pub corners: [Vec3; 3],
    /// One a corner, on one wall of one block.
    pub receivers: [WallReceiver; 3],
    /// The triangle of the mesh that it is, or is a part of.
    pub source: usize,
}

/// Finds the receivers of every triangle, and splits triangles that reach into several blocks. Parts keep the order and
/// the sense of rotation of the triangles that they come from.
pub fn unwrap_mesh(mesh: &TriangleMesh, receivers: &ReceiverMap) -> Vec<UnwrappedTriangle> {
    let normals = face_normals(mesh);
    let mut unwrapped = Vec::with_capacity(mesh.triangles.len());
    let mut pending = Vec::new();
    for (source, &normal) in normals.iter().enumerate() {
        pending.push((mesh.corners(source), 0));
        while let Some((corners, halvings)) = pending.pop() {
            let center = (corners[0] + corners[1] + corners[2]) / 3.0;
            let Some(whole) = receivers.receiver(center, normal) else {
                continue;
            };
            let is_elsewhere = |corner: &Vec3| {
                let inside = corner.lerp(center, INWARD);
                let receiver = receivers.receiver(inside, normal);
                receiver.is_some_and(|receiver| receiver.block != whole.block)
            };
            let [a, b, c] = longest_first(corners);
            let is_long = f64::from(a.distance(b)) > SHORTEST_EDGE * receivers.smallest_diagonal();
            let may_split = halvings < MAX_HALVINGS && unwrapped.len() < MAX_TRIANGLES;
            if is_long && may_split && corners.iter().any(is_elsewhere) {
                let middle = a.midpoint(b);
                pending.push(([a, middle, c], halvings + 1));
                pending.push(([middle, b, c], halvings + 1));
                continue;
            }
            let on_wall = |corner| {
                let found = receivers.receiver_on(corner, whole.block, whole.face);
                found.unwrap_or(whole)
            };
            unwrapped.push(UnwrappedTriangle {
                corners,
                receivers: corners.map(on_wall),
                source,
            });
        }
    }
    unwrapped
}

/// Turns the corners round so that the longest edge comes first.
fn longest_first([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    let (ab, bc, ca) = (
        a.distance_squared(b),
        b.distance_squared(c),
        c.distance_squared(a),
    );
    if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::block::Level;

    #[test]
    fn a_floor_under_two_blocks_is_cut_between_them() {
        let level = Level::from_cells(&[[0, 0, 0], [1, 0, 0]], Vec3::ONE).expect("cells");
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let positions = corners.map(|[x, z]| Vec3::new(x, 0.0, z)).to_vec();
        let mesh = TriangleMesh::from_triangles(positions, vec![[0, 2, 1], [0, 3, 2]]);
        let unwrapped = unwrap_mesh(&mesh, &ReceiverMap::new(&level));
        assert!(unwrapped.len() > 2);
        let mut area = 0.0;
        for triangle in &unwrapped {
            let [a, b, c] = triangle.corners;
            area += (b - a).cross(c - a).y / 2.0;
            let center = (a + b + c) / 3.0;
            let [first, ..] = triangle.receivers;
            assert_eq!(first.block.get(), center.x as usize);
            let is_same = |r: &WallReceiver| (r.block, r.face) == (first.block, first.face);
            assert!(triangle.receivers.iter().all(is_same));
        }
        assert!((area - 2.0).abs() < 1e-5, "{area}");
    }
}
