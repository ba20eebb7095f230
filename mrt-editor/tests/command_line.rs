//! The `mrt` program as a user meets it: exit codes, messages, and files that are whole or not there.

use mrt_core::reference::oracle_file::oracle_folder;
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

const COMMANDS: [&str; 8] = [
    "demo", "bake", "adapt", "info", "accuracy", "map", "light", "pack",
];

/// A room of 2 x 2 x 2 m, its faces turned inwards.
const ROOM_OBJ: &str = "\
v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nv 0 0 2\nv 2 0 2\nv 0 2 2\nv 2 2 2
f 1 3 7 5\nf 2 6 8 4\nf 1 5 6 2\nf 3 4 8 7\nf 1 2 4 3\nf 5 7 8 6\n";

/// The room as a level.
const ROOM_LEVEL: &str = "format = \"mrt-level\"\nversion = 1\nconnections = []\n\n[[block]]\n\
shape = \"closed\"\nbox = [[0, 0, 0], [2, 2, 2]]\nalbedo = [0.5, 0.5, 0.5]\n";

fn default_dictionary() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cubes-2d-standard.mrt")
}

/// Runs the program in `folder`.
fn mrt<S: AsRef<OsStr>>(folder: &TempDir, arguments: &[S]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mrt"))
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .expect("the program starts")
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("there is room for temporary files")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("output is text")
}

/// Everything in a folder, sorted; hidden and temporary files too.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("readable")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// The run failed with code 1, one line on standard error that names `subject`, and nothing else.
fn assert_refused(output: &Output, subject: &str) {
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.starts_with("mrt: "), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    assert!(error.contains(subject), "`{subject}` in: {error}");
    assert!(!error.contains("panicked"), "{error}");
    assert_eq!(text(&output.stdout), "");
}

#[test]
fn every_command_explains_itself() {
    let folder = folder();
    for command in COMMANDS {
        let output = mrt(&folder, &[command, "--help"]);
        assert_eq!(output.status.code(), Some(0), "{command}");
        let help = text(&output.stdout);
        assert!(help.contains("Usage: mrt"), "{command}: {help}");
        assert!(help.contains("--json"), "{command}: {help}");
    }
    let output = mrt(&folder, &["--help"]);
    let help = text(&output.stdout);
    assert!(
        COMMANDS.iter().all(|command| help.contains(command)),
        "{help}"
    );
    assert_eq!(mrt(&folder, &["--version"]).status.code(), Some(0));
    assert!(names(folder.path()).is_empty());
}

