//! All that is depended on has a permissive licence and comes from the registry: the lists of `deny.toml`, without a tool.

use serde_json::Value;
use std::process::Command;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Manifests of the workspace, and of the packages outside it.
const MANIFESTS: [&str; 3] = ["Cargo.toml", "tests/web/Cargo.toml", "fuzz/Cargo.toml"];

const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// The lines of a list of `deny.toml`.
fn listed(text: &str, list: &str) -> Vec<String> {
    let start = format!("{list} = [");
    let lines = text.lines().skip_while(|line| *line != start).skip(1);
    let lines = lines.take_while(|line| *line != "]");
    lines.map(str::to_owned).collect()
}

/// The licences that `deny.toml` allows to all packages, and pairs of a package and a licence that only it may have.
fn allowed() -> (Vec<String>, Vec<[String; 2]>) {
    let text = std::fs::read_to_string(format!("{ROOT}/deny.toml")).expect("deny.toml");
    let quoted = |line: &str, k: usize| line.split('"').nth(2 * k + 1).map(str::to_owned);
    let licences = listed(&text, "allow");
    let exceptions = listed(&text, "exceptions");
    (
        licences.iter().filter_map(|line| quoted(line, 0)).collect(),
        exceptions
            .iter()
            .filter_map(|line| Some([quoted(line, 0)?, quoted(line, 1)?]))
            .collect(),
    )
}

/// Whether an SPDX expression can be met with allowed licences alone. `A/B` is an old way to write `A OR B`; `AND` binds
/// tighter than `OR`.
fn is_met(expression: &str, allowed: &[String]) -> bool {
    let spaced = expression.replace('/', " OR ");
    let spaced = spaced.replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let (met, rest) = any_of(&words, allowed);
    assert!(rest.is_empty(), "{expression}");
    met
}

fn any_of<'w>(mut words: &'w [&'w str], allowed: &[String]) -> (bool, &'w [&'w str]) {
    let mut met = false;
    loop {
        let (all, rest) = all_of(words, allowed);
        met |= all;
        match rest.split_first() {
            Some((&"OR", rest)) => words = rest,
            _ => return (met, rest),
        }
    }
}

fn all_of<'w>(mut words: &'w [&'w str], allowed: &[String]) -> (bool, &'w [&'w str]) {
    let mut met = true;
    loop {
        let (one, rest) = one_of(words, allowed);
        met &= one;
        match rest.split_first() {
            Some((&"AND", rest)) => words = rest,
            _ => return (met, rest),
        }
    }
}

/// A licence, perhaps with an exception, or an expression in parentheses.
fn one_of<'w>(words: &'w [&'w str], allowed: &[String]) -> (bool, &'w [&'w str]) {
    let is_allowed = |name: &str| allowed.iter().any(|other| other == name);
    match words {
        ["(", rest @ ..] => {
            let (met, rest) = any_of(rest, allowed);
            let rest = rest.strip_prefix(&[")"]).expect("a closing parenthesis");
            (met, rest)
        }
        [name, "WITH", exception, rest @ ..] => {
            (is_allowed(&format!("{name} WITH {exception}")), rest)
        }
        [name, rest @ ..] => (is_allowed(name), rest),
        [] => (false, words),
    }
}

/// What cargo says about all packages of a manifest.
fn metadata(manifest: &str) -> Value {
    let manifest = format!("{ROOT}/{manifest}");
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version=1",
            "--locked",
            "--manifest-path",
            &manifest,
        ])
        .output()
        .expect("cargo runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{manifest}: {said}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn expressions_of_licences_are_understood() {
    let allowed = ["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"].map(str::to_owned);
    for (expression, met) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("GPL-3.0 OR MIT", true),
        ("GPL-3.0/MIT", true),
        ("GPL-3.0 AND MIT", false),
        ("MIT AND Zlib", true),
        ("GPL-3.0 OR MIT AND Zlib", true),
        ("(GPL-3.0 OR MIT) AND MPL-2.0", false),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("Apache-2.0", false),
    ] {
        assert_eq!(is_met(expression, &allowed), met, "{expression}");
    }
}

#[test]
fn every_package_is_permissive_and_from_the_registry() {
    let (allowed, exceptions) = allowed();
    assert!(allowed.iter().any(|licence| licence == "MIT"));
    let mut faults = Vec::new();
    for manifest in MANIFESTS {
        let metadata = metadata(manifest);
        let packages = metadata["packages"].as_array().expect("packages");
        assert!(packages.len() > 5, "{manifest}");
        for package in packages {
            let (name, licence) = (&package["name"], package["license"].as_str());
            let mut allowed = allowed.clone();
            let own = exceptions.iter().filter(|[package, _]| name == package);
            allowed.extend(own.map(|[_, licence]| licence.clone()));
            if !licence.is_some_and(|licence| is_met(licence, &allowed)) {
                faults.push(format!("{manifest}: {name} has licence {licence:?}"));
            }
            // Packages of this checkout have no source.
            if !(package["source"].is_null() || package["source"] == REGISTRY) {
                faults.push(format!("{manifest}: {name} is from {}", package["source"]));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
