//! `mrt demo`.

use crate::common::{ROOM_LEVEL, assert_failed, assert_refused, folder, json, mrt, names};
use std::fs;

#[test]
fn the_demo_writes_six_pictures() {
    let folder = folder();
    let output = mrt(
        &folder,
        &["demo", "--no-exact", "--out", "pictures", "--json"],
    );
    let report = json(&output);
    assert_eq!(report["pictures"].as_array().map(Vec::len), Some(6));
    assert!(report["errors"].is_null());
    let written = names(&folder.path().join("pictures"));
    assert_eq!(written.len(), 6, "{written:?}");
    for name in written {
        let picture = fs::read(folder.path().join("pictures").join(&name)).expect("readable");
        assert!(picture.starts_with(b"\x89PNG\r\n\x1a\n"), "{name}");
        assert!(name.ends_with(".png"), "{name}");
    }
}

#[test]
fn files_that_are_no_level_are_refused() {
    let folder = folder();
    let demo = |level: &str| {
        let arguments = ["demo", "--no-exact", "--out", "out", "--level", level];
        mrt(&folder, &arguments)
    };
    for (name, content) in [
        ("empty.toml", ""),
        ("foreign.toml", "format = \"something else\"\nversion = 1\n"),
        ("truncated.toml", &ROOM_LEVEL[..ROOM_LEVEL.len() - 20]),
    ] {
        fs::write(folder.path().join(name), content).expect("writable");
        assert_failed(&demo(name), name);
    }
    assert_refused(&demo("missing.toml"), "missing.toml");
    assert!(!folder.path().join("out").exists());
}
