//! `mrt adapt`.

use crate::common::{assert_refused, folder, json, mrt, names, text};
use std::fs;
use tempfile::TempDir;

/// A cube and a hall, not joined.
const LEVEL: &str = "format = \"mrt-level\"\nversion = 1\n\n\
    [[block]]\nshape = \"closed\"\nbox = [[0, 0, 0], [2, 2, 2]]\nalbedo = [0.5, 0.5, 0.5]\n\n\
    [[block]]\nshape = \"closed\"\nbox = [[3, 0, 0], [9, 1, 1]]\nalbedo = [0.5, 0.5, 0.5]\n";

fn folder_with_level() -> TempDir {
    let folder = folder();
    fs::write(folder.path().join("level.toml"), LEVEL).expect("writable");
    folder
}

#[test]
fn a_report_advises_and_writes_nothing() {
    let folder = folder_with_level();
    let report = json(&mrt(
        &folder,
        &["adapt", "level.toml", "--report", "--json"],
    ));
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
    assert_eq!(names(folder.path()), ["level.toml"]);
}

#[test]
fn an_adapted_level_uses_the_operators_of_its_dictionary() {
    let folder = folder_with_level();
    let mut adapt = vec!["adapt", "level.toml", "--out-level", "new.toml"];
    adapt.extend(["--out-dictionary", "new.mrt"]);
    let output = mrt(&folder, &adapt);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let level = fs::read_to_string(folder.path().join("new.toml")).expect("written");
    assert_eq!(level.matches("transport").count(), 1);

    let mut again = vec!["adapt", "new.toml", "--dictionary", "new.mrt"];
    again.extend(["--report", "--json"]);
    let report = json(&mrt(&folder, &again));
    assert_eq!(report["blocks"][1]["used"], "rebuilt");
}

#[test]
fn contradictory_and_faulty_flags_are_refused() {
    let folder = folder_with_level();
    let same = ["--out-level", "x", "--out-dictionary", "x"];
    let negative = ["--report", "--threshold-rebuild=-1"];
    for (flags, subject) in [
        (&same[..], "two files"),
        (&negative[..], "threshold-rebuild"),
    ] {
        let arguments = [&["adapt", "level.toml"], flags].concat();
        assert_refused(&mrt(&folder, &arguments), subject);
    }
    assert_eq!(names(folder.path()), ["level.toml"]);
}

#[test]
fn adapting_needs_places_to_write_or_a_wish_for_a_report() {
    let output = mrt(&folder_with_level(), &["adapt", "level.toml"]);
    assert_eq!(output.status.code(), Some(2));
}
