//! `mrt pack`.

use crate::common::{ROOM_LEVEL, assert_refused, folder, json, mrt, names, text};
use std::fs;

#[test]
fn a_packed_dictionary_is_a_smaller_file() {
    let folder = folder();
    fs::write(folder.path().join("room.toml"), ROOM_LEVEL).expect("writable");
    let mut pack = vec!["pack", "room.toml", "--out", "room.mrt"];
    pack.extend(["--storage", "int8", "--json"]);
    let report = json(&mrt(&folder, &pack));
    assert_eq!(report["shapes"], serde_json::json!(["closed"]));
    let bytes = fs::metadata(folder.path().join("room.mrt"))
        .expect("written")
        .len();
    assert_eq!(report["file_bytes"], bytes);
    let before = report["file_bytes_before"].as_u64().expect("a number");
    assert!(10 * bytes < before, "{report}");
    let info = mrt(&folder, &["info", "room.mrt"]);
    assert!(
        text(&info.stdout).contains("int8"),
        "{}",
        text(&info.stderr)
    );
}

#[test]
fn a_level_that_is_missing_leaves_nothing() {
    let folder = folder();
    let arguments = ["pack", "none.toml", "--out", "room.mrt"];
    assert_refused(&mrt(&folder, &arguments), "none.toml");
    assert!(names(folder.path()).is_empty());
}
