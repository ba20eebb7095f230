//! `mrt-figures` as a user meets it: what needs no reference files is drawn anywhere, and what needs them
//! says so.

use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Progress;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// Pictures of the pages must stay small: they are kept in the repository.
const MOST_BYTES: usize = 200_000;

/// A dictionary that takes a second to bake, in `folder`.
fn write_small_dictionary(folder: &Path) {
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
    fs::write(folder.join("small.mrt"), bytes).expect("there is room");
}

/// Runs the program in `folder`, where no reference files are.
fn figures(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mrt-figures"))
        .args(["--dictionary", "small.mrt", "--resolution", "4"])
        .args(arguments)
        .current_dir(folder.path())
        .env("MRT_SHARED", folder.path())
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("output is text")
}

#[test]
fn figures_are_drawn_again_to_the_same_bytes_and_the_one_without_references_is_left_out() {
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    write_small_dictionary(folder.path());
    let output = figures(&folder, &["--out", "a", "--json"]);
    let errors = text(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert!(
        errors.contains("hops is left out: the reference files are absent"),
        "{errors}"
    );
    let report: Value = serde_json::from_str(&text(&output.stdout)).expect("one JSON object");
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
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    write_small_dictionary(folder.path());
    let output = figures(&folder, &["--only", "hops,basis"]);
    assert_eq!(output.status.code(), Some(1));
    let errors = text(&output.stderr);
    assert!(
        errors.contains("hops: the reference files are absent"),
        "{errors}"
    );
    assert!(
        errors.contains("1 of 2 figures could not be drawn"),
        "{errors}"
    );
    // The other one is there all the same.
    assert!(folder.path().join("docs/pictures/basis.png").is_file());
    assert!(!folder.path().join("docs/pictures/hops.png").exists());
}
