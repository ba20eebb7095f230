//! A point on a wall of a shape.

use glam::DVec3;
use mrt_core::geometry::hexahedron::Hexahedron;

/// A point on a wall, in the unit cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallPoint {
    /// Position in the unit cube.
    pub position: DVec3,
    /// Unit normal into the block.
    pub normal: DVec3,
}

impl WallPoint {
    /// Unit normal, into the block, at the same point of the warped wall.
    pub fn warped_normal(&self, warp: &Hexahedron) -> DVec3 {
        // The inverse transpose keeps a normal perpendicular to its wall, and on the same side.
        let jacobian = warp.jacobian(self.position);
        (jacobian.inverse().transpose() * self.normal).normalize()
    }
}
