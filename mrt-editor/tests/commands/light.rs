//! `mrt light`.

use crate::common::{
    ROOM_LEVEL, assert_failed, assert_refused, bad_meshes, folder_with_room, json, mrt, names, text,
};
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// Lights `scene` in `level` with small pictures, into the folder `out`.
fn light(folder: &TempDir, scene: &str, level: &str, more: &[&str]) -> Output {
    let mut arguments = vec!["light", "--scene", scene, "--level", level];
    arguments.extend(["--out", "out", "--size", "48x27", "--json"]);
    arguments.extend(more);
    mrt(folder, &arguments)
}

fn assert_nothing_written(folder: &TempDir) {
    assert_eq!(names(folder.path()), ["room.obj", "room.toml"]);
}

#[test]
fn a_lit_room_leaves_pictures_lightmap_and_mesh() {
    let folder = folder_with_room();
    let lamp = ["--light", "1,1.2,0.8,5"];
    let report = json(&light(&folder, "room.obj", "room.toml", &lamp));
    assert_eq!(report["blocks"], 1);
    let written = names(&folder.path().join("out"));
    for expected in ["lightmap.hdr", "lightmap.png", "mesh.mtl", "mesh.obj"] {
        assert!(written.iter().any(|name| name == expected), "{written:?}");
    }
    assert_eq!(names(folder.path()), ["out", "room.obj", "room.toml"]);
}

#[test]
fn meshes_that_cannot_be_read_leave_nothing() {
    let folder = folder_with_room();
    for (name, bytes) in bad_meshes() {
        fs::write(folder.path().join(name), bytes).expect("writable");
        assert_failed(&light(&folder, name, "room.toml", &[]), name);
        fs::remove_file(folder.path().join(name)).expect("still there");
        assert_nothing_written(&folder);
    }
    let missing = light(&folder, "missing.obj", "room.toml", &[]);
    assert_refused(&missing, "missing.obj");
    assert_nothing_written(&folder);
}

#[test]
fn files_that_are_no_level_leave_nothing() {
    let folder = folder_with_room();
    let truncated = &ROOM_LEVEL.as_bytes()[..ROOM_LEVEL.len() - 20];
    for (name, content) in [
        ("empty.toml", &b""[..]),
        ("binary.toml", &[0xff; 100]),
        ("truncated.toml", truncated),
        ("foreign.toml", b"format = \"other\"\nversion = 1\n"),
    ] {
        fs::write(folder.path().join(name), content).expect("writable");
        let output = light(&folder, "room.obj", name, &[]);
        assert_failed(&output, name);
        let error = text(&output.stderr);
        assert!(error.contains(name), "{error}");
        fs::remove_file(folder.path().join(name)).expect("still there");
        assert_nothing_written(&folder);
    }
    let missing = light(&folder, "room.obj", "missing.toml", &[]);
    assert_refused(&missing, "missing.toml");
    assert_nothing_written(&folder);
}

#[test]
fn faulty_flags_leave_nothing() {
    let folder = folder_with_room();
    for (faulty, what) in [
        (["--dictionary", "room.obj"], "a mesh as a dictionary"),
        (["--preset", "ultra"], "an unknown preset"),
        (["--light", "9,1,1,5"], "a light outside"),
        (["--light", "1,1,1,nan"], "an intensity that is no number"),
        (["--camera", "1,1,1;1,1,1"], "a camera that looks at itself"),
    ] {
        assert_failed(&light(&folder, "room.obj", "room.toml", &faulty), what);
        assert_nothing_written(&folder);
    }
}
