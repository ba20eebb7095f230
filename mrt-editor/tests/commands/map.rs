//! `mrt map`.

use crate::common::{
    assert_failed, assert_refused, bad_meshes, folder_with_room, json, mrt, names, text,
};
use std::fs;

#[test]
fn a_room_becomes_a_level_of_one_block() {
    let folder = folder_with_room();
    let mut arguments = vec!["map", "--scene", "room.obj", "--out", "mapped.toml"];
    arguments.extend(["--fit", "box", "--json"]);
    let report = json(&mrt(&folder, &arguments));
    assert_eq!(report["blocks"], 1);
    let level = fs::read_to_string(folder.path().join("mapped.toml")).expect("written");
    assert!(level.contains("mrt-level"));
    assert_eq!(
        names(folder.path()),
        ["mapped.toml", "room.obj", "room.toml"]
    );
}

#[test]
fn a_mesh_that_cannot_be_mapped_leaves_the_level_as_it_was() {
    let folder = folder_with_room();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("level.toml"), "a level").expect("writable");
    let before = names(folder.path());
    let map = |scene: &str, more: [&str; 2]| {
        let mut arguments = vec!["map", "--scene", scene, "--out", "level.toml"];
        arguments.extend(more);
        mrt(&folder, &arguments)
    };
    for (name, bytes) in bad_meshes() {
        fs::write(file(name), bytes).expect("writable");
        for fit in ["box", "grid"] {
            assert_failed(&map(name, ["--fit", fit]), name);
        }
        fs::remove_file(file(name)).expect("still there");
    }
    assert_refused(&map("missing.obj", ["--fit", "box"]), "missing.obj");
    for faulty in [
        ["--scale", "0"],
        ["--scale", "nan"],
        ["--albedo", "2"],
        ["--cell", "0"],
    ] {
        let output = map("room.obj", faulty);
        assert!(!output.status.success(), "{faulty:?}");
        assert!(!text(&output.stderr).contains("panicked"), "{faulty:?}");
    }
    assert_eq!(names(folder.path()), before);
    assert_eq!(
        fs::read_to_string(file("level.toml")).expect("there"),
        "a level"
    );
}

#[test]
fn a_level_in_a_folder_that_is_not_there_is_refused() {
    let folder = folder_with_room();
    let nowhere = ["map", "--scene", "room.obj", "--out", "nowhere/level.toml"];
    assert_refused(&mrt(&folder, &nowhere), "nowhere");
    assert_eq!(names(folder.path()), ["room.obj", "room.toml"]);
}
