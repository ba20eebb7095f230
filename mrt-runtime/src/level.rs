//! What a designer edits: canonical shapes, blocks that are warped copies of them, and the openings that join blocks.

pub mod shape;
pub mod wall;
pub mod mirrors;
pub mod block;
pub mod text;
pub mod maze;
pub mod warp_form;
mod overlap;
