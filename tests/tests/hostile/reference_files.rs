//! Damaged and malicious reference files are refused by the right error. Its message is one sentence with the file, the
//! fault, what was expected and what was found.

use std::path::Path;

use mrt_core::geometry::cube::Face;
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::oracle_file::{Kind, ReferenceError, read};
use serde_json::{Value, json};

/// The description of a sound file: two cells, one light, direct light and one bounce at 2 x 2 texels on ten walls.
fn sound() -> Value {
    let walls: Vec<Value> = (0..2)
        .flat_map(|x| Face::ALL.map(|face| (x, face)))
        .filter(|&(x, face)| face != [Face::PosX, Face::NegX][x])
        .map(|(x, face)| json!([[x, 0, 0], face.name()]))
        .collect();
    json!({
        "name": "level", "cells": [[0, 0, 0], [1, 0, 0]], "lights": [[0.5, 0.5, 0.5]],
        "intensity": 1.0, "resolution": 2, "bounces": 1, "walls": walls, "shape": [1, 2, 10, 2, 2],
    })
}

fn values(count: usize) -> Vec<u8> {
    (0..count)
        .flat_map(|k| (k as f32 * 0.25).to_le_bytes())
        .collect()
}

fn write(folder: &Path, description: &[u8], data: Option<&[u8]>) {
    std::fs::write(folder.join("level.json"), description).unwrap();
    if let Some(data) = data {
        std::fs::write(folder.join("level.f32"), data).unwrap();
    }
}

fn error_of(description: &[u8], data: Option<&[u8]>) -> ReferenceError {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), description, data);
    let error = read(&folder.path().join("level.json")).unwrap_err();
    let sentence = error.to_string();
    assert!(sentence.contains("level."), "{sentence}");
    assert!(
        !sentence.contains('\n') && sentence.len() < 500,
        "{sentence}"
    );
    error
}

fn changed(key: &str, value: Value) -> Vec<u8> {
    let mut description = sound();
    description[key] = value;
    description.to_string().into_bytes()
}

#[test]
fn a_sound_file_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    write(
        folder.path(),
        sound().to_string().as_bytes(),
        Some(&values(80)),
    );
    let file = read(&folder.path().join("level.json")).unwrap();
    assert_eq!(file.kind, Kind::Irradiance);
    assert_eq!(file.walls[1], (0, Face::NegY));
    assert_eq!(file.hops(0).unwrap(), [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
    let first = file
        .indirect_irradiance(0, ReferenceBounces::First, 0.5)
        .unwrap();
    assert_eq!(first[3], 0.5 * 0.25 * 43.0);
    assert!(
        file.indirect_irradiance(1, ReferenceBounces::First, 0.5)
            .is_err()
    );
    assert!(
        file.indirect_irradiance(0, ReferenceBounces::Count(2), 0.5)
            .is_err()
    );
    // Two terms are too few to estimate the bounces beyond them.
    assert!(
        file.indirect_irradiance(0, ReferenceBounces::All, 0.5)
            .is_err()
    );
    assert!(file.hops(1).is_err());
}

#[test]
fn missing_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = read(&folder.path().join("level.json")).unwrap_err();
    assert!(matches!(missing, ReferenceError::Io { .. }));
    let error = error_of(sound().to_string().as_bytes(), None);
    assert!(matches!(&error, ReferenceError::Io { file, .. } if file.ends_with("level.f32")));
}

#[test]
fn data_of_the_wrong_length_is_refused() {
    for length in [0, 319, 321, 640] {
        let data = vec![0; length];
        let error = error_of(sound().to_string().as_bytes(), Some(&data));
        let sentence = error.to_string();
        assert!(sentence.contains("expected 320"), "{sentence}");
        assert!(sentence.contains(&format!("is {length};")), "{sentence}");
    }
}

#[test]
fn data_that_cannot_be_irradiance_is_refused() {
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        let mut data = values(80);
        data[68..72].copy_from_slice(&bad.to_le_bytes());
        let error = error_of(sound().to_string().as_bytes(), Some(&data));
        assert!(error.to_string().contains("value 17"), "{error}");
    }
}

