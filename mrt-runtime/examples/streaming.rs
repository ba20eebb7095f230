//! Blocks come and go while the game runs: the next scene is assembled on another thread, and light goes on where it was.
//!
//! `cargo run --release -p mrt-runtime --example streaming [FOLDER]`

mod common;

use common::picture::Picture;
use common::view::{self, Camera, Shown};
use mrt_runtime::glam::vec3;
use mrt_runtime::{
    AssembleConfig, BlockIndex, Dictionary, Frame, FrameConfig, Level, Light, Scene,
};
use std::error::Error;
use std::path::Path;

/// Cells in memory at first: a corridor with a bend.
const BEFORE: [&str; 2] = ["####..", "...#.."];

/// Cells in memory later: two are gone and four are new, so that those kept stand at other places in the level's list.
const AFTER: [&str; 3] = ["..##..", "...###", "...##."];

/// Cells that are in both.
const KEPT: [[i32; 3]; 3] = [[2, 0, 0], [3, 0, 0], [3, 0, 1]];

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Writes one picture: before the change, right after it, and when the light of the new cells has settled.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
    let (before, after) = (common::cells(&BEFORE), common::cells(&AFTER));
    let albedo = vec3(0.72, 0.66, 0.6);
    let level = Level::from_cells(&before, albedo)?;
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let position = vec3(2.6, 0.6, 0.5);
    let torch = frame.add_light(Light::sphere(position, 0.1, vec3(3.0, 2.2, 1.4)));
    for _ in 0..12 {
        frame.solve();
    }
    // Where a cell stands in a list, and the light there. Cell (2, 0) loses an opening, and (3, 1) gains two.
    let block = |cells: &[[i32; 3]], cell| {
        let place = cells.iter().position(|c| *c == cell);
        place.map(BlockIndex::new)
    };
    let light = |frame: &Frame, cells: &[[i32; 3]]| {
        KEPT.map(|cell| block(cells, cell).map_or(0.0, |at| common::mean_indirect(frame, at)))
    };
    println!(
        "indirect light of kept cells, W/m²: {:.2?} before",
        light(&frame, &before)
    );
    let camera = Camera::above([6.0, 3.0], [420, 260]);
    let torch_ball = view::torch(position);
    let draw = |level: &Level, frame: &Frame| {
        view::draw(level, frame, camera, Shown::DirectAndIndirect, &torch_ball)
    };
    let mut pictures = vec![draw(&level, &frame)];

    // Assembly takes milliseconds to seconds, by the size of the level. Meanwhile the game shows frames of the old scene.
    let mut frames = 0;
    let (level, scene) = std::thread::scope(|scope| {
        let loading = scope.spawn(|| {
            let level = Level::from_cells(&after, albedo)?;
            let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
            Ok::<_, Box<dyn Error + Send + Sync>>((level, scene))
        });
        while !loading.is_finished() {
            frame.solve();
            frames += 1;
        }
        loading.join().expect("assembly does not panic")
    })
    .map_err(|error| error.to_string())?;
    println!("{frames} frames were shown while the next scene was assembled");

    // For each block of the new scene: which block of the old one it was. Light goes on from there, on all walls that are
    // still there; new blocks are dark.
    frame.change_scene(&scene, |new| block(&before, after[new.get()]));
    // The lightmap has another size now: make a new texture, cleared to black, and upload all that changes.
    let report = frame.solve();
    println!(
        "{:.2?} in the first frame of the new scene, {} tiles to upload",
        light(&frame, &after),
        report.changed_tiles().len()
    );
    // Ids of lights are what they were.
    assert!(frame.light(torch).is_some() && report.skipped_lights().is_empty());
    pictures.push(draw(&level, &frame));
    for _ in 0..12 {
        frame.solve();
    }
    println!("{:.2?} when all has settled", light(&frame, &after));
    pictures.push(draw(&level, &frame));
    Picture::sheet(&pictures, 3).write(out, "streaming.png", 0.9)
}
