//! The exact reference solver: radiosity in levels of convex blocks that are joined through whole faces.
//!
//! Nothing is sampled between surfaces. Visibility is carried through openings as a cone
//! ([`transport`]), form factors are Lambert's polygon formula, and the only approximation is that each
//! texel sends out one radiosity. Texels lie on wall faces only: block by block, faces in the order of
//! [`Face::ALL`](crate::geometry::cube::Face::ALL), then row v, then column u.
//!
//! Faces that are not planar: visibility takes a block as the convex hull of its eight corners. A texel
//! is the loop of its four corners, and needs neither a plane nor two triangles. The grid lines of a
//! bilinear face are straight, and Lambert's formula depends on the outline alone, so the loop is
//! exact wherever the face does not hide a part of itself. What a face hides of itself is neglected.

mod error;
mod scene;
pub mod quarters;
mod row;
mod gather;
pub mod transport;
pub mod direct;
mod krylov;
pub mod solve;

pub use error::ExactError;
pub use scene::{ExactScene, MAX_TEXELS, Side, Wall};
