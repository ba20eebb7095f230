//! Help and wrong usage.

use crate::common::{folder, mrt, names, text};

const COMMANDS: [&str; 8] = [
    "demo", "bake", "adapt", "info", "accuracy", "map", "light", "pack",
];

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
