//! The map from the world to the unit cube of a block.

use glam::{DMat3, DVec3};
use mrt_core::geometry::hexahedron::Hexahedron;

/// The map from the world to the unit cube of a block: the inverse of a warp.
#[derive(Clone, Copy, Debug)]
pub struct UnitFromWorld {
    warp: Hexahedron,
    /// Inverse matrix and origin, if the warp is affine: one product takes nanoseconds, Newton's method microseconds.
    affine: Option<(DMat3, DVec3)>,
}

/// Distance, in diagonals of the block, within which the corners of a warp count as those of an affine map: a hundred
/// roundings of coordinates at [`FAR_LIMIT`](crate::level::error::FAR_LIMIT).
const AFFINE_TOLERANCE: f64 = 1e-10;

impl UnitFromWorld {
    /// The inverse of a warp.
    pub fn new(warp: &Hexahedron) -> Self {
        let jacobian = warp.jacobian(DVec3::splat(0.5));
        let origin = warp.center() - jacobian * DVec3::splat(0.5);
        let is_affine = (0..8).all(|k| {
            let corner = origin + jacobian * Hexahedron::unit_corner(k);
            corner.distance(warp.corners[k]) <= AFFINE_TOLERANCE * warp.diagonal()
        });
        Self {
            warp: *warp,
            affine: is_affine.then(|| (jacobian.inverse(), origin)),
        }
    }

    /// The point of the unit cube, or outside it, that the warp takes to `world`, metres. Where Newton's method does
    /// not find one, far from a warped block, the middle of the cube.
    pub fn point(&self, world: DVec3) -> DVec3 {
        match self.affine {
            Some((inverse, origin)) => inverse * (world - origin),
            None => self.warp.inverse(world).unwrap_or(DVec3::splat(0.5)),
        }
    }
}
