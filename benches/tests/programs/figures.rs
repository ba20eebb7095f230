//! `mrt-figures`: the pages' figures that need no reference files are drawn anywhere, the others say what they
//! need.

use crate::common::{folder, json_lines, run, text};
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Progress;
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// Figures are kept in the repository, so they must stay small.
const MOST_BYTES: usize = 200_000;

/// A folder with `small.mrt`, a dictionary that takes a second to bake.
fn folder_with_dictionary() -> TempDir {
    let mut config = BakeConfig::preset("mobile").expect("a preset");
    config.preset = "small".to_owned();
    config.resolution = 4;
    config.coupling.depth = 2;
    config.lightfield.positions = 4;
    config.lightfield.directions = 6;
    config.lightfield.super_samples = 1;
    config.check().expect("legal settings");
    let dictionary = bake(&config, &Progress::silent()).expect("nobody cancels");
    let bytes = dictionary.to_bytes().expect("it has a form as bytes");
    let folder = folder();
    fs::write(folder.path().join("small.mrt"), bytes).expect("there is room");
    folder
}

/// Draws with the small dictionary; no reference files are there.
fn figures(folder: &TempDir, more: &[&str]) -> Output {
    let mut arguments = vec!["--dictionary", "small.mrt", "--resolution", "4"];
    arguments.extend(more);
    run(env!("CARGO_BIN_EXE_mrt-figures"), folder, &arguments)
}

#[test]
fn figures_are_the_same_bytes_each_time_and_one_is_left_out_without_references() {
    let folder = folder_with_dictionary();
    let output = figures(&folder, &["--out", "a", "--json"]);
    let errors = text(&output.stderr);
    assert!(
        errors.contains("hops is left out: the reference files are absent"),
        "{errors}"
    );
    let [report] = &json_lines(&output)[..] else {
        panic!("one JSON object: {}", text(&output.stdout));
    };
    let drawn = report["figures"].as_array().expect("a list of figures");
    let names: Vec<&str> = drawn.iter().filter_map(|f| f["figure"].as_str()).collect();
    assert_eq!(names, ["basis", "spectra", "warps", "white-face", "probes"]);
    assert!(figures(&folder, &["--out", "b"]).status.success());
    for name in names {
        let read = |out: &str| {
            let path = folder.path().join(out).join(format!("{name}.png"));
            fs::read(path).expect("the picture is there")
        };
        let bytes = read("a");
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() < MOST_BYTES);
        assert!(bytes == read("b"), "{name} is another picture");
    }
}

#[test]
fn a_figure_asked_for_by_name_must_be_drawn() {
    let folder = folder_with_dictionary();
    let output = figures(&folder, &["--only", "hops,basis"]);
    assert_eq!(output.status.code(), Some(1));
    let errors = text(&output.stderr);
    for part in [
        "hops: the reference files are absent",
        "1 of 2 figures could not be drawn",
    ] {
        assert!(errors.contains(part), "{errors}");
    }
    // The other one is there all the same.
    assert!(folder.path().join("docs/pictures/basis.png").is_file());
    assert!(!folder.path().join("docs/pictures/hops.png").exists());
}
