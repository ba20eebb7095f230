//! `mrt info`.

use crate::common::{ROOM_LEVEL, assert_refused, default_dictionary, folder, json, mrt, text};
use std::ffi::OsStr;
use std::fs;

#[test]
fn files_that_are_no_dictionary_are_refused_in_one_sentence() {
    let folder = folder();
    let dictionary = fs::read(default_dictionary()).expect("the asset is there");
    let mut flipped = dictionary.clone();
    flipped[dictionary.len() / 2] ^= 4;
    for (name, bytes) in [
        ("empty.mrt", &[][..]),
        ("short.mrt", &dictionary[..40]),
        ("truncated.mrt", &dictionary[..dictionary.len() / 2]),
        ("flipped.mrt", &flipped),
        ("picture.png", b"\x89PNG\r\n\x1a\nand so on"),
        ("level.toml", ROOM_LEVEL.as_bytes()),
    ] {
        fs::write(folder.path().join(name), bytes).expect("writable");
        assert_refused(&mrt(&folder, &["info", name]), name);
        assert_refused(&mrt(&folder, &["info", name, "--json"]), name);
        let demo = ["demo", "--no-exact", "--out", "out", "--dictionary", name];
        assert_refused(&mrt(&folder, &demo), name);
    }
    assert_refused(&mrt(&folder, &["info", "missing.mrt"]), "missing.mrt");
    fs::create_dir(folder.path().join("a-folder")).expect("writable");
    assert_refused(&mrt(&folder, &["info", "a-folder"]), "a-folder");
    // A sparse file, which has a length and no bytes.
    let huge = fs::File::create(folder.path().join("huge.mrt")).expect("writable");
    huge.set_len(1 << 40).expect("a sparse file");
    assert_refused(&mrt(&folder, &["info", "huge.mrt"]), "huge.mrt");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn the_default_dictionary_is_shown() {
    let folder = folder();
    let file = default_dictionary();
    let output = mrt(
        &folder,
        &[OsStr::new("info"), file.as_os_str(), OsStr::new("--json")],
    );
    let info = json(&output);
    assert_eq!(info["preset"], "standard");
    assert_eq!(info["resolution"], 16);
    let shapes = info["shapes"].as_array().expect("a list of shapes");
    assert_eq!(shapes.len(), 6);
    assert!(
        shapes
            .iter()
            .all(|shape| shape["modes"].as_u64() <= Some(32))
    );
    let plain = mrt(&folder, &[OsStr::new("info"), file.as_os_str()]);
    assert_eq!(plain.status.code(), Some(0));
    assert!(text(&plain.stdout).contains("dead_end"));
}