#[test]
fn wrong_usage_ends_with_code_2() {
    let folder = folder();
    for arguments in [
        &["no-such-command"][..],
        &["bake"],
        &["info"],
        &["accuracy"],
        &["map", "--scene", "a.obj"],
        &["light", "--scene", "a.obj", "--level", "b.toml"],
        &["bake", "--out", "a.mrt", "--modes", "many"],
        &["accuracy", "a.json", "--bounces", "second"],
        &[
            "accuracy",
            "a.json",
            "--set",
            "cubes-3d",
            "--dictionary",
            "d.mrt",
        ],
        &[
            "accuracy",
            "a.json",
            "--preset",
            "mobile",
            "--dictionary",
            "d.mrt",
        ],
        &[
            "light", "--scene", "a", "--level", "b", "--out", "c", "--size", "0x5",
        ],
        &[
            "light", "--scene", "a", "--level", "b", "--out", "c", "--light", "1,2",
        ],
        &[
            "light",
            "--scene",
            "a",
            "--level",
            "b",
            "--out",
            "c",
            "--bounces",
            "-1",
        ],
        &["map", "--scene", "a", "--out", "b", "--fit", "sphere"],
        &["demo", "--no-such-flag"],
    ] {
        let output = mrt(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(
            !output.stderr.is_empty() && output.stdout.is_empty(),
            "{arguments:?}"
        );
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn info_on_files_that_are_no_dictionary_says_so_in_a_sentence() {
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
    // Sparse: its length is all there is of it.
    let huge = fs::File::create(folder.path().join("huge.mrt")).expect("writable");
    huge.set_len(1 << 40).expect("a sparse file");
    assert_refused(&mrt(&folder, &["info", "huge.mrt"]), "huge.mrt");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn info_shows_the_default_dictionary() {
    let folder = folder();
    let file = default_dictionary();
    let output = mrt(
        &folder,
        &[OsStr::new("info"), file.as_os_str(), OsStr::new("--json")],
    );
    assert_eq!(output.status.code(), Some(0));
    let info: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
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

#[test]
fn bake_refuses_settings_out_of_range_and_leaves_nothing() {
    let folder = folder();
    for (arguments, subject) in [
        (["--modes", "0"], "number of modes"),
        (["--modes", "100000"], "number of modes"),
        (["--resolution", "0"], "resolution"),
        (["--resolution", "4000000000"], "resolution"),
        (["--lightfield-modes", "0"], "lightfield modes"),
        (["--response-modes", "0"], "response modes"),
        (["--lights-per-axis", "0"], "lights per axis"),
        (["--enrichment", "nan"], "weight"),
        (["--preset", "ultra"], "ultra"),
        (["--set", "pyramids"], "pyramids"),
    ] {
        let mut all = vec!["bake", "--out", "a.mrt"];
        all.extend(arguments);
        assert_refused(&mrt(&folder, &all), subject);
    }
    assert_refused(
        &mrt(&folder, &["bake", "--out", "a.mrt", "--enrichment=-1"]),
        "weight",
    );
    assert!(names(folder.path()).is_empty());
}

/// Flags of a bake of a second or two.
const SMALL_BAKE: [&str; 10] = [
    "bake",
    "--preset",
    "mobile",
    "--resolution",
    "2",
    "--lights-per-axis",
    "2",
    "--lightfield-modes",
    "8",
    "--json",
];

#[test]
fn bake_writes_a_whole_file_or_none() {
    let folder = folder();
    let bake = |out: &str| {
        let mut arguments = SMALL_BAKE.to_vec();
        arguments.extend(["--out", out]);
        mrt(&folder, &arguments)
    };
    let output = bake("small.mrt");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let length = fs::metadata(folder.path().join("small.mrt"))
        .expect("written")
        .len();
    assert_eq!(report["file_bytes"].as_u64(), Some(length));
    assert_eq!(names(folder.path()), ["small.mrt"]);
    assert_eq!(mrt(&folder, &["info", "small.mrt"]).status.code(), Some(0));

    // A folder that does not exist, a file in place of a folder, a folder in place of the file.
    fs::create_dir(folder.path().join("occupied")).expect("writable");
    for bad in ["missing/a.mrt", "small.mrt/a.mrt", "occupied"] {
        let output = bake(bad);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{bad}: {error}");
        // Progress comes before it.
        let last = error.lines().last().unwrap_or_default();
        assert!(
            last.starts_with("mrt: ") && last.contains(bad),
            "{bad}: {error}"
        );
        assert!(output.stdout.is_empty());
    }
    assert_eq!(names(folder.path()), ["occupied", "small.mrt"]);
    assert!(names(&folder.path().join("occupied")).is_empty());
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn accuracy_prints_an_object_a_light() {
    let oracle = oracle_folder().expect("shared/oracle exists");
    let folder = folder();
    let file = |name: &str| oracle.join(name).into_os_string();
    let output = mrt(
        &folder,
        &[
            "accuracy".into(),
            file("cube.json"),
            file("corridor5.json"),
            "--json".into(),
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    let lines: Vec<Value> = stdout
        .lines()
        .map(|line| serde_json::from_str(line).expect("a JSON object a line"))
        .collect();
    assert!(lines.len() > 2, "{stdout}");
    for line in &lines {
        let scene = line["scene"].as_str().expect("the scene's name");
        assert!(["cube", "corridor5"].contains(&scene), "{line}");
        assert!(line["light"].is_u64(), "{line}");
        assert_eq!(line["term"], "first_bounce");
        assert_eq!(line["preset"], "standard");
        let error = line["rel_l2"].as_f64().expect("a number");
        assert!(error > 0.0 && error < 0.1, "{line}");
        let hops = line["rel_l2_by_hop"].as_array().expect("a list");
        assert_eq!(hops.len(), 4);
        assert!(hops[0].is_f64(), "{line}");
        assert_eq!(hops[1].is_null(), scene == "cube", "{line}");
    }
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn accuracy_refuses_what_it_cannot_compare_and_goes_on() {
    let oracle = oracle_folder().expect("shared/oracle exists");
    let folder = folder();
    let file = |name: &str| oracle.join(name).into_os_string();
    // The built-in set has no way up.
    let flat = ["--set".into(), "cubes-2d".into(), "--json".into()];
    for (name, subject) in [
        ("stack3.json", "stack3"),
        ("no-such-file.json", "no-such-file.json"),
    ] {
        let arguments = [&["accuracy".into(), file(name)], &flat[..]].concat();
        let output = mrt(&folder, &arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(
            error.contains(subject) && !error.contains("panicked"),
            "{error}"
        );
        assert!(output.stdout.is_empty());
    }
    let arguments = [&["accuracy".into(), file("stack3.json")], &flat[..]].concat();
    let stack = mrt(&folder, &arguments);
    assert!(
        text(&stack.stderr).contains("cubes-3d"),
        "{}",
        text(&stack.stderr)
    );
    // Probes are compared with the built-in dictionary's, and its 32 modes err by under a tenth.
    let probes = ["accuracy".into(), file("cube_probes.json"), "--json".into()];
    for line in text(&mrt(&folder, &probes).stdout).lines() {
        let line: Value = serde_json::from_str(line).expect("a JSON object a line");
        let error = line["rel_l2"].as_f64().expect("a number");
        assert!(error > 0.0 && error < 0.12, "{line}");
    }
    // The sound one is compared all the same.
    let both = ["accuracy".into(), file("stack3.json"), file("cube.json")];
    let output = mrt(&folder, &[&both, &flat[..]].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).lines().count() > 0);
    let albedo = [
        "accuracy".into(),
        file("cube.json"),
        "--albedo".into(),
        "1.5".into(),
    ];
    assert_refused(&mrt(&folder, &albedo), "1.5");
    let set = [
        "accuracy".into(),
        file("cube.json"),
        "--set".into(),
        "pyramids".into(),
    ];
    assert_refused(&mrt(&folder, &set), "pyramids");
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn accuracy_takes_the_set_that_a_stack_needs() {
    let oracle = oracle_folder().expect("shared/oracle exists");
    let folder = folder();
    let arguments = [
        "accuracy".into(),
        oracle.join("stack3.json").into_os_string(),
        "--preset".into(),
        "mobile".into(),
        "--json".into(),
    ];
    let output = mrt(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    assert_eq!(stdout.lines().count(), 3, "{stdout}");
    for line in stdout.lines() {
        let line: Value = serde_json::from_str(line).expect("a JSON object a line");
        let error = line["rel_l2"].as_f64().expect("a number");
        // The mobile preset's bound in white levels is 8 % in the mean.
        assert!(error < 0.15, "{line}");
    }
}

#[test]
fn demo_writes_six_pictures() {
    let folder = folder();
    let output = mrt(
        &folder,
        &["demo", "--no-exact", "--out", "pictures", "--json"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
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
fn demo_refuses_levels_that_are_none() {
    let folder = folder();
    for (name, content) in [
        ("empty.toml", ""),
        ("foreign.toml", "format = \"something else\"\nversion = 1\n"),
        ("truncated.toml", &ROOM_LEVEL[..ROOM_LEVEL.len() - 20]),
    ] {
        fs::write(folder.path().join(name), content).expect("writable");
        let output = mrt(
            &folder,
            &["demo", "--no-exact", "--out", "out", "--level", name],
        );
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {error}");
        assert!(
            error.starts_with("mrt: ") && output.stdout.is_empty(),
            "{name}: {error}"
        );
    }
    let missing = [
        "demo",
        "--no-exact",
        "--out",
        "out",
        "--level",
        "missing.toml",
    ];
    assert_refused(&mrt(&folder, &missing), "missing.toml");
    assert!(!folder.path().join("out").exists());
}

/// Meshes that cannot be read, by file name.
fn bad_meshes() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("empty.obj", Vec::new()),
        ("empty.glb", Vec::new()),
        ("no-faces.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec()),
        (
            "truncated.obj",
            ROOM_OBJ.as_bytes()[..ROOM_OBJ.len() - 6].to_vec(),
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

#[test]
fn map_writes_a_whole_level_or_none() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("room.obj"), ROOM_OBJ).expect("writable");
    let map = [
        "map",
        "--scene",
        "room.obj",
        "--out",
        "room.toml",
        "--fit",
        "box",
        "--json",
    ];
    let output = mrt(&folder, &map);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(report["blocks"], 1);
    let level = fs::read_to_string(file("room.toml")).expect("written");
    assert!(level.contains("mrt-level"));
    let kept = names(folder.path());

    for (name, bytes) in bad_meshes() {
        fs::write(file(name), bytes).expect("writable");
        for fit in ["box", "grid"] {
            let output = mrt(
                &folder,
                &["map", "--scene", name, "--out", "none.toml", "--fit", fit],
            );
            let error = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{name}, {fit}: {error}");
            assert!(
                error.starts_with("mrt: ") && !error.contains("panicked"),
                "{name}: {error}"
            );
        }
        fs::remove_file(file(name)).expect("still there");
    }
    let missing = ["map", "--scene", "missing.obj", "--out", "none.toml"];
    assert_refused(&mrt(&folder, &missing), "missing.obj");
    let nowhere = ["map", "--scene", "room.obj", "--out", "nowhere/none.toml"];
    assert_refused(&mrt(&folder, &nowhere), "nowhere");
    for faulty in [
        ["--scale", "0"],
        ["--scale", "nan"],
        ["--albedo", "2"],
        ["--cell", "0"],
    ] {
        let mut arguments = vec!["map", "--scene", "room.obj", "--out", "none.toml"];
        arguments.extend(faulty);
        let output = mrt(&folder, &arguments);
        assert!(!output.status.success(), "{faulty:?}");
        assert!(!text(&output.stderr).contains("panicked"), "{faulty:?}");
    }
    assert_eq!(names(folder.path()), kept);
    assert_eq!(fs::read_to_string(file("room.toml")).expect("there"), level);
}

#[test]
fn light_writes_all_files_or_none() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("room.obj"), ROOM_OBJ).expect("writable");
    fs::write(file("room.toml"), ROOM_LEVEL).expect("writable");
    let light = |scene: &str, level: &str, more: &[&str]| {
        let mut arguments = vec!["light", "--scene", scene, "--level", level];
        arguments.extend(["--out", "out", "--size", "48x27", "--json"]);
        arguments.extend(more);
        mrt(&folder, &arguments)
    };
    let refused = |output: &Output, what: &str| {
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{what}: {error}");
        assert!(
            error.starts_with("mrt: ") && !error.contains("panicked"),
            "{what}: {error}"
        );
        assert!(output.stdout.is_empty(), "{what}");
        assert!(!file("out").exists(), "{what}: partial output");
    };
    for (name, bytes) in bad_meshes() {
        fs::write(file(name), bytes).expect("writable");
        refused(&light(name, "room.toml", &[]), name);
        fs::remove_file(file(name)).expect("still there");
    }
    for (name, content) in [
        ("empty.toml", &b""[..]),
        ("binary.toml", &[0xff; 100]),
        (
            "truncated.toml",
            &ROOM_LEVEL.as_bytes()[..ROOM_LEVEL.len() - 20],
        ),
        ("foreign.toml", b"format = \"other\"\nversion = 1\n"),
    ] {
        fs::write(file(name), content).expect("writable");
        let output = light("room.obj", name, &[]);
        refused(&output, name);
        assert!(
            text(&output.stderr).contains(name),
            "{}",
            text(&output.stderr)
        );
        fs::remove_file(file(name)).expect("still there");
    }
    assert_refused(&light("missing.obj", "room.toml", &[]), "missing.obj");
    assert_refused(&light("room.obj", "missing.toml", &[]), "missing.toml");
    refused(
        &light("room.obj", "room.toml", &["--dictionary", "room.obj"]),
        "dictionary",
    );
    refused(
        &light("room.obj", "room.toml", &["--preset", "ultra"]),
        "preset",
    );
    refused(
        &light("room.obj", "room.toml", &["--light", "9,1,1,5"]),
        "light outside",
    );
    refused(
        &light("room.obj", "room.toml", &["--light", "1,1,1,nan"]),
        "intensity",
    );
    refused(
        &light("room.obj", "room.toml", &["--camera", "1,1,1;1,1,1"]),
        "camera",
    );
    assert_eq!(names(folder.path()), ["room.obj", "room.toml"]);

    let output = light("room.obj", "room.toml", &["--light", "1,1.2,0.8,5"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(report["blocks"], 1);
    let written = names(&file("out"));
    for expected in ["lightmap.hdr", "lightmap.png", "mesh.mtl", "mesh.obj"] {
        assert!(written.iter().any(|name| name == expected), "{written:?}");
    }
    assert_eq!(names(folder.path()), ["out", "room.obj", "room.toml"]);
}

#[test]
fn a_packed_dictionary_is_a_smaller_file() {
    let folder = folder();
    fs::write(folder.path().join("room.toml"), ROOM_LEVEL).expect("writable");
    let pack = [
        "pack",
        "room.toml",
        "--out",
        "room.mrt",
        "--storage",
        "int8",
        "--json",
    ];
    let output = mrt(&folder, &pack);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["shapes"], serde_json::json!(["closed"]));
    let bytes = fs::metadata(folder.path().join("room.mrt"))
        .expect("written")
        .len();
    assert_eq!(report["file_bytes"], bytes);
    assert!(
        10 * bytes < report["file_bytes_before"].as_u64().expect("a number"),
        "{report}"
    );
    let info = mrt(&folder, &["info", "room.mrt"]);
    assert!(
        text(&info.stdout).contains("int8"),
        "{}",
        text(&info.stderr)
    );
    fs::remove_file(folder.path().join("room.mrt")).expect("it is there");
    assert_refused(
        &mrt(&folder, &["pack", "none.toml", "--out", "room.mrt"]),
        "none.toml",
    );
    assert_eq!(names(folder.path()), ["room.toml"]);
}
