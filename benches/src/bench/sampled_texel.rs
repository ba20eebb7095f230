//! A texel that stands for others.

use glam::DVec3;
use mrt_core::geometry::cube::Face;

/// A texel whose exact irradiance is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledTexel {
    /// Index of its block.
    pub block: usize,
    /// Its wall, as the level names it.
    pub face: Face,
    /// Position along v.
    pub row: usize,
    /// Position along u.
    pub column: usize,
    /// Number of texels of the level that it stands for.
    pub weight: f64,
    /// World position of its centre, metres.
    pub position: DVec3,
    /// Unit normal into the block.
    pub normal: DVec3,
}
