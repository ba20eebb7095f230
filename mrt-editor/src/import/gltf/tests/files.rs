//! Text files, with data URIs and files beside them.

use super::{TRIANGLE, changed, glb, sentence, triangle_numbers};
use crate::import::error::ImportError;
use crate::import::gltf::read;
use crate::import::raw_mesh::RawMesh;
use std::fs;
use std::path::Path;

/// Reads [`TRIANGLE`] as a text file in `folder`, its buffer at `uri`.
fn read_at(folder: &Path, uri: &str) -> Result<RawMesh, ImportError> {
    let buffer = format!(r#"[{{"uri":"{uri}","byteLength":40}}]"#);
    let json = changed(&[(r#"[{"byteLength":40}]"#, &buffer)]);
    read(&folder.join("a.gltf"), json.as_bytes())
}

/// A folder with the numbers of the triangle inside and outside.
fn folders() -> tempfile::TempDir {
    let outer = tempfile::tempdir().expect("a folder");
    let folder = outer.path().join("scene");
    fs::create_dir_all(folder.join("sub")).expect("writable");
    for name in [
        "outside.bin",
        "scene/room data.bin",
        "scene/sub/50%25.bin",
        "scene/sub/ä.bin",
    ] {
        fs::write(outer.path().join(name), triangle_numbers()).expect("writable");
    }
    outer
}

#[test]
fn buffers_come_from_data_or_from_files_inside_the_folder() {
    let outer = folders();
    let folder = outer.path().join("scene");
    let data = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAECAA==";
    for uri in [
        data,
        "room%20data.bin",
        "room data.bin",
        "sub/../room%20data.bin",
        "sub\\\\%C3%A4.bin",
        "sub/50%25.bin",
    ] {
        let mesh = read_at(&folder, uri).unwrap_or_else(|error| panic!("{uri}: {error}"));
        assert_eq!(
            (mesh.positions.len(), &mesh.triangles[..]),
            (3, &[[0, 1, 2]][..]),
            "{uri}"
        );
    }
}

#[test]
fn a_buffer_that_cannot_be_read_is_refused_by_name() {
    let outer = folders();
    let folder = outer.path().join("scene");
    let absolute = outer.path().join("outside.bin");
    for (uri, name, reason) in [
        ("no%20such.bin", "`no such.bin`", "No such file"),
        (
            "../outside.bin",
            "`../outside.bin`",
            "inside the scene's folder",
        ),
        (
            "sub/%2e%2e/../outside.bin",
            "outside.bin`",
            "inside the scene's folder",
        ),
        (
            absolute.to_str().expect("text"),
            "outside.bin`",
            "inside the scene's folder",
        ),
        ("sub", "`sub`", "a regular file"),
        (
            "http://example.com/a.bin",
            "`http://example.com/a.bin`",
            "none from elsewhere",
        ),
        (
            "file:///etc/hosts",
            "`file:///etc/hosts`",
            "none from elsewhere",
        ),
        ("data:;base64,A", "buffers[0]", "a data URI in base64"),
        ("data:;base64,AAAA", "bufferViews[0]", "inside its buffer"),
    ] {
        let error = read_at(&folder, uri).expect_err(uri).to_string();
        assert!(
            error.contains(name) && error.contains(reason),
            "{uri}: {error}"
        );
        assert_eq!(error.lines().count(), 1);
    }
}

#[test]
fn text_and_binary_are_told_by_their_bytes() {
    let json = format!("\u{feff}{TRIANGLE}");
    let fault = read(Path::new("a.glb"), json.as_bytes())
        .expect_err("no data")
        .to_string();
    assert!(fault.contains("buffers[0]"), "{fault}");
    let bytes = glb(TRIANGLE, &triangle_numbers());
    assert!(read(Path::new("a.gltf"), &bytes).is_ok());
}

#[test]
fn a_buffer_that_nothing_needs_may_be_missing() {
    let buffers = r#"[{"byteLength":40},{"uri":"none.bin","byteLength":9}]"#;
    let mesh = super::read_changed(&[(r#"[{"byteLength":40}]"#, buffers)]);
    assert_eq!(mesh.expect("reads").triangles.len(), 1);
}

#[test]
fn integers_may_have_fractions_of_zeros() {
    let mesh = super::read_changed(&[(r#""count":3,"#, r#""count":3.0,"#)]);
    assert_eq!(mesh.map_err(sentence).expect("reads").triangles.len(), 1);
}
