//! A wall with a normal map: vector irradiance gives the light of every texel for any normal.
//!
//! `cargo run --release -p mrt-runtime --example normal_map [FOLDER]`

mod common;

use common::picture::Picture;
use mrt_runtime::blocks::Face;
use mrt_runtime::glam::{Vec3, vec3};
use mrt_runtime::{
    AssembleConfig, BlockIndex, Dictionary, Frame, FrameConfig, Level, Light, Outputs, Scene,
};
use std::error::Error;
use std::f32::consts::PI;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Writes one picture of indirect light on a wall: flat, and with bricks in its normal map.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    // Only dictionaries that were baked with `mrt bake --vector` have vector irradiance. This one, with `--preset mobile
    // --storage f16` too, is coarse and small: 5 x 5 texels a wall.
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/mobile-vector.mrt"))?;
    let mut level = Level::from_cells(&[[0, 0, 0], [1, 0, 0], [2, 0, 0]], vec3(0.7, 0.68, 0.64))?;
    level.blocks[0].albedo[Face::NegX.index()] = vec3(0.75, 0.3, 0.15);
    level.blocks[2].albedo[Face::PosX.index()] = vec3(0.2, 0.35, 0.75);
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let config = FrameConfig {
        outputs: Outputs {
            vector: true,
            ..Outputs::default()
        },
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    frame.add_light(Light::sphere(vec3(0.4, 0.5, 0.5), 0.3, vec3(4.0, 3.4, 2.8)));
    frame.add_light(Light::sphere(vec3(2.7, 0.7, 0.5), 0.3, vec3(1.0, 1.1, 1.3)));
    for _ in 0..8 {
        frame.solve();
    }

    // Normals are in the frame of the wall: along u, along v, and out of the wall.
    let flat = light_on_wall(&frame, |_, _| Vec3::Z);
    let bumpy = light_on_wall(&frame, common::brick_normal);
    for (u, side) in [(0.05, "left"), (0.95, "right")] {
        let lit = |normal| at(&frame, [u, 0.5], normal).element_sum() / 3.0;
        println!(
            "{side} end of the wall: {:.3} W/m² on the flat wall, {:.3} on a stone's left side, {:.3} on its right side",
            lit(Vec3::Z),
            lit(vec3(-0.6, 0.0, 0.8)),
            lit(vec3(0.6, 0.0, 0.8))
        );
    }
    println!(
        "a texel takes {} numbers a channel",
        frame.vector().len() / (3 * scene.texel_count())
    );
    Picture::sheet(&[flat, bumpy], 2).write(out, "normal_map.png", 0.7)
}

/// The wall that a visitor of the middle block has to the left, under indirect light.
fn light_on_wall(frame: &Frame, normal: impl Fn(f32, f32) -> Vec3) -> Picture {
    const SIZE: usize = 420;
    let unit = |pixel: f32| pixel / SIZE as f32;
    Picture::new(SIZE, SIZE, |x, y| {
        let (u, v) = (unit(x), 1.0 - unit(y));
        0.7 / PI * at(frame, [u, v], normal(u, v))
    })
}

/// Indirect irradiance at a point of the wall for a normal, between the four nearest texels. A shader has the coefficients
/// in four textures, which the GPU interpolates, and multiplies them with the normal.
fn at(frame: &Frame, [u, v]: [f32; 2], normal: Vec3) -> Vec3 {
    let scene = frame.scene();
    let block = BlockIndex::new(1);
    common::bilinear(scene.resolution(), [u, v], |row, column| {
        let texel = scene.texel(block, Face::NegZ, row, column);
        let light = texel.and_then(|texel| frame.vector_at(block, texel, normal));
        light.unwrap_or(Vec3::ZERO)
    })
}