#[test]
fn text_that_does_not_describe_a_reference_is_refused() {
    let deep = "[".repeat(100_000);
    let cut = &sound().to_string()[..90];
    let huge_number = sound()
        .to_string()
        .replace("\"resolution\":2", "\"resolution\":1e999");
    let long_text = sound().to_string().replace(
        "\"resolution\":2",
        &format!("\"resolution\":\"{}\"", "\\n".repeat(9000)),
    );
    for text in [
        &long_text,
        "",
        "null",
        "{}",
        "\u{0}\u{1}",
        &deep,
        cut,
        &huge_number,
    ] {
        let error = error_of(text.as_bytes(), Some(&values(80)));
        assert!(matches!(error, ReferenceError::Json { .. }), "{error}");
    }
    let not_text = error_of(&[0xff, 0xfe, 0x80], None);
    assert!(matches!(not_text, ReferenceError::Json { .. }));
}

#[test]
fn values_that_contradict_the_format_are_refused() {
    let good = sound();
    let mut swapped = good["walls"].clone();
    swapped.as_array_mut().unwrap().swap(2, 3);
    let mut unknown_face = good["walls"].clone();
    unknown_face[4][1] = json!("north");
    let mut foreign_cell = good["walls"].clone();
    foreign_cell[4][0] = json!([9, 9, 9]);
    let mut too_few = good["walls"].clone();
    too_few.as_array_mut().unwrap().pop();
    let mut too_many = good["walls"].clone();
    let last = too_many[9].clone();
    too_many.as_array_mut().unwrap().push(last);
    let mut opening = good["walls"].clone();
    opening[1][1] = json!("+x");
    for (key, value, expected_part) in [
        ("walls", swapped, "wall 2"),
        ("walls", unknown_face, "wall 4 is \"north\""),
        ("walls", foreign_cell, "a face of a listed cell"),
        ("walls", too_few, "expected 10"),
        ("walls", too_many, "wall 10"),
        ("walls", opening, "wall 1"),
        ("walls", Value::Null, "walls is absent"),
        ("resolution", json!(0), "resolution is 0"),
        ("resolution", Value::Null, "resolution is 0 or absent"),
        ("cells", json!([]), "cells is an empty list"),
        ("cells", json!([[0, 0, 0], [0, 0, 0]]), "cell 1"),
        ("lights", json!([]), "lights"),
        ("lights", json!([[0.5, 0.5, 7.0]]), "light 0"),
        ("intensity", json!(0.0), "intensity is 0"),
        ("intensity", json!(-1.0), "intensity is -1"),
        ("bounces", Value::Null, "bounces"),
        ("bounces", json!(u64::MAX), "bounces"),
        ("bounces", json!(7), "shape"),
        ("shape", json!([]), "shape is []"),
        ("shape", json!([1, 2, 10, 2]), "shape"),
        ("shape", json!([1, 2, 10, 2, u64::MAX]), "shape"),
        ("name", json!("other"), "name is \"other\""),
        ("name", json!("a\nb"), "name is \"a\\n"),
        ("name", json!("x".repeat(100_000)), "name is \"xxx"),
        ("kind", json!("radiance"), "kind is \"radiance\""),
        ("kind", json!("irradiance_rgb"), "albedo"),
        ("kind", json!("radiance_sh9"), "albedo"),
    ] {
        let error = error_of(&changed(key, value), Some(&values(80)));
        assert!(
            matches!(error, ReferenceError::Malformed { .. }),
            "{error:?}"
        );
        let sentence = error.to_string();
        assert!(sentence.contains(expected_part), "{key}: {sentence}");
        assert!(sentence.contains("expected"), "{key}: {sentence}");
    }
}

