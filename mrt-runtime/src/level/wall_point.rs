//! A point of a wall of a shape.

use glam::DVec3;
use mrt_core::geometry::hexahedron::Hexahedron;

/// A point of a wall, in the unit cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallPoint {
    /// In the unit cube.
    pub position: DVec3,
    /// Unit normal into the block.
    pub normal: DVec3,
}

impl WallPoint {
    /// Unit normal into the block of the same point on the warped wall.
    pub fn warped_normal(&self, warp: &Hexahedron) -> DVec3 {
        // Gradients transform by the inverse transpose, which keeps their side of the wall.
        let jacobian = warp.jacobian(self.position);
        (jacobian.inverse().transpose() * self.normal).normalize()
    }
}
