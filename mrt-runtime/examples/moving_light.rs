//! A torch walks through the maze, and a game uploads what it changes: a few tiles of the lightmap, no more.
//!
//! `cargo run --release -p mrt-runtime --example moving_light [FOLDER]`

mod common;

use common::picture::Picture;
use common::view::{self, Camera, Shown};
use mrt_runtime::glam::vec3;
use mrt_runtime::{
    AssembleConfig, Dictionary, Frame, FrameConfig, FrameReport, Level, Light, Scene,
};
use std::error::Error;
use std::path::Path;

/// Where the torch is, x and z in metres. The fourth place is inside a wall: players clip, animations overshoot.
const WALK: [[f32; 2]; 6] = [
    [0.6, 0.5],
    [1.5, 0.5],
    [2.4, 0.5],
    [3.4, 0.5],
    [2.5, 1.5],
    [2.5, 2.5],
];

/// Frames between two of these places.
const FRAMES: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Writes one picture of the six places.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
    let level = Level::from_text(include_str!("../../assets/maze.level.toml"))?;
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let config = FrameConfig {
        // Light that changes by less than this, W/m², stays as it is. A game shows no such difference, and once nothing
        // moves, nothing is computed or uploaded any more.
        tolerance: 1e-3,
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    // A lamp that stays, and a torch. Ids stay valid whatever is added or removed later.
    frame.add_light(Light::sphere(vec3(4.5, 0.6, 3.5), 0.1, vec3(0.6, 0.9, 1.6)));
    let torch = frame.add_light(torch_at(WALK[0]));
    let mut texture = Texture::new(&frame);
    let mut pictures = Vec::new();
    for place in WALK {
        frame.set_light(torch, torch_at(place));
        let (mut tiles, mut bytes) = (0, 0);
        for _ in 0..FRAMES {
            let report = frame.solve();
            tiles += report.changed_tiles().len();
            bytes += texture.upload(&frame, &report);
        }
        println!(
            "torch at {place:?}: {tiles} tiles, {} KiB uploaded in {FRAMES} frames; all of it each time: {} KiB",
            bytes / 1024,
            FRAMES * texture.pixels.len() * size_of::<[u16; 4]>() / 1024
        );
        // A light that cannot shine does not stop the others. Its id says whom to tell.
        for skipped in frame.last_report().skipped_lights() {
            assert_eq!(skipped.id, torch);
            println!("  skipped {skipped}");
        }
        let camera = Camera::above([5.0, 4.0], [420, 300]);
        let [x, z] = place;
        let marker = view::torch(vec3(x, 0.6, z));
        pictures.push(view::draw(
            &level,
            &frame,
            camera,
            Shown::DirectAndIndirect,
            marker,
        ));
    }
    let mut report = frame.solve();
    while texture.upload(&frame, &report) > 0 {
        report = frame.solve();
    }
    println!("the torch rests: frames upload nothing");
    Picture::sheet(&pictures, 3).write(out, "moving_light.png", 1.5)
}

fn torch_at([x, z]: [f32; 2]) -> Light {
    Light::sphere(vec3(x, 0.6, z), 0.1, 2.0 * vec3(1.5, 1.0, 0.6))
}

/// Stands for a texture of the GPU, in the format `RGBA16F`.
struct Texture {
    pixels: Vec<[u16; 4]>,
    width: usize,
    /// Memory that each upload uses again.
    staging: Vec<[u16; 4]>,
}

impl Texture {
    fn new(frame: &Frame) -> Self {
        let (width, height) = (frame.lightmap().width(), frame.lightmap().height());
        Self {
            pixels: vec![[0; 4]; width * height],
            width,
            staging: Vec::new(),
        }
    }

    /// Copies the tiles that a frame changed, and returns how many bytes that took.
    fn upload(&mut self, frame: &Frame, report: &FrameReport) -> usize {
        let mut bytes = 0;
        for tile in report.changed_tiles() {
            frame.lightmap().write_rgba16f(tile, &mut self.staging);
            for (row, pixels) in self.staging.chunks_exact(tile.size).enumerate() {
                let first = (tile.y + row) * self.width + tile.x;
                self.pixels[first..][..tile.size].copy_from_slice(pixels);
            }
            bytes += size_of_val(&self.staging[..]);
        }
        bytes
    }
}
