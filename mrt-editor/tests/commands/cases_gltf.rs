//! `mrt map` on the public cases of glTF.

use crate::common::{self, assert_refused, folder, json, mrt, text};
use serde_json::Value;
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// Runs `mrt map` on a case; the level becomes `l.toml` in `folder`.
fn map(folder: &TempDir, case: &str) -> Output {
    let scene = common::case(case);
    mrt(
        folder,
        &["map", "--scene", &scene, "--out", "l.toml", "--json"],
    )
}

/// The level that `mrt map` makes of a case, and its report.
fn mapped(case: &str) -> (String, Value) {
    let folder = folder();
    let report = json(&map(&folder, case));
    let level = fs::read_to_string(folder.path().join("l.toml")).expect("written");
    (level, report)
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn a_room_becomes_one_closed_block_however_its_file_stores_it() {
    for case in [
        "06-triangle-strips/wall-strip.glb",
        "06-triangle-strips/all-strips.glb",
        "07-required-extensions/basisu.glb",
        "07-required-extensions/quantized-u16.glb",
        "08-gltf-json/embedded.gltf",
        "08-gltf-json/external.gltf",
        "08-gltf-json/empty-second-scene.glb",
    ] {
        let (level, report) = mapped(case);
        assert_eq!(report["blocks"], 1, "{case}: {report}");
        assert_eq!(report["mesh"]["triangles"], 12, "{case}: {report}");
        assert!(level.contains("shape = \"closed\""), "{case}: {level}");
    }
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn mirrors_and_instances_make_the_blocks_that_they_show() {
    let (_, report) = mapped("05-mirrored-node/half-mirrored.glb");
    assert_eq!(report["mesh"]["triangles"], 20, "{report}");
    assert_eq!(
        (&report["blocks"], &report["connections"]),
        (&3.into(), &2.into()),
        "{report}"
    );
    assert_eq!(report["area_share"]["inside"], 1.0, "{report}");
    let (level, report) = mapped("19-ignored-content/instancing.glb");
    assert_eq!(report["blocks"], 2, "{report}");
    assert_eq!(level.matches("shape = \"closed\"").count(), 2, "{level}");
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn what_cannot_be_read_is_refused_in_one_sentence() {
    for (case, subject) in [
        (
            "07-required-extensions/draco.glb",
            "KHR_draco_mesh_compression, which is not supported; export",
        ),
        ("20-hostile/glb-panic-position-index.glb", "accessor 0 of 0"),
        (
            "20-hostile/positions-bomb.glb",
            "at most 50,000,000 positions",
        ),
    ] {
        let folder = folder();
        let output = map(&folder, case);
        assert_refused(&output, subject);
        assert!(!text(&output.stderr).contains("invalid"), "{case}");
    }
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn a_missing_buffer_is_named() {
    let folder = folder();
    let scene = common::case("08-gltf-json/external.gltf");
    fs::copy(scene, folder.path().join("external.gltf")).expect("writable");
    let arguments = ["map", "--scene", "external.gltf", "--out", "l.toml"];
    assert_refused(&mrt(&folder, &arguments), "room data.bin");
}