#[test]
fn colours_and_points_are_checked() {
    let mut coloured = sound();
    coloured["kind"] = json!("irradiance_rgb");
    coloured["terms"] = json!(["first_bounce", "all_bounces"]);
    coloured["shape"] = json!([1, 2, 10, 2, 2, 3]);
    for (albedo, part) in [
        (json!(vec![[0.5; 3]; 9]), "number of albedos is 9"),
        (json!(vec![[0.5, 1.5, 0.5]; 10]), "albedo of wall 0 is 1.5"),
        (json!(0.5), "albedo"),
    ] {
        coloured["albedo"] = albedo;
        let error = error_of(coloured.to_string().as_bytes(), Some(&values(240)));
        assert!(error.to_string().contains(part), "{error}");
    }
    coloured["albedo"] = json!(vec![[0.5; 3]; 10]);
    coloured["terms"] = json!(["first_bounce"]);
    let error = error_of(coloured.to_string().as_bytes(), Some(&values(240)));
    assert!(
        error.to_string().contains("number of terms is 1"),
        "{error}"
    );

    let mut probes = sound();
    probes["kind"] = json!("radiance_sh9");
    probes["terms"] = json!(["a", "b"]);
    probes["albedo"] = json!(0.5);
    probes["shape"] = json!([1, 2, 1, 9]);
    for (points, part) in [
        (json!([]), "points"),
        (json!([[0.5, 0.5, 3.0]]), "point 0"),
        (json!([[0.5, 0.5, 0.5], [0.5, 0.5, 0.6]]), "shape"),
    ] {
        probes["points"] = points;
        let error = error_of(probes.to_string().as_bytes(), Some(&values(18)));
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_allocated() {
    let many_cells: Vec<[i32; 3]> = (0..5000).map(|x| [x, 0, 0]).collect();
    for (key, value) in [
        ("resolution", json!(u64::MAX)),
        ("resolution", json!(1 << 20)),
        ("cells", json!([[i32::MAX, 0, 0]])),
        ("cells", json!([[i32::MIN, 0, 0]])),
        ("cells", json!(many_cells)),
    ] {
        let error = error_of(&changed(key, value), Some(&values(80)));
        assert!(
            matches!(error, ReferenceError::LimitExceeded { .. }),
            "{error:?}"
        );
    }
    let mut many_values = sound();
    many_values["bounces"] = json!(1u64 << 60);
    many_values["shape"] = json!([1, (1u64 << 60) + 1, 10, 2, 2]);
    let error = error_of(many_values.to_string().as_bytes(), Some(&values(80)));
    assert!(matches!(error, ReferenceError::LimitExceeded { .. }));
    let padded = format!("{}{}", sound(), " ".repeat(5 << 20));
    let error = error_of(padded.as_bytes(), Some(&values(80)));
    assert!(matches!(error, ReferenceError::LimitExceeded { .. }));
}

#[test]
fn a_file_of_many_cells_and_points_is_read_and_searched() {
    // Near the limits of cells and of text.
    let (side, count) = (64, 250_000);
    let cells: Vec<[i32; 3]> = (0..side * side).map(|k| [k % side, 0, k / side]).collect();
    let end = f64::from(side);
    // On a face at the far end, so that a search of the list takes longest.
    let points = vec![[end, 1.0, end]; count];
    let description = json!({
        "name": "level", "kind": "radiance_sh9", "cells": cells, "lights": [[end, 1.0, end]],
        "intensity": 1.0, "albedo": 0.5, "terms": ["first_bounce", "albedo_0.5"], "points": points,
        "shape": [1, 2, count, 9],
    });
    let folder = tempfile::tempdir().unwrap();
    let data = vec![0; 4 * 2 * 9 * count];
    let text = description.to_string();
    write(folder.path(), text.as_bytes(), Some(&data));
    let file = read(&folder.path().join("level.json")).unwrap();
    assert_eq!(file.light_cell(0).unwrap(), cells.len() - 1);
    // Floors, ceilings, and the sides of the sheet.
    assert_eq!(file.walls.len(), 2 * cells.len() + 4 * side as usize);
    let hops = file.hops(0).unwrap();
    assert_eq!(hops.iter().max(), Some(&(2 * (side as u32 - 1))));
    let twice = description.to_string().replacen("[1,0,0]", "[63,0,63]", 1);
    write(folder.path(), twice.as_bytes(), None);
    let error = read(&folder.path().join("level.json")).unwrap_err();
    assert!(error.to_string().contains("cell 4095"), "{error}");
}

#[test]
fn what_a_description_says_is_quoted_shortly() {
    let hostile = "\u{1b}[2J\u{202e}".repeat(4000);
    for (key, value) in [
        ("kind", json!(hostile)),
        ("name", json!(hostile)),
        ("walls", json!([[[0, 0, 0], hostile]])),
        ("cells", json!([hostile])),
        ("shape", json!(vec![1; 100_000])),
    ] {
        let error = error_of(&changed(key, value), Some(&values(80))).to_string();
        assert!(!error.contains(char::is_control), "{error:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_is_no_reference_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.json");
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    assert!(made.unwrap().success());
    let error = read(&path).unwrap_err();
    assert!(error.to_string().contains("pipe"), "{error}");
}
