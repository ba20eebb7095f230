//! What fuzzers found worth keeping, and a bounded number of changes of it, for each target of the harness.

use mrt_tests::harness::{
    TARGETS, Target, corpus_folder, dictionary, generated_level, level_text, reference_file,
    scene_mesh, try_corpus,
};

/// Tries the corpus of a target and this many changes: as many as take a few seconds.
fn try_target(target: &Target, changes: usize) {
    let inputs = try_corpus(target, changes);
    println!("{}: {inputs} inputs and {changes} changes", target.name);
    assert!(inputs >= 10, "{inputs} inputs");
}

#[test]
fn dictionaries() {
    try_target(&dictionary::TARGET, 20_000);
}

#[test]
fn generated_levels() {
    try_target(&generated_level::TARGET, 3000);
}

#[test]
fn gltf_files() {
    try_target(&scene_mesh::GLTF, 20_000);
}

#[test]
fn level_texts() {
    try_target(&level_text::TARGET, 10_000);
}

#[test]
fn obj_files() {
    try_target(&scene_mesh::OBJ, 10_000);
}

#[test]
fn reference_files() {
    try_target(&reference_file::TARGET, 20_000);
}

/// Committed inputs stay few: a checkout should not grow with every hour of fuzzing.
#[test]
fn corpora_are_small() {
    let size = |target: &Target| -> u64 {
        let entries = std::fs::read_dir(corpus_folder(target)).expect("a corpus");
        let length = |entry: std::fs::DirEntry| entry.metadata().expect("a file").len();
        entries.map(|entry| length(entry.expect("an entry"))).sum()
    };
    let bytes: u64 = TARGETS.iter().map(size).sum();
    assert!(bytes < 2 << 20, "{bytes} bytes");
}
