//! What the examples share and a game has of its own: a folder for pictures, a camera, and a way to write PNG files.

// Each example uses a part.
#![allow(dead_code)]

pub mod picture;
pub mod view;

use mrt_runtime::glam::Vec3;
use mrt_runtime::{BlockIndex, Frame};
use std::path::PathBuf;

/// Where an example writes its pictures: the folder given as the first argument, or `mrt-examples`.
pub fn folder() -> PathBuf {
    let argument = std::env::args_os().nth(1);
    argument.map_or_else(|| "mrt-examples".into(), PathBuf::from)
}

/// Mean indirect irradiance over the walls of a block, all channels together, W/m².
pub fn mean_indirect(frame: &Frame, block: BlockIndex) -> f32 {
    let texels = (0..).map_while(|texel| frame.indirect_at(block, texel));
    let (count, sum) = texels.fold((0, Vec3::ZERO), |(count, sum), e| (count + 1, sum + e));
    sum.element_sum() / (3 * count) as f32
}
