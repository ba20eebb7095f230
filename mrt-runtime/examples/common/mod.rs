//! What the examples share and a game has of its own: a folder for pictures, a camera, and a way to write PNG files.

// Each example uses a part.
#![allow(dead_code)]

pub mod picture;
pub mod view;

use mrt_runtime::glam::{Vec3, vec3};
use mrt_runtime::{BlockIndex, Frame};
use std::path::PathBuf;

/// Where an example writes its pictures: the folder given as the first argument, or `mrt-examples`.
pub fn folder() -> PathBuf {
    let argument = std::env::args_os().nth(1);
    argument.map_or_else(|| "mrt-examples".into(), PathBuf::from)
}

/// Cells of a floor plan, x to the right and z down: one for each `#`.
pub fn cells(plan: &[&str]) -> Vec<[i32; 3]> {
    let rows = (0..).zip(plan);
    let cells = rows.flat_map(|(z, row)| (0..).zip(row.bytes()).map(move |(x, c)| (c, [x, 0, z])));
    cells
        .filter(|(c, _)| *c == b'#')
        .map(|(_, cell)| cell)
        .collect()
}

/// Mean indirect irradiance over the walls of a block, all channels together, W/m².
pub fn mean_indirect(frame: &Frame, block: BlockIndex) -> f32 {
    let texels = (0..).map_while(|texel| frame.indirect_at(block, texel));
    let (count, sum) = texels.fold((0, Vec3::ZERO), |(count, sum), e| (count + 1, sum + e));
    sum.element_sum() / (3 * count) as f32
}

/// A value between the four nearest texels of a wall of `size`² texels, at (u, v) in [0, 1]².
pub fn bilinear(size: usize, [u, v]: [f32; 2], texel: impl Fn(usize, usize) -> Vec3) -> Vec3 {
    let place = |x: f32| (x * size as f32 - 0.5).clamp(0.0, size as f32 - 1.0);
    let (x, y) = (place(u), place(v));
    let (column, row) = (x as usize, y as usize);
    let (right, up) = ((column + 1).min(size - 1), (row + 1).min(size - 1));
    let low = texel(row, column).lerp(texel(row, right), x.fract());
    let high = texel(up, column).lerp(texel(up, right), x.fract());
    low.lerp(high, y.fract())
}

/// Stands for a normal map from a file: bricks with round edges. Along u, along v, and out of the wall.
pub fn brick_normal(u: f32, v: f32) -> Vec3 {
    let height = |u: f32, v: f32| {
        let (across, up) = (4.0 * u + 0.5 * ((8.0 * v).floor() % 2.0), 8.0 * v);
        let to_edge = |x: f32| 0.5 - (x.fract() - 0.5).abs();
        let to_joint = (2.0 * to_edge(across)).min(to_edge(up));
        let inside = (to_joint / 0.3).min(1.0);
        let grain =
            (90.0 * u + 3.0 * (31.0 * v).sin()).sin() * (70.0 * v + 2.0 * (43.0 * u).sin()).sin();
        0.03 * (1.0 - (1.0 - inside).powi(2)) + 0.002 * grain
    };
    const STEP: f32 = 1e-3;
    let along_u = (height(u + STEP, v) - height(u - STEP, v)) / (2.0 * STEP);
    let along_v = (height(u, v + STEP) - height(u, v - STEP)) / (2.0 * STEP);
    vec3(-along_u, -along_v, 1.0).normalize()
}
