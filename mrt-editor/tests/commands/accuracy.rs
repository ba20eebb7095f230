//! `mrt accuracy`.

use crate::common::{assert_refused, folder, json_lines, mrt, text};
use mrt_core::reference::oracle_file::oracle_folder;
use std::ffi::OsString;

/// A reference file by its name.
fn reference(name: &str) -> OsString {
    let oracle = oracle_folder().expect("shared/oracle exists");
    oracle.join(name).into_os_string()
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn every_light_is_one_object() {
    let arguments = [
        "accuracy".into(),
        reference("cube.json"),
        reference("corridor5.json"),
        "--json".into(),
    ];
    let lines = json_lines(&mrt(&folder(), &arguments));
    assert!(lines.len() > 2, "{lines:?}");
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
fn probes_are_compared_too() {
    let arguments = [
        "accuracy".into(),
        reference("cube_probes.json"),
        "--json".into(),
    ];
    // The 32 modes of the built-in dictionary err by under a tenth.
    for line in json_lines(&mrt(&folder(), &arguments)) {
        let error = line["rel_l2"].as_f64().expect("a number");
        assert!(error > 0.0 && error < 0.12, "{line}");
    }
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn a_reference_that_cannot_be_compared_does_not_stop_the_others() {
    let folder = folder();
    // The set cubes-2d has no way up.
    let flat = |files: &[OsString]| {
        let mut arguments = vec!["accuracy".into()];
        arguments.extend_from_slice(files);
        arguments.extend(["--set".into(), "cubes-2d".into(), "--json".into()]);
        mrt(&folder, &arguments)
    };
    for (name, subject) in [
        ("stack3.json", "stack3"),
        ("no-such-file.json", "no-such-file.json"),
    ] {
        let output = flat(&[reference(name)]);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.contains(subject), "{error}");
        assert!(!error.contains("panicked"), "{error}");
        assert!(output.stdout.is_empty());
    }
    let error = text(&flat(&[reference("stack3.json")]).stderr);
    assert!(error.contains("cubes-3d"), "{error}");

    let both = flat(&[reference("stack3.json"), reference("cube.json")]);
    assert_eq!(both.status.code(), Some(1));
    assert!(text(&both.stdout).lines().count() > 0);
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn faulty_flags_are_refused() {
    let folder = folder();
    for [flag, value] in [["--albedo", "1.5"], ["--set", "pyramids"]] {
        let arguments = [
            "accuracy".into(),
            reference("cube.json"),
            flag.into(),
            value.into(),
        ];
        assert_refused(&mrt(&folder, &arguments), value);
    }
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn a_stack_is_compared_with_a_set_that_opens_upwards() {
    let arguments = [
        "accuracy".into(),
        reference("stack3.json"),
        "--preset".into(),
        "mobile".into(),
        "--json".into(),
    ];
    let lines = json_lines(&mrt(&folder(), &arguments));
    assert_eq!(lines.len(), 3, "{lines:?}");
    for line in lines {
        let error = line["rel_l2"].as_f64().expect("a number");
        // The mobile preset's bound in white levels is 8 % in the mean.
        assert!(error < 0.15, "{line}");
    }
}
