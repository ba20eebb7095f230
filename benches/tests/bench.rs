//! `mrt-bench` as a user meets it: lines of JSON, tables as files, plots, and refusals.

use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

fn small_dictionary() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/versions/2.mrt")
}

/// Runs the program in `folder`.
fn bench<S: AsRef<OsStr>>(folder: &TempDir, arguments: &[S]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mrt-bench"))
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

/// Tags of a document are closed in the order in which they were opened, and nothing else looks like one.
fn assert_well_formed(svg: &str) {
    let mut open: Vec<&str> = Vec::new();
    for part in svg.split('<').skip(1) {
        let (tag, words) = part.split_once('>').expect("a tag ends");
        assert!(!words.contains('>'), "{words}");
        let name = tag.split([' ', '/']).find(|word| !word.is_empty());
        if tag.starts_with('/') {
            assert_eq!(open.pop(), name);
        } else if !tag.ends_with('/') {
            open.extend(name);
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
    }
    assert_eq!(open, [""; 0]);
}

#[test]
fn a_small_run_gives_json_csv_and_plots() {
    let folder = folder();
    let dictionary = small_dictionary();
    let run = |rest: &[&str]| {
        let mut arguments = vec!["--quick", "--out", "out", "--blocks", "1,5", "--dictionary"];
        let path = dictionary.to_str().expect("the path is text");
        arguments.push(path);
        arguments.extend(rest);
        let output = bench(&folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let lines = run(&["--json", "--simd", "scalar", "--threads", "1"]);
    let records: Vec<Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("each line is an object"))
        .collect();
    let mut methods: Vec<&str> = Vec::new();
    for record in &records {
        for key in ["ms", "rel_l2", "paper_dense_ms", "bytes", "ms_from_lights"] {
            let value = record[key].as_f64();
            assert!(
                value.is_some_and(|x| x.is_finite() && x > 0.0),
                "{key}: {record}"
            );
        }
        methods.push(record["method"].as_str().expect("a name"));
    }
    for method in ["mrt", "paper", "dense", "svd", "vpl", "gather"] {
        assert!(methods.contains(&method), "{method}");
    }
    let case = |record: &Value| record["case"].as_str().map(str::to_owned);
    let cases: Vec<String> = records.iter().filter_map(case).collect();
    for expected in ["maze1/mobile/scalar/t1", "maze5/mobile/scalar/t1/int8"] {
        assert!(cases.iter().any(|case| case == expected), "{cases:?}");
    }
    // Mobile errs by 6 %; anything else would be another level or other lights.
    let frames = records.iter().filter(|r| r["method"] == "mrt");
    for error in frames.filter_map(|r| r["rel_l2"].as_f64()) {
        assert!(error < 0.1, "{error}");
    }

    let out = folder.path().join("out");
    let table = fs::read_to_string(out.join("bench.csv")).expect("a table is written");
    let mut rows = table.lines().map(|line| line.split(',').count());
    let columns = rows.next().expect("it has a head");
    assert!(rows.all(|count| count == columns), "{table}");
    assert_eq!(table.lines().count(), 1 + records.len());
    for name in ["maze1", "maze1-frame", "maze5", "maze5-frame"] {
        let svg = fs::read_to_string(out.join(format!("{name}.svg"))).expect("a plot is written");
        assert!(
            svg.starts_with("<svg ") && svg.contains("<circle "),
            "{name}"
        );
        assert_well_formed(&svg);
        let png = fs::read(out.join(format!("{name}.png"))).expect("a plot is written");
        assert!(png.starts_with(b"\x89PNG"), "{name}");
    }

    // Exact solutions are kept: the same errors, and the same files.
    let exact = |folder: &Path| {
        let entries = fs::read_dir(folder.join("exact")).expect("a folder of solutions");
        entries.count()
    };
    assert_eq!(exact(&out), 2);
    let report = run(&["--simd", "scalar", "--threads", "1", "--storages", "f32"]);
    assert!(report.contains("maze5/mobile/scalar/t1"), "{report}");
    assert!(report.contains("% of peak"), "{report}");
    assert_eq!(exact(&out), 2);
}

#[test]
fn figures_say_what_is_asked_measured_and_met() {
    let folder = folder();
    let arguments = ["--figures", "--quick", "--json", "--out", "out"];
    let output = bench(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("high / paper is left out"));
    let goals: Vec<Value> = text(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("each line is an object"))
        .collect();
    let named = |part: &str| {
        let figure = |goal: &&Value| goal["figure"].as_str().is_some_and(|f| f.contains(part));
        let found: Vec<&Value> = goals.iter().filter(figure).collect();
        assert!(!found.is_empty(), "{part}");
        found
    };
    for goal in &goals {
        let measured = goal["measured"].as_f64().expect("a number");
        assert!(measured.is_finite() && measured >= 0.0, "{goal}");
        let asked = goal["asked"].as_str().expect("words");
        let (side, limit) = asked.rsplit_once(' ').expect("a side and a limit");
        let limit: f64 = limit.parse().expect("a number");
        let met = match side {
            "at most" => measured <= limit,
            "at least" => measured >= limit,
            _ => panic!("{asked}"),
        };
        assert_eq!(goal["met"].as_bool(), Some(met), "{goal}");
    }
    // What no machine's speed changes.
    for part in [
        "MB of operators",
        "error of a texel",
        "error: standard / paper",
    ] {
        for goal in named(part) {
            assert_eq!(goal["met"].as_bool(), Some(true), "{goal}");
        }
    }
    for part in [
        "standard / paper dense",
        "mobile / standard",
        "within 0.001",
        "100 mazes of ten",
        "maze1000 / maze10",
    ] {
        named(part);
    }
    let table = fs::read_to_string(folder.path().join("out/figures.csv")).expect("it is written");
    assert_eq!(table.lines().count(), 1 + goals.len());
}

#[test]
fn wrong_flags_are_refused_with_what_was_expected() {
    let folder = folder();
    for (arguments, code, expected) in [
        (&["--blocks", "0"][..], 2, "expected 1 to 100000 blocks"),
        (&["--blocks", "many"], 2, "expected 1 to 100000 blocks"),
        (&["--simd", "mmx"], 2, "this machine has scalar"),
        (&["--storages", "f64"], 2, "mixed, f32, f16, int8"),
        (&["--coupling", "none"], 2, "table, lightfield"),
        (&["--threads", "0"], 2, "1..=256"),
        (
            &["--presets", "best"],
            1,
            "expected one of mobile, standard, high, quality",
        ),
        (&["--modes", "0"], 1, "number of modes is 0; expected 1 to"),
        (&["--dictionary", "missing.mrt"], 1, "missing.mrt"),
    ] {
        let output = bench(&folder, arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{error}");
        assert!(error.contains(expected), "`{expected}` in: {error}");
        assert!(!error.contains("panicked"), "{error}");
        assert_eq!(text(&output.stdout), "");
    }
    fs::write(folder.path().join("file"), "text").expect("there is room");
    let output = bench(&folder, &["--out", "file"]);
    assert!(text(&output.stderr).contains("expected a folder or a new name"));
    assert_eq!(output.status.code(), Some(1));
}
