//! The mathematics that precomputed light transport methods share: matrices and products,
//! decompositions, spherical harmonics, form factors, sampling, meshes, ray casting and the
//! binary container. Nothing here knows which method uses it.
//!
//! Units: lengths in metres where a unit is needed, angles in radians, irradiance in W/m² per
//! colour channel. Axes are right-handed with +Y up. Bakes use `f64` and only operations whose
//! bits do not depend on the machine; see `docs/CONVENTIONS.md`.

#[cfg(feature = "bvh")]
pub mod bvh;
pub mod container;
pub mod cube;
pub mod cube_symmetry;
pub mod form_factor;
pub mod polygon_moments;
pub mod hexahedron;
pub mod matrix;
pub mod mesh;
pub mod parity;
pub mod radiometry;
pub mod sampling;
pub mod sh;
pub mod ohlsh;
pub mod simd;
pub mod storage;
#[cfg(feature = "svd")]
pub mod svd;
pub mod tube;
