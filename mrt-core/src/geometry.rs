//! Shapes: the unit cube, its symmetries and warps, round tubes, form factors of polygons, and triangle
//! meshes.

pub mod cube;
pub mod cube_symmetry;
pub mod texel_permutation;
pub mod hexahedron;
pub mod polar_decomposition;
pub mod tube;
pub mod form_factor;
pub mod polygon_moments;
pub mod mesh;
#[cfg(feature = "bvh")]
pub mod bvh;
