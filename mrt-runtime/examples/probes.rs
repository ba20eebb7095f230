//! A ball walks through the maze, and takes its light from probes: what moves has no place in a lightmap.
//!
//! `cargo run --release -p mrt-runtime --example probes [FOLDER]`

mod common;

use common::view::{self, Camera, Shown};
use mrt_runtime::glam::{Vec3, vec3};
use mrt_runtime::{
    AssembleConfig, Dictionary, Frame, FrameConfig, Level, Light, Outputs, ProbeOrder, Scene,
};
use std::error::Error;
use std::f32::consts::PI;
use std::path::Path;

/// Metres.
const RADIUS: f32 = 0.2;

/// Where the ball is, x and z in metres.
const WALK: [[f32; 2]; 10] = [
    [0.5, 0.5],
    [1.2, 0.5],
    [1.9, 0.5],
    [2.5, 0.8],
    [2.5, 2.3],
    [2.3, 3.5],
    [3.2, 3.5],
    [4.3, 3.5],
    [4.5, 2.6],
    [4.5, 1.6],
];

fn main() -> Result<(), Box<dyn Error>> {
    run(&common::folder())
}

/// Writes one picture, of the ball at all its places and of indirect light alone.
pub fn run(out: &Path) -> Result<(), Box<dyn Error>> {
    let dictionary = Dictionary::from_bytes(include_bytes!("../../assets/cubes-2d-standard.mrt"))?;
    let level = Level::from_text(include_str!("../../assets/maze.level.toml"))?;
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let config = FrameConfig {
        outputs: Outputs {
            // Nine coefficients a probe. `L1` has four, and takes less than half of the memory.
            probes: Some(ProbeOrder::L2),
            ..Outputs::default()
        },
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    let position = vec3(2.5, 0.75, 1.5);
    frame.add_light(Light::sphere(position, 0.1, vec3(6.0, 5.0, 4.0)));
    for _ in 0..8 {
        frame.solve();
    }
    let probes = frame
        .probes()
        .ok_or("the dictionary was baked without probes")?;
    println!(
        "{} probes of {} coefficients",
        level.blocks.len() * probes.per_axis().pow(3),
        probes.order().coefficients()
    );

    let center = |[x, z]: [f32; 2]| vec3(x, 0.3, z);
    for place in WALK {
        // Any point of the level, any normal. The light is that of the walls around, in their colours.
        let towards = |normal| frame.irradiance_at(center(place), normal);
        let (Some(left), Some(right), Some(up)) =
            (towards(Vec3::NEG_X), towards(Vec3::X), towards(Vec3::Y))
        else {
            return Err("the ball left the level".into());
        };
        println!(
            "ball at {place:?}: light from the left {left:.3}, from the right {right:.3}, from above {up:.3} W/m²"
        );
    }
    // Outside there is no light to give: a game then keeps the last it had.
    assert_eq!(frame.irradiance_at(vec3(3.5, 0.5, 0.5), Vec3::Y), None);

    let ball = |eye: Vec3, direction: Vec3| {
        let balls = WALK.iter().filter_map(|&place| {
            let distance = view::ball(eye, direction, center(place), RADIUS)?;
            Some((distance, center(place)))
        });
        let (distance, center) = balls.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        // A shader does the same for each pixel of a mover: its light for its normal, reflected by white paint.
        let normal = (eye + distance * direction - center) / RADIUS;
        Some((distance, 0.8 / PI * frame.irradiance_at(center, normal)?))
    };
    let torch = view::torch(position);
    let camera = Camera::above([5.0, 4.0], [840, 600]);
    let picture = view::draw(&level, &frame, camera, Shown::Indirect, |eye, direction| {
        view::nearer(torch(eye, direction), ball(eye, direction))
    });
    picture.write(out, "probes.png", 1.8)
}
