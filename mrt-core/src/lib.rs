//! The mathematics that precomputed light transport methods share. Nothing here knows which method uses
//! it.
//!
//! Units: lengths in metres where a unit is needed, angles in radians, irradiance in W/m² per colour
//! channel. Axes are right-handed with +Y up. Bakes use `f64` and only operations whose bits do not depend
//! on the machine; see `docs/CONVENTIONS.md`.
//!
//! Features: `svd` adds decompositions to `linalg`, `bvh` adds `geometry::bvh`, and `reference` adds `reference`. A
//! running game needs none of them.

pub mod excerpt;
pub mod linalg;
pub mod geometry;
pub mod lighting;
pub mod simd;
pub mod storage;
pub mod container;
#[cfg(feature = "reference")]
pub mod reference;
