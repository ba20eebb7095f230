//! Lightmap coordinates for a whole mesh: every triangle on one wall of one block.

use super::{Receiver, ReceiverMap};
use glam::Vec3;
use mrt_core::geometry::mesh::{TriangleMesh, face_normals};

/// Triangles that reach into several blocks are halved until they do not, at most this often.
const MOST_HALVINGS: u32 = 12;

/// Nothing is halved any more once there are this many triangles.
const MOST_TRIANGLES: usize = 10_000_000;

/// Edges shorter than this share of the smallest block's diagonal are not halved: a triangle along a
/// border reaches into both blocks however small it is.
const SHORTEST_EDGE: f64 = 0.1;

/// A triangle with its receivers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitTriangle {
    /// World positions, metres.
    pub corners: [Vec3; 3],
    /// On one wall of one block.
    pub receivers: [Receiver; 3],
    /// The triangle of the mesh that it is, or is a part of.
    pub source: usize,
}

/// Finds the receivers of every triangle and splits those that reach into several blocks.
pub fn unwrap(mesh: &TriangleMesh, receivers: &ReceiverMap) -> Vec<LitTriangle> {
    let normals = face_normals(mesh);
    let mut lit = Vec::with_capacity(mesh.triangles.len());
    let mut pending = Vec::new();
    for (source, &normal) in normals.iter().enumerate() {
        pending.push((mesh.corners(source), 0));
        while let Some((corners, halvings)) = pending.pop() {
            let center = (corners[0] + corners[1] + corners[2]) / 3.0;
            let Some(whole) = receivers.receiver(center, normal) else {
                continue;
            };
            // Corners lie on borders; a little inside says which block they belong to.
            let is_split = corners.iter().any(|&corner| {
                receivers
                    .receiver(corner.lerp(center, 0.05), normal)
                    .is_some_and(|receiver| receiver.block != whole.block)
            });
            let [a, b, c] = longest_first(corners);
            let is_long = f64::from(a.distance(b)) > SHORTEST_EDGE * receivers.smallest_diagonal;
            if is_split && is_long && halvings < MOST_HALVINGS && lit.len() < MOST_TRIANGLES {
                let middle = a.midpoint(b);
                pending.push(([a, middle, c], halvings + 1));
                pending.push(([middle, b, c], halvings + 1));
                continue;
            }
            lit.push(LitTriangle {
                corners,
                receivers: corners
                    .map(|corner| receivers.receiver_on(corner, whole.block, whole.face)),
                source,
            });
        }
    }
    lit
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
