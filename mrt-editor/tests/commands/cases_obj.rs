//! OBJ files after public bug reports, with what is right for each.

use crate::common::{case, folder, json, mrt, text};
use glam::{DVec3, Vec3};
use mrt_runtime::Level;
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

/// Maps `scene`; returns the report and the level.
fn map(folder: &TempDir, scene: &str, more: &[&str]) -> (Value, Level) {
    let mut arguments = vec!["map", "--scene", scene, "--out", "level.toml", "--json"];
    arguments.extend(more);
    let report = json(&mrt(folder, &arguments));
    let text = fs::read_to_string(folder.path().join("level.toml")).expect("written");
    (report, Level::from_text(&text).expect("a level"))
}

/// The scene is the room of 4 x 3 x 4 m that many cases share, alone in one closed block.
fn assert_is_the_room(report: &Value, level: &Level) {
    assert_eq!(report["mesh"]["triangles"], 12);
    assert_eq!(report["mesh"]["size_m"], serde_json::json!([4.0, 3.0, 4.0]));
    assert_eq!(report["mesh"]["degenerate_triangles"], 0);
    assert_eq!(report["shapes"]["closed"], 1);
    // A sum of products of small whole numbers, so hardly rounded.
    let inside = report["area_share"]["inside"].as_f64();
    assert!(
        inside.is_some_and(|share| (share - 1.0).abs() < 1e-6),
        "{inside:?}"
    );
    let [block] = &level.blocks[..] else {
        panic!("{level:?}");
    };
    let low = block.warp.corners.into_iter().reduce(DVec3::min);
    let high = block.warp.corners.into_iter().reduce(DVec3::max);
    assert_eq!(
        [low, high],
        [Some(DVec3::ZERO), Some(DVec3::new(4.0, 3.0, 4.0))]
    );
}

#[cfg_attr(not(has_cases), ignore = "needs shared/cases")]
#[test]
fn a_wall_with_a_doorway_is_one_polygon() {
    // Means of the same surface told in quads; the case allows 5 %.
    const VIEWS: [[f64; 2]; 2] = [[0.2170, 0.3557], [0.1568, 0.2972]];
    for name in ["doorway.obj", "doorway-triangulated.obj"] {
        let folder = folder();
        let scene = case(&format!("01-ngon-doorway/{name}"));
        let (report, _) = map(&folder, &scene, &[]);
        assert_eq!(report["mesh"]["triangles"], 40, "{name}");
        assert_eq!(report["blocks"], 2, "{name}");
        assert_eq!(report["connections"], 1, "{name}");
        let mut arguments = vec!["light", "--scene", &scene, "--level", "level.toml"];
        arguments.extend(["--light", "1,2,2,20", "--camera", "0.3,1.6,2;4,1.2,2"]);
        arguments.extend(["--camera", "8,1.6,2;4,1.2,2", "--exposure", "0"]);
        arguments.extend(["--size", "160x90", "--out", "out", "--json"]);
        let report = json(&mrt(&folder, &arguments));
        for (view, wanted) in VIEWS.iter().enumerate() {
            for (light, wanted) in ["direct", "indirect"].iter().zip(wanted) {
                let found = report["views"][view][light].as_f64().unwrap_or_default();
                let is_near = (found / wanted - 1.0).abs() < 0.05;
                assert!(is_near, "{name}, view {view}, {light}: {found}, {wanted}");
            }
        }
    }
}

#[cfg_attr(not(has_cases), ignore = "needs shared/cases")]
#[test]
fn wrapped_lines_and_foreign_encodings_are_read() {
    for name in [
        "02-line-continuation/room-all.obj",
        "02-line-continuation/room-faces.obj",
        "03-encoding/latin1-comment.obj",
        "03-encoding/bom-first-vertex.obj",
    ] {
        let (report, level) = map(&folder(), &case(name), &[]);
        assert_is_the_room(&report, &level);
    }
}

#[cfg_attr(not(has_cases), ignore = "needs shared/cases")]
#[test]
fn material_libraries_are_found() {
    for name in [
        "two-libraries.obj",
        "library-last.obj",
        "comment-in-mtl.obj",
    ] {
        let scene = case(&format!("04-mtllib/{name}"));
        let (report, level) = map(&folder(), &scene, &["--fit", "box"]);
        assert_eq!(report["mesh"]["made_up_albedos"], 0, "{name}");
        let red = [Vec3::new(0.8, 0.1, 0.1); 6];
        assert_eq!(level.blocks[0].albedo, red, "{name}");
    }
    let scene = case("04-mtllib/missing-library.obj");
    let (report, level) = map(&folder(), &scene, &["--fit", "box"]);
    assert_eq!(report["mesh"]["made_up_albedos"], 1);
    let made_up = level.blocks[0].albedo[0];
    assert!(made_up.min_element() >= 0.47 && made_up.max_element() <= 0.59);
}

#[cfg_attr(not(has_cases), ignore = "needs shared/cases")]
#[test]
fn what_c_runtimes_print_for_nan_is_not_finite() {
    let scene = case("18-nan-spellings/room.obj");
    let (report, level) = map(&folder(), &scene, &["--fit", "box"]);
    assert_is_the_room(&report, &level);
    assert_eq!(report["mesh"]["not_finite_triangles"], 1);
}

#[cfg(unix)]
#[cfg_attr(not(has_cases), ignore = "needs shared/cases")]
#[test]
fn a_pipe_as_a_library_is_not_waited_for() {
    let folder = folder();
    let scene = folder.path().join("fifo.obj");
    fs::copy(case("20-hostile/fifo.obj"), &scene).expect("copies");
    let made = std::process::Command::new("mkfifo")
        .arg(folder.path().join("fifo"))
        .status();
    assert!(made.expect("mkfifo starts").success());
    // Its only triangle encloses no room. So the mesh has been read when `map` says that it finds none.
    let output = mrt(&folder, &["map", "--scene", "fifo.obj", "--out", "a.toml"]);
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(!error.contains("panicked"), "{error}");
    assert!(error.contains("library fifo is no regular file"), "{error}");
}
