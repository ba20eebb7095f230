//! What is written where, for all commands: no output replaces an input, and what cannot be written is refused before
//! the work.

use crate::common::{
    assert_refused, default_dictionary, folder, folder_with_room, json, mrt, names, text,
};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// The room, its level, and a dictionary.
fn folder_with_all() -> TempDir {
    let folder = folder_with_room();
    fs::copy(default_dictionary(), folder.path().join("d.mrt")).expect("writable");
    folder
}

/// Names and contents of all plain files and links in a folder.
fn contents(folder: &Path) -> Vec<(String, Option<Vec<u8>>)> {
    let content = |name: String| {
        let path = folder.join(&name);
        let is_plain = fs::metadata(&path).is_ok_and(|found| found.is_file());
        let bytes = is_plain.then(|| fs::read(path).expect("readable"));
        (name, bytes)
    };
    names(folder).into_iter().map(content).collect()
}

/// Runs a command that must be refused with a message that names `subject`, and checks that nothing changed.
fn refused(folder: &TempDir, arguments: &[&str], subject: &str) {
    let before = contents(folder.path());
    assert_refused(&mrt(folder, arguments), subject);
    assert!(contents(folder.path()) == before, "{arguments:?}");
}

#[test]
fn no_output_replaces_an_input() {
    let folder = folder_with_all();
    let pack = ["pack", "room.toml", "--dictionary", "d.mrt", "--out"];
    for out in ["d.mrt", "./d.mrt", "room.toml"] {
        refused(&folder, &[&pack[..], &[out]].concat(), "which is read");
    }
    let adapt = ["adapt", "room.toml", "--dictionary", "d.mrt"];
    for (level, dictionary) in [
        ("d.mrt", "e.mrt"),
        ("new.toml", "d.mrt"),
        ("new.toml", "room.toml"),
        ("room.toml", "e.mrt"),
    ] {
        let outputs = ["--out-level", level, "--out-dictionary", dictionary];
        refused(&folder, &[&adapt[..], &outputs].concat(), "which is read");
    }
    let map = ["map", "--scene", "room.obj", "--out", "room.obj"];
    refused(&folder, &map, "which is read");
}

#[cfg(unix)]
#[test]
fn links_do_not_hide_an_input() {
    use std::os::unix::fs::symlink;
    let folder = folder_with_all();
    let at = |name: &str| folder.path().join(name);
    fs::hard_link(at("d.mrt"), at("hard.mrt")).expect("links");
    symlink("d.mrt", at("soft.mrt")).expect("links");
    let pack = ["pack", "room.toml", "--dictionary", "d.mrt", "--out"];
    for out in ["hard.mrt", "soft.mrt"] {
        refused(&folder, &[&pack[..], &[out]].concat(), "which is read");
    }
    // A picture or mesh that would be replaced in the output folder.
    fs::create_dir(at("out")).expect("writable");
    symlink("../room.obj", at("out/mesh.obj")).expect("links");
    let light = [
        "light",
        "--scene",
        "room.obj",
        "--level",
        "room.toml",
        "--out",
        "out",
    ];
    refused(&folder, &light, "which is read");
    fs::remove_file(at("out/mesh.obj")).expect("there");
    symlink("../room.toml", at("out/above-both.png")).expect("links");
    let demo = ["demo", "--no-exact", "--level", "room.toml", "--out", "out"];
    refused(&folder, &demo, "which is read");
}

#[test]
fn two_outputs_are_two_files() {
    let folder = folder_with_all();
    for [level, dictionary] in [["x", "x"], ["x", "./x"]] {
        let mut adapt = vec!["adapt", "room.toml", "--out-level", level];
        adapt.extend(["--out-dictionary", dictionary]);
        refused(&folder, &adapt, "two files");
    }
}

