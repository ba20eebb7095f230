//! `mrt adapt` as a user meets it.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A cube and a hall, not joined.
const LEVEL: &str = "format = \"mrt-level\"\nversion = 1\n\n\
    [[block]]\nshape = \"closed\"\nbox = [[0, 0, 0], [2, 2, 2]]\nalbedo = [0.5, 0.5, 0.5]\n\n\
    [[block]]\nshape = \"closed\"\nbox = [[3, 0, 0], [9, 1, 1]]\nalbedo = [0.5, 0.5, 0.5]\n";

fn mrt(folder: &TempDir, arguments: &[&str]) -> Output {
    std::fs::write(folder.path().join("level.toml"), LEVEL).expect("a place to write");
    Command::new(env!("CARGO_BIN_EXE_mrt"))
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("output is text")
}

#[test]
fn a_report_advises_and_writes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = mrt(&folder, &["adapt", "level.toml", "--report", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let advised = |k: usize| report["blocks"][k]["advised"].as_str();
    assert_eq!(
        [advised(0), advised(1)],
        [Some("canonical"), Some("rebuilt")]
    );
    let expected = &report["blocks"][1]["expected_error"];
    let number = |name: &str| expected[name].as_f64().expect("a number");
    assert!(number("canonical") > number("regathered"));
    assert!(number("regathered") > number("rebuilt"));
    let table = mrt(&folder, &["adapt", "level.toml", "--report"]);
    assert!(text(&table.stdout).contains("should use"));
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("readable").count(),
        1
    );
}

#[test]
fn an_adapted_level_is_found_with_its_dictionary() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = [
        "adapt",
        "level.toml",
        "--out-level",
        "new.toml",
        "--out-dictionary",
        "new.mrt",
    ];
    let output = mrt(&folder, &run);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let level = std::fs::read_to_string(folder.path().join("new.toml")).expect("written");
    assert_eq!(level.matches("transport").count(), 1);
    let again = [
        "adapt",
        "new.toml",
        "--dictionary",
        "new.mrt",
        "--report",
        "--json",
    ];
    let output = mrt(&folder, &again);
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(report["blocks"][1]["used"], "rebuilt");
}

#[test]
fn wrong_wishes_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let same = ["--out-level", "x", "--out-dictionary", "x"];
    let negative = ["--report", "--threshold-rebuild=-1"];
    for (flags, subject) in [
        (&same[..], "two files"),
        (&negative[..], "threshold-rebuild"),
    ] {
        let arguments = [&["adapt", "level.toml"], flags].concat();
        let output = mrt(&folder, &arguments);
        assert_eq!(output.status.code(), Some(1));
        assert!(
            text(&output.stderr).contains(subject),
            "{}",
            text(&output.stderr)
        );
    }
    // Without places to write there is nothing but a report.
    assert_eq!(
        mrt(&folder, &["adapt", "level.toml"]).status.code(),
        Some(2)
    );
    assert!(!Path::new(&folder.path().join("x")).exists());
}
