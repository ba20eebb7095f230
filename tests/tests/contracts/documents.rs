//! Names and paths that the documents cite exist.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Collects all files below a folder but build outputs and hidden ones.
fn files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if path.is_dir() {
            if !name.starts_with('.') && !name.starts_with("target") {
                files(&path, out);
            }
        } else {
            out.push(path);
        }
    }
}

/// All text between single backquotes, outside blocks of code.
fn quoted(text: &str) -> Vec<String> {
    let mut quoted = Vec::new();
    let mut in_block = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
            continue;
        }
        if !in_block {
            let parts = line.split('`').skip(1).step_by(2);
            quoted.extend(parts.map(str::to_owned));
        }
    }
    quoted
}

/// True for names that a reader would search the code for: `Type`, `Type::method`, `snake_case` and `snake::case`.
fn is_name(text: &str) -> bool {
    let is_word = |word: &str| {
        word.starts_with(|c: char| c.is_ascii_alphabetic())
            && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let words: Vec<&str> = text.split("::").collect();
    let is_long = text.contains("::") || text.contains('_');
    let is_type = text.starts_with(|c: char| c.is_ascii_uppercase())
        && text.contains(|c: char| c.is_ascii_lowercase());
    words.iter().all(|word| is_word(word)) && (is_long || is_type)
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|extension| extensions.contains(&extension))
}

/// True for a path below a folder of the checkout.
fn is_path(text: &str) -> bool {
    let starts = [
        "mrt-core/",
        "mrt-runtime/",
        "mrt-dictionary/",
        "mrt-editor/",
        "tests/",
        "docs/",
        "assets/",
        "benches/",
        "fuzz/",
        ".ci/",
    ];
    text.contains('/')
        && starts.iter().any(|start| text.starts_with(start))
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "._-/".contains(c))
}

/// All words of code and manifests outside comments, and all names of such files.
fn words_of_code(all: &[PathBuf]) -> BTreeSet<String> {
    let mut words = BTreeSet::new();
    for path in all
        .iter()
        .filter(|path| has_extension(path, &["rs", "toml"]))
    {
        let text = fs::read_to_string(path).expect("text");
        let code = text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        for line in code {
            let found = line.split(|c: char| !c.is_alphanumeric() && c != '_');
            words.extend(found.map(str::to_owned));
        }
        let stem = path.file_stem();
        words.extend(stem.map(|stem| stem.to_string_lossy().into_owned()));
    }
    words
}

#[test]
fn what_documents_cite_exists() {
    let root = Path::new(ROOT);
    let mut all = Vec::new();
    files(root, &mut all);
    let words = words_of_code(&all);
    let mut faults = Vec::new();
    let documents = all.iter().filter(|path| has_extension(path, &["md"]));
    for document in documents.filter(|path| !path.ends_with("CHANGELOG.md")) {
        let folder = document.parent().expect("a file in a folder");
        for text in quoted(&fs::read_to_string(document).expect("text")) {
            if is_path(&text) {
                // A path is given from the root, or from the document's folder.
                if !root.join(&text).exists() && !folder.join(&text).exists() {
                    faults.push(format!("{}: {text}", document.display()));
                }
            } else if is_name(&text)
                && let Some(missing) = text.split("::").find(|word| !words.contains(*word))
            {
                faults.push(format!("{}: {text} ({missing})", document.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
