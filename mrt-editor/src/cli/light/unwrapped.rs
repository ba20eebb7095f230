//! The mesh that is written.

use glam::DVec3;
use mrt_runtime::low_level::output::receiver::UnwrappedTriangle;

/// The mesh with its lightmap coordinates.
pub(super) struct Unwrapped<'a> {
    pub(super) triangles: &'a [UnwrappedTriangle],
    /// Where the level's origin is in the mesh, metres.
    pub(super) origin: DVec3,
}
