//! The first lesson: from a dictionary and a level to a lightmap.
//!
//! `cargo run --release -p mrt-runtime --example hello_level [FOLDER]`

mod common;

use common::picture::Picture;
use common::view::{self, Camera, Shown};
use mrt_runtime::glam::vec3;
use mrt_runtime::{
    AssembleConfig, BlockIndex, Dictionary, Frame, FrameConfig, Level, Light, Scene,
};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Lights the maze and writes two pictures into a folder.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    // 1. The dictionary says how light bounces in each canonical shape. The tool `mrt bake` made it; it knows no level,
    //    so one file serves a whole game.
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;

    // 2. The level says which shapes stand where, which openings join them, and what colour walls have.
    let level = Level::from_text(include_str!("../../assets/maze.level.toml"))?;

    // 3. The scene joins both. Do this when a level is loaded; it takes milliseconds, and needs no tracing of rays.
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;

    // 4. The frame keeps the lights, and the light that they give.
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let position = vec3(2.5, 0.6, 1.5);
    frame.add_light(Light::sphere(position, 0.1, vec3(3.0, 2.4, 1.6)));

    // 5. Each call is a frame of the game. Each adds a bounce to the light of the frame before, so that a light which is
    //    switched on reaches full brightness within some frames.
    for count in 1..=8 {
        let report = frame.solve();
        assert_eq!(report.skipped_lights(), [], "the torch is in the level");
        println!(
            "frame {count}: indirect light of {:.3} W/m² near the torch, {:.3} W/m² in the far corner",
            common::mean_indirect(&frame, BlockIndex::new(3)),
            common::mean_indirect(&frame, BlockIndex::new(0)),
        );
    }

    // 6. The lightmap is one small texture for the whole level. This is what a game uploads and samples.
    let lightmap = frame.lightmap();
    println!(
        "the lightmap has {} x {} pixels for {} blocks",
        lightmap.width(),
        lightmap.height(),
        level.blocks.len()
    );
    Picture::of_lightmap(&lightmap, 5).write(out, "hello_level_lightmap.png", 0.5)?;

    // The level with that lightmap, seen from above.
    let camera = Camera::above([5.0, 4.0], [840, 560]);
    let picture = view::draw(
        &level,
        &frame,
        camera,
        Shown::DirectAndIndirect,
        view::torch(position),
    );
    picture.write(out, "hello_level.png", 1.5)
}