#[cfg(unix)]
#[test]
fn an_output_that_is_a_link_keeps_it() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = folder_with_room();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("kept")).expect("writable");
    fs::write(at("kept/old.toml"), "old").expect("writable");
    let private = fs::Permissions::from_mode(0o600);
    fs::set_permissions(at("kept/old.toml"), private).expect("writable");
    symlink("kept/old.toml", at("link.toml")).expect("links");
    symlink("kept/new.toml", at("dangling.toml")).expect("links");
    for (link, target) in [("link.toml", "old.toml"), ("dangling.toml", "new.toml")] {
        let map = ["map", "--scene", "room.obj", "--out", link, "--json"];
        json(&mrt(&folder, &map));
        let found = fs::symlink_metadata(at(link)).expect("there");
        assert!(found.is_symlink(), "{link}");
        let level = fs::read_to_string(at("kept").join(target)).expect("there");
        assert!(level.contains("mrt-level"), "{level}");
    }
    let found = fs::metadata(at("kept/old.toml")).expect("there");
    assert_eq!(found.permissions().mode() & 0o777, 0o600);
    assert_eq!(names(&at("kept")), ["new.toml", "old.toml"]);
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused() {
    let folder = folder_with_room();
    let at = |name: &str| folder.path().join(name);
    let _listener = std::os::unix::net::UnixListener::bind(at("socket")).expect("binds");
    let made = std::process::Command::new("mkfifo")
        .arg(at("pipe"))
        .status();
    assert!(made.expect("mkfifo runs").success());
    fs::create_dir(at("folder")).expect("writable");
    for (out, subject) in [
        ("pipe", "a pipe"),
        ("socket", "a socket"),
        ("folder", "a folder"),
        ("folder/", "a folder"),
        ("new/", "a folder"),
        ("/dev/null", "a device"),
        // The tests read standard output through a pipe.
        ("/dev/stdout", "a pipe"),
        ("-", "standard output"),
        ("missing/level.toml", "no folder"),
        ("room.obj/level.toml", "room.obj/level.toml"),
    ] {
        let map = ["map", "--scene", "room.obj", "--out", out];
        refused(&folder, &map, subject);
        // Before a bake of minutes.
        let bake = ["bake", "--preset", "quality", "--out", out];
        refused(&folder, &bake, subject);
    }
    let socket = fs::symlink_metadata(at("socket")).expect("there");
    assert!(!socket.is_file());
}

#[cfg(unix)]
#[test]
fn the_file_that_holds_the_report_is_no_output() {
    let folder = folder_with_room();
    let report = fs::File::create(folder.path().join("report")).expect("writable");
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_mrt"))
        .args(["map", "--scene", "room.obj", "--out", "/dev/stdout"])
        .current_dir(folder.path())
        .stdout(report)
        .output()
        .expect("the program starts");
    assert_refused(&output, "standard output");
    let report = fs::read(folder.path().join("report")).expect("there");
    assert!(report.is_empty());
}

#[test]
fn the_longest_name_works_and_a_longer_one_is_refused_before_the_work() {
    let folder = folder_with_room();
    let longest = format!("{}.toml", "x".repeat(250));
    let map = |out: &str| {
        mrt(
            &folder,
            &["map", "--scene", "room.obj", "--out", out, "--json"],
        )
    };
    json(&map(&longest));
    assert!(names(folder.path()).contains(&longest));
    let longer = format!("x{longest}");
    refused(
        &folder,
        &["bake", "--preset", "quality", "--out", &longer],
        &longer,
    );
}

#[test]
fn a_message_has_no_signs_that_a_terminal_obeys() {
    let folder = folder();
    let name = "red\u{1b}[31m\u{7}.toml";
    let output = mrt(&folder, &["pack", name, "--out", "room.mrt"]);
    assert_refused(&output, r"red\u{1b}[31m\u{7}.toml");
    let error = text(&output.stderr);
    assert!(!error.trim_end().contains(char::is_control), "{error}");
}

#[test]
fn what_a_killed_program_left_goes_with_the_next_output() {
    let folder = folder_with_room();
    let part = folder.path().join(".mrt-00c0ffee.part");
    let others = folder.path().join(".mrt-notes.part");
    for path in [&part, &others] {
        let file = fs::File::create(path).expect("writable");
        let age = std::time::SystemTime::now() - std::time::Duration::from_secs(3600);
        file.set_modified(age).expect("writable");
    }
    json(&mrt(
        &folder,
        &["map", "--scene", "room.obj", "--out", "new.toml", "--json"],
    ));
    assert_eq!(
        names(folder.path()),
        [".mrt-notes.part", "new.toml", "room.obj", "room.toml"]
    );
}
