//! `mrt-bench`: lines of JSON, tables as files, plots, and refusals.

use crate::common::{folder, json_lines, run, text};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Output;
use std::time::SystemTime;
use tempfile::TempDir;

fn bench(folder: &TempDir, arguments: &[&str]) -> Output {
    run(env!("CARGO_BIN_EXE_mrt-bench"), folder, arguments)
}

/// Mazes of one and five blocks with a small dictionary, on one thread, into the folder `out`.
fn small_run(folder: &TempDir, more: &[&str]) -> Output {
    let dictionary = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/versions/2.mrt");
    let mut arguments = vec!["--quick", "--out", "out", "--blocks", "1,5"];
    arguments.extend(["--simd", "scalar", "--threads", "1"]);
    arguments.extend(["--dictionary", dictionary]);
    arguments.extend(more);
    bench(folder, &arguments)
}

#[test]
fn a_small_run_gives_json_csv_and_plots() {
    let folder = folder();
    let records = json_lines(&small_run(&folder, &["--json"]));
    assert_records(&records);
    let out = folder.path().join("out");
    assert_table(&out.join("bench.csv"), records.len());
    for name in ["maze1", "maze1-frame", "maze5", "maze5-frame"] {
        assert_plot(&out, name);
    }
}

/// Every method and case was measured, and each measurement is a positive number.
fn assert_records(records: &[Value]) {
    let names = |key: &str| -> Vec<String> {
        let name = |record: &Value| record[key].as_str().expect("a name").to_owned();
        records.iter().map(name).collect()
    };
    for record in records {
        for key in ["ms", "rel_l2", "paper_dense_ms", "bytes", "ms_from_lights"] {
            let value = record[key].as_f64().expect("a number");
            assert!(value.is_finite() && value > 0.0, "{key}: {record}");
        }
        // Mobile errs by 6 %; anything else would be another level or other lights.
        if record["method"] == "mrt" {
            assert!(record["rel_l2"].as_f64() < Some(0.1), "{record}");
        }
    }
    let methods = names("method");
    for method in ["mrt", "paper", "dense", "svd", "vpl", "gather"] {
        assert!(methods.iter().any(|name| name == method), "{method}");
    }
    let cases = names("case");
    for case in ["maze1/mobile/scalar/t1", "maze5/mobile/scalar/t1/int8"] {
        assert!(cases.iter().any(|name| name == case), "{cases:?}");
    }
}

/// A table of a head and `count` rows, all of as many columns.
fn assert_table(file: &Path, count: usize) {
    let table = fs::read_to_string(file).expect("a table is written");
    let mut columns = table.lines().map(|line| line.split(',').count());
    let head = columns.next().expect("a head");
    assert!(columns.all(|columns| columns == head), "{table}");
    assert_eq!(table.lines().count(), 1 + count);
}

/// A plot as SVG and as PNG.
fn assert_plot(folder: &Path, name: &str) {
    let file = |extension: &str| folder.join(format!("{name}.{extension}"));
    let svg = fs::read_to_string(file("svg")).expect("a plot is written");
    assert!(svg.starts_with("<svg "), "{name}");
    assert!(svg.contains("<circle "), "{name}");
    assert_well_formed(&svg);
    let png = fs::read(file("png")).expect("a plot is written");
    assert!(png.starts_with(b"\x89PNG"), "{name}");
}

/// Tags of a document are closed in the order in which they were opened, and nothing else looks like a tag.
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
fn exact_solutions_are_kept_for_the_next_run() {
    let folder = folder();
    let first = small_run(&folder, &["--json"]);
    assert!(first.status.success(), "{}", text(&first.stderr));
    let kept = modification_times(&folder.path().join("out/exact"));
    assert_eq!(kept.len(), 2);
    let second = small_run(&folder, &["--storages", "f32"]);
    assert!(second.status.success(), "{}", text(&second.stderr));
    assert_eq!(modification_times(&folder.path().join("out/exact")), kept);
    let report = text(&second.stdout);
    assert!(report.contains("maze5/mobile/scalar/t1"), "{report}");
    assert!(report.contains("% of peak"), "{report}");
}

fn modification_times(folder: &Path) -> BTreeMap<OsString, SystemTime> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let time = |entry: std::io::Result<fs::DirEntry>| {
        let entry = entry.expect("readable");
        let time = entry.metadata().and_then(|data| data.modified());
        (entry.file_name(), time.expect("a time"))
    };
    entries.map(time).collect()
}

#[test]
fn every_figure_states_its_limit_and_whether_it_is_met() {
    let folder = folder();
    let output = bench(&folder, &["--figures", "--quick", "--json", "--out", "out"]);
    let goals = json_lines(&output);
    assert!(text(&output.stderr).contains("high / paper is left out"));
    goals.iter().for_each(assert_goal);
    // These do not depend on the machine's speed.
    for part in [
        "MB of operators",
        "error of a texel",
        "error: standard / paper",
    ] {
        for goal in named(&goals, part) {
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
        named(&goals, part);
    }
    let table = folder.path().join("out/figures.csv");
    let table = fs::read_to_string(table).expect("a table is written");
    assert_eq!(table.lines().count(), 1 + goals.len());
}

/// A goal is met exactly where its measured number is on the asked side of its limit.
fn assert_goal(goal: &Value) {
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

/// The goals whose name contains `part`, of which there is one at least.
fn named<'a>(goals: &'a [Value], part: &str) -> Vec<&'a Value> {
    let is_named = |goal: &&Value| {
        let name = goal["figure"].as_str();
        name.is_some_and(|name| name.contains(part))
    };
    let found: Vec<&Value> = goals.iter().filter(is_named).collect();
    assert!(!found.is_empty(), "{part}");
    found
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
