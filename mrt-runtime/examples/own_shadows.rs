//! A pillar in a room throws shadows of direct light: the game casts the rays, and says when they may change.
//!
//! `cargo run --release -p mrt-runtime --example own_shadows [FOLDER]`

mod common;

use common::picture::Picture;
use common::view::{self, Camera, Shown};
use mrt_runtime::glam::{DVec3, Vec3, vec3};
use mrt_runtime::shadows::{Rays, Versioned};
use mrt_runtime::{
    AssembleConfig, BlockIndex, Dictionary, Frame, FrameConfig, Level, Light, Scene,
};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// A pillar from the floor to the ceiling.
#[derive(Clone, Copy)]
struct Pillar {
    x: f32,
    z: f32,
}

impl Pillar {
    fn corners(self) -> (Vec3, Vec3) {
        let at = |y, side| vec3(self.x + side, y, self.z + side);
        (at(0.0, -0.15), at(1.0, 0.15))
    }

    /// How much light goes from one point to another: all or nothing here, between them for glass or leaves.
    fn passes(self, from: DVec3, to: DVec3) -> f32 {
        let (from, to) = (from.as_vec3(), to.as_vec3());
        let (low, high) = self.corners();
        match view::cuboid(from, to - from, low, high) {
            Some(distance) if distance < 1.0 => 0.0,
            _ => 1.0,
        }
    }
}

/// Writes one picture: without the pillar, and with it at two places.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
    // One room of three by two cells.
    let cells = [0, 1, 2].map(|x| [[x, 0, 0], [x, 0, 1]]);
    let mut level = Level::from_cells(cells.as_flattened(), Vec3::splat(0.7))?;
    level.blocks[0].albedo[0] = vec3(0.7, 0.12, 0.08);
    level.blocks[1].albedo[0] = vec3(0.7, 0.12, 0.08);
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let position = vec3(0.7, 0.6, 1.2);
    frame.add_light(Light::sphere(position, 0.1, vec3(4.0, 3.4, 2.6)));

    let places = [
        None,
        Some(Pillar { x: 1.4, z: 1.0 }),
        Some(Pillar { x: 1.1, z: 0.6 }),
    ];
    let camera = Camera::above([3.0, 2.0], [480, 360]);
    let mut pictures = Vec::new();
    for (version, pillar) in (0..).zip(places) {
        // Each texel of a lit block asks for each light. As long as `version` stays the same, the answers of the frame
        // before hold, and nothing is asked. Without `Versioned`, every frame asks for everything.
        //
        // The function decides alone. Inside one room no wall is in the way; where there are several, trace them too.
        let shadows = Versioned {
            visibility: Rays(|from, to| pillar.map_or(1.0, |pillar| pillar.passes(from, to))),
            version,
        };
        let asked: Vec<usize> = (0..8)
            .map(|_| frame.solve_with(&shadows).work().direct)
            .collect();
        println!(
            "pillar {version}: blocks that asked in each frame {asked:?}; indirect light in the far corner {:.4} W/m²",
            common::mean_indirect(&frame, BlockIndex::new(5))
        );
        let torch = view::torch(position);
        let column = |eye, direction| {
            let (low, high) = pillar?.corners();
            let distance = view::cuboid(eye, direction, low, high)?;
            Some((distance, Vec3::splat(0.1)))
        };
        pictures.push(view::draw(
            &level,
            &frame,
            camera,
            Shown::DirectAndIndirect,
            |eye, direction| view::nearer(torch(eye, direction), column(eye, direction)),
        ));
    }
    Picture::sheet(&pictures, 3).write(out, "own_shadows.png", 0.6)
}
