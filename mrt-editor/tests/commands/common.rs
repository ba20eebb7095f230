//! Running the program, and what it is run on.

use mrt_core::reference::oracle_file::ground_truth_folder;
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A room of 2 x 2 x 2 m, its faces turned inwards.
pub const ROOM_OBJ: &str = "\
v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nv 0 0 2\nv 2 0 2\nv 0 2 2\nv 2 2 2
f 1 3 7 5\nf 2 6 8 4\nf 1 5 6 2\nf 3 4 8 7\nf 1 2 4 3\nf 5 7 8 6\n";

/// The room as a level.
pub const ROOM_LEVEL: &str = "format = \"mrt-level\"\nversion = 1\nconnections = []\n\n[[block]]\n\
shape = \"closed\"\nbox = [[0, 0, 0], [2, 2, 2]]\nalbedo = [0.5, 0.5, 0.5]\n";

pub fn default_dictionary() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cubes-2d-standard.mrt")
}

/// Runs the program in `folder`.
pub fn mrt<S: AsRef<OsStr>>(folder: &TempDir, arguments: &[S]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mrt"))
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .expect("the program starts")
}

/// An empty folder.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("there is room for temporary files")
}

/// A folder with the room as `room.obj` and as `room.toml`.
pub fn folder_with_room() -> TempDir {
    let folder = folder();
    fs::write(folder.path().join("room.obj"), ROOM_OBJ).expect("writable");
    fs::write(folder.path().join("room.toml"), ROOM_LEVEL).expect("writable");
    folder
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("output is text")
}

/// The report of a run that succeeded.
pub fn json(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// The reports of a run that succeeded, one a line.
pub fn json_lines(output: &Output) -> Vec<Value> {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let line = |line: &str| serde_json::from_str(line).expect("a JSON object a line");
    text(&output.stdout).lines().map(line).collect()
}

/// Everything in a folder, sorted; hidden and temporary files too.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let name = |entry: std::io::Result<fs::DirEntry>| {
        let name = entry.expect("readable").file_name();
        name.to_string_lossy().into_owned()
    };
    let mut names: Vec<String> = entries.map(name).collect();
    names.sort();
    names
}

/// The run failed with code 1, one line on standard error that names `subject`, and nothing else.
pub fn assert_refused(output: &Output, subject: &str) {
    let error = text(&output.stderr);
    assert_failed(output, subject);
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    assert!(error.contains(subject), "`{subject}` in: {error}");
}

/// The run failed with code 1 and a message after the program's name, without a panic, and printed nothing.
pub fn assert_failed(output: &Output, what: &str) {
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{what}: {error}");
    assert!(error.starts_with("mrt: "), "{what}: {error}");
    assert!(!error.contains("panicked"), "{what}: {error}");
    assert_eq!(text(&output.stdout), "", "{what}");
}

/// Meshes that cannot be read, by file name.
pub fn bad_meshes() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("empty.obj", Vec::new()),
        ("empty.glb", Vec::new()),
        ("no-faces.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec()),
        (
            "truncated.obj",
            // The last vertex lacks a coordinate.
            ROOM_OBJ.as_bytes()[..61].to_vec(),
        ),
        (
            "no-such-vertex.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n".to_vec(),
        ),
        (
            "not-a-number.obj",
            b"v 0 0 zero\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec(),
        ),
        ("binary.obj", vec![0xff; 300]),
        ("binary.glb", vec![0xff; 300]),
        ("truncated.glb", b"glTF\x02\0\0\0\xff\xff\0\0".to_vec()),
        ("picture.png", b"\x89PNG\r\n\x1a\n".to_vec()),
    ]
}

/// The path of a file of `shared/cases`. Tests that need one are ignored where the folder is absent.
pub fn case(name: &str) -> String {
    let cases = ground_truth_folder("cases").expect("shared/cases exists");
    let path = cases.join(name).into_os_string();
    path.into_string().expect("a path of text")
}
