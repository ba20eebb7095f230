//! A torch walks through the maze, and a game uploads what it changes: a few tiles of the lightmap, no more.
//!
//! `cargo run --release -p mrt-runtime --example moving_light [FOLDER]`

mod common;

use common::picture::Picture;
use common::view::{self, Camera, Shown};
use mrt_runtime::glam::vec3;
use mrt_runtime::{AssembleConfig, Dictionary, Frame, FrameConfig, Level, Light, Scene};
use std::error::Error;
use std::path::Path;

/// A floor plan: one cell of the level for each `#`.
const PLAN: [&str; 7] = [
    "#######.###",
    "#.....#.#.#",
    "#.###.###.#",
    "#.#.#...#.#",
    "#.#.#####.#",
    "#.#.......#",
    "###.#######",
];

/// Where the torch is, x and z in metres. The fourth place is inside a wall: players clip, animations overshoot.
const WALK: [[f32; 2]; 6] = [
    [1.5, 0.5],
    [4.0, 0.5],
    [6.4, 0.5],
    [7.4, 0.5],
    [6.5, 2.3],
    [8.5, 2.6],
];

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Writes one picture of the six places.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
    let level = Level::from_cells(&common::cells(&PLAN), vec3(0.72, 0.66, 0.58))?;
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let config = FrameConfig {
        // Light that changes by less than this, W/m², stays as it is: no game shows it. Far from the torch nothing is computed
        // or uploaded then, and nothing anywhere once it rests.
        tolerance: 0.004,
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    // A lamp that stays, and a torch. Ids stay valid whatever is added or removed later.
    frame.add_light(Light::sphere(vec3(4.5, 0.6, 6.5), 0.1, vec3(0.6, 0.9, 1.6)));
    let torch = frame.add_light(torch_at(WALK[0]));
    let whole = 8 * frame.lightmap().pixels().len();
    // Memory that each upload uses again.
    let mut staging = Vec::new();
    let mut pictures = Vec::new();
    const FRAMES: usize = 8;
    for place in WALK {
        frame.set_light(torch, torch_at(place));
        let (mut tiles, mut bytes) = (0, 0);
        for _ in 0..FRAMES {
            let report = frame.solve();
            for tile in report.changed_tiles() {
                // Pixels as textures of the format RGBA16F take them. A game now copies them to the square of `tile.size`
                // pixels at (`tile.x`, `tile.y`) of its texture.
                frame.lightmap().write_rgba16f(tile, &mut staging);
                tiles += 1;
                bytes += size_of_val(&staging[..]);
            }
        }
        println!(
            "torch at {place:?}: {} tiles, {} KiB a frame; the whole lightmap has {} KiB",
            tiles / FRAMES,
            bytes / FRAMES / 1024,
            whole / 1024
        );
        // A light that cannot shine stops no other. Its id says which one it was.
        for skipped in frame.last_report().skipped_lights() {
            assert_eq!(skipped.id, torch);
            println!("  skipped {skipped}");
        }
        let marker = view::torch(vec3(place[0], 0.6, place[1]));
        let camera = Camera::above([11.0, 7.0], [460, 290]);
        let shown = Shown::DirectAndIndirect;
        pictures.push(view::draw(&level, &frame, camera, shown, marker));
    }
    let mut uploads = 0;
    while frame.solve().changed_tiles().len() > 0 {
        uploads += 1;
    }
    println!("the torch rests: {uploads} more frames have something to upload, then none");
    Picture::sheet(&pictures, 3).write(out, "moving_light.png", 1.5)
}

fn torch_at([x, z]: [f32; 2]) -> Light {
    Light::sphere(vec3(x, 0.6, z), 0.1, vec3(3.0, 2.0, 1.2))
}
