//! Running a program.

use serde_json::Value;
use std::ffi::OsStr;
use std::process::{Command, Output};
use tempfile::TempDir;

/// An empty folder.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("there is room for temporary files")
}

/// Runs a program in `folder`.
pub fn run<S: AsRef<OsStr>>(program: &str, folder: &TempDir, arguments: &[S]) -> Output {
    Command::new(program)
        .args(arguments)
        .current_dir(folder.path())
        // Reference files are absent.
        .env("MRT_SHARED", folder.path())
        .output()
        .expect("the program starts")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("output is text")
}

/// The reports of a run that succeeded, one a line.
pub fn json_lines(output: &Output) -> Vec<Value> {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let line = |line: &str| serde_json::from_str(line).expect("a JSON object a line");
    text(&output.stdout).lines().map(line).collect()
}
