//! `mrt bake`.

use crate::common::{assert_refused, folder, json, mrt, names, text};
use std::fs;

#[test]
fn settings_out_of_range_are_refused_and_leave_nothing() {
    let folder = folder();
    for (arguments, subject) in [
        (["--modes", "0"], "number of modes"),
        (["--modes", "100000"], "number of modes"),
        (["--resolution", "0"], "resolution"),
        (["--resolution", "4000000000"], "resolution"),
        (["--lightfield-modes", "0"], "lightfield modes"),
        (["--response-modes", "0"], "response modes"),
        (["--lights-per-axis", "0"], "lights per axis"),
        (["--enrichment", "nan"], "weight"),
        (["--preset", "ultra"], "ultra"),
        (["--set", "pyramids"], "pyramids"),
    ] {
        let mut all = vec!["bake", "--out", "a.mrt"];
        all.extend(arguments);
        assert_refused(&mrt(&folder, &all), subject);
    }
    assert_refused(
        &mrt(&folder, &["bake", "--out", "a.mrt", "--enrichment=-1"]),
        "weight",
    );
    assert!(names(folder.path()).is_empty());
}

/// Flags of a bake of a second or two.
const SMALL_BAKE: [&str; 10] = [
    "bake",
    "--preset",
    "mobile",
    "--resolution",
    "2",
    "--lights-per-axis",
    "2",
    "--lightfield-modes",
    "8",
    "--json",
];

#[test]
fn a_bake_writes_a_whole_file_or_none() {
    let folder = folder();
    let bake = |out: &str| {
        let mut arguments = SMALL_BAKE.to_vec();
        arguments.extend(["--out", out]);
        mrt(&folder, &arguments)
    };
    let output = bake("small.mrt");
    let report = json(&output);
    let length = fs::metadata(folder.path().join("small.mrt"))
        .expect("written")
        .len();
    assert_eq!(report["file_bytes"].as_u64(), Some(length));
    assert_eq!(names(folder.path()), ["small.mrt"]);
    assert_eq!(mrt(&folder, &["info", "small.mrt"]).status.code(), Some(0));

    // A folder that does not exist, a file in place of a folder, a folder in place of the file.
    fs::create_dir(folder.path().join("occupied")).expect("writable");
    for bad in ["missing/a.mrt", "small.mrt/a.mrt", "occupied"] {
        let output = bake(bad);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{bad}: {error}");
        // Progress comes before the message.
        let last = error.lines().last().unwrap_or_default();
        assert!(
            last.starts_with("mrt: ") && last.contains(bad),
            "{bad}: {error}"
        );
        assert!(output.stdout.is_empty());
    }
    assert_eq!(names(folder.path()), ["occupied", "small.mrt"]);
    assert!(names(&folder.path().join("occupied")).is_empty());
}
