//! One frame of the built-in maze with one lamp, as a number that a web page and a native program both compute.

use mrt_runtime::glam::{DVec3, Vec3};
use mrt_runtime::{AssembleConfig, Bounces, Dictionary, Frame, FrameConfig, Level, Light, Scene};

/// Mean of all channels and pixels of the lightmap, W/m².
///
/// # Panics
/// If the built-in files are damaged or do not fit each other.
// SAFETY: no other function of the module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn mean_of_lightmap() -> f64 {
    let dictionary =
        Dictionary::from_bytes(include_bytes!("../../../assets/cubes-2d-standard.mrt"))
            .expect("the built-in dictionary is sound");
    let level = Level::from_text(include_str!("../../../assets/maze.level.toml"))
        .expect("the built-in maze is sound");
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())
        .expect("the dictionary has the shapes of the maze");
    let mut frame = Frame::new(&scene, FrameConfig::default());
    frame.set_bounces(Bounces::Count(4));
    // Off the middle of the block: from there the edges of shadows run through centres of texels, which rounding then
    // lights or not.
    let position = level.blocks[0].warp.point(DVec3::new(0.57, 0.61, 0.37));
    frame.add_light(Light::sphere(
        position.as_vec3(),
        0.1,
        Vec3::new(3.0, 2.0, 1.0),
    ));
    let report = frame.solve();
    assert!(
        report.skipped_lights().is_empty(),
        "the lamp is inside the first block"
    );
    let channels = frame.lightmap().pixels().as_flattened();
    channels.iter().map(|&e| f64::from(e)).sum::<f64>() / channels.len() as f64
}
