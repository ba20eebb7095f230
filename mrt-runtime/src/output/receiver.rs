//! Lightmap coordinates of a mesh: which wall of which block a point of the real geometry takes its indirect light from,
//! and where on that wall (Loos et al. 2011, sections 6.2 and 7.2).
//!
//! 1. [`ReceiverMap::new`] sorts a level's blocks by place.
//! 2. [`unwrap_mesh`] finds the wall of each triangle and cuts triangles that reach into several blocks.
//! 3. [`Lightmap::texture_coordinate`](crate::Lightmap::texture_coordinate) takes each [`WallReceiver`] to a texture.
//!
//! The paper gives each vertex the face through which a cube camera in the block's centre sees it, which suits a scene in
//! one block. Joined blocks take the wall that the surface is turned like instead: two blocks side by side then choose the
//! same wall, and light runs on across their common side.

mod block_in_place;
mod blend;
mod cube_camera;
mod lookup;
mod map;
mod trilinear;
mod unwrap;
mod wall_receiver;

pub use blend::{Blend, WeightedReceiver};
pub use map::ReceiverMap;
pub use unwrap::{UnwrappedTriangle, unwrap_mesh};
pub use wall_receiver::WallReceiver;
