//! Every example runs, and the pictures that it writes show something.

// Examples have a `main`, which nobody calls here, and each brings the module `common`.
#![allow(dead_code, clippy::duplicate_mod)]

use std::error::Error;
use std::fs;
use std::path::Path;

#[path = "../examples/doors.rs"]
mod doors;
#[path = "../examples/hello_level.rs"]
mod hello_level;
#[path = "../examples/moving_light.rs"]
mod moving_light;
#[path = "../examples/normal_map.rs"]
mod normal_map;
#[path = "../examples/own_shadows.rs"]
mod own_shadows;
#[path = "../examples/probes.rs"]
mod probes;
#[path = "../examples/streaming.rs"]
mod streaming;

/// Runs an example in a folder of its own, and looks at its pictures.
fn shows(example: &str, run: impl FnOnce(&Path) -> Result<(), Box<dyn Error>>, pictures: &[&str]) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(example);
    // Pictures of an earlier run prove nothing.
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("the folder of an earlier run");
    }
    run(&folder).expect("the example runs");
    let written = fs::read_dir(&folder).expect("a folder of pictures");
    assert_eq!(written.count(), pictures.len(), "{example}");
    for name in pictures {
        let picture = image::open(folder.join(name)).expect(name).to_rgb8();
        let bytes = picture.as_raw();
        let mean = bytes.iter().map(|&x| f64::from(x)).sum::<f64>() / bytes.len() as f64;
        let lit = bytes.iter().filter(|&&x| x > 64).count() as f64 / bytes.len() as f64;
        // Neither black nor white, and a tenth of it lit at least.
        assert!((16.0..240.0).contains(&mean), "{name}: mean {mean}");
        assert!(lit > 0.1, "{name}: {lit} of it lit");
    }
}

#[test]
fn hello_level_lights_the_maze() {
    let pictures = ["hello_level.png", "hello_level_lightmap.png"];
    shows("hello_level", hello_level::run, &pictures);
}

#[test]
fn moving_light_goes_on_where_a_light_is_skipped() {
    shows("moving_light", moving_light::run, &["moving_light.png"]);
}

#[test]
fn doors_close() {
    shows("doors", doors::run, &["doors.png"]);
}

#[test]
fn probes_light_a_ball() {
    shows("probes", probes::run, &["probes.png"]);
}

#[test]
fn normal_map_shapes_a_wall() {
    shows("normal_map", normal_map::run, &["normal_map.png"]);
}

#[test]
fn own_shadows_fall() {
    shows("own_shadows", own_shadows::run, &["own_shadows.png"]);
}

#[test]
fn streaming_keeps_light() {
    shows("streaming", streaming::run, &["streaming.png"]);
}
