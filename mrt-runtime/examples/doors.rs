//! A door closes, and the light behind it goes.
//!
//! `cargo run --release -p mrt-runtime --example doors [FOLDER]`

mod common;

use common::picture::Picture;
use common::view::{self, Camera, Shown};
use mrt_runtime::blocks::{Connection, Door};
use mrt_runtime::glam::{Vec3, vec3};
use mrt_runtime::{
    AssembleConfig, BlockIndex, Dictionary, Frame, FrameConfig, Level, Light, Scene,
};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Writes one picture: the door open, half open and closed.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
    // Three cells in a row. Shapes, orientations and connections follow from which cells touch.
    let cells = [[0, 0, 0], [1, 0, 0], [2, 0, 0]];
    let mut level = Level::from_cells(&cells, vec3(0.75, 0.68, 0.6))?;
    // A door is a connection that can be closed, here the one between the last two cells. It costs nothing while it
    // stands still, so give one to every opening that may ever close.
    let is_between = |c: &Connection| (c.a.block, c.b.block) == (1, 2);
    let connection = level.connections.iter().position(is_between);
    level.doors.push(Door {
        connection: connection.ok_or("cells 1 and 2 do not touch")?,
        value: 1.0,
    });
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let position = vec3(0.7, 0.6, 0.5);
    frame.add_light(Light::sphere(position, 0.1, vec3(3.0, 2.2, 1.4)));

    let camera = Camera::above([3.0, 1.0], [620, 250]);
    let mut pictures = Vec::new();
    for open in [1.0, 0.5, 0.0] {
        // The door is the first of the level's list: number 0. It lets that share of the light through.
        frame.set_door(0, open)?;
        // Light that has passed before bounces a little longer.
        let mut behind = Vec::new();
        for _ in 0..8 {
            frame.solve();
            behind.push(common::mean_indirect(&frame, BlockIndex::new(2)));
        }
        println!(
            "door {:3.0} % open: indirect light behind it {:.4} W/m² after one frame, {:.4} after eight; before it {:.4}",
            100.0 * open,
            behind[0],
            behind[7],
            common::mean_indirect(&frame, BlockIndex::new(1))
        );
        // Only the picture knows what the door looks like: here it slides across the opening.
        let torch = view::torch(position);
        let door = |eye, direction| {
            let (from, to) = (vec3(1.98, 0.0, open), vec3(2.02, 1.0, 1.0));
            let distance = view::cuboid(eye, direction, from, to)?;
            Some((distance, Vec3::new(0.1, 0.06, 0.03)))
        };
        pictures.push(view::draw(
            &level,
            &frame,
            camera,
            Shown::DirectAndIndirect,
            |eye, direction| view::nearer(torch(eye, direction), door(eye, direction)),
        ));
    }
    Picture::sheet(&pictures, 1).write(out, "doors.png", 0.6)
}
