//! The committed inputs, and changes of them.

use super::random_bytes::{change_bytes, change_tokens};
use super::target::{MAX_INPUT_BYTES, Target};
use crate::random::Random;
use std::path::PathBuf;

/// The folder of a target's committed inputs.
pub fn corpus_folder(target: &Target) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/corpus")).join(target.name)
}

/// Tries all committed inputs of a target, and `changes` inputs made of them, the same ones everywhere. Returns how many
/// inputs are committed.
///
/// # Panics
/// At a fault, or if the corpus cannot be read.
pub fn try_corpus(target: &Target, changes: usize) -> usize {
    let entries = std::fs::read_dir(corpus_folder(target)).expect("a committed corpus");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    let read = |path: &PathBuf| std::fs::read(path).expect("an input");
    let inputs: Vec<Vec<u8>> = paths.iter().map(read).collect();
    for input in &inputs {
        (target.run)(input);
    }
    let mut random = Random(2026);
    for _ in 0..changes {
        let mut input = inputs[random.below(inputs.len())].clone();
        for _ in 0..1 + random.below(3) {
            input = changed(target, &input, &mut random);
        }
        (target.run)(&input);
    }
    inputs.len()
}

fn changed(target: &Target, input: &[u8], random: &mut Random) -> Vec<u8> {
    // The parts of a format and their content are chosen by generators of their own.
    let mut inner = Random(random.bits());
    let mut change = |bytes: &mut Vec<u8>, most: usize| {
        if target.words.is_empty() || inner.below(2) == 0 {
            change_bytes(&mut inner, bytes, most);
        } else {
            change_tokens(&mut inner, bytes, most, target.words);
        }
    };
    let mut changed = (target.mutate)(input, random, &mut change);
    changed.truncate(MAX_INPUT_BYTES);
    changed
}
