//! Levels, as a designer edits them: canonical shapes, blocks that are warped copies of shapes, and openings that join
//! blocks.

pub mod block_index;
pub mod shape;
pub mod wall_point;
pub mod wall;
pub mod unit_from_world;
pub mod mirrors;
pub mod warp_transport;
pub mod mesh_reading;
pub mod block;
pub mod cells;
pub mod error;
pub mod warp_form;
pub mod placed;
pub(crate) mod block_grid;
mod box_pairs;
mod overlap;
mod check;
#[cfg(feature = "generator")]
pub mod generator;
#[cfg(feature = "text")]
pub mod text;
