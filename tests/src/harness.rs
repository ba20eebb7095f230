//! What readers and frames are tried with: for each [`Target`], a function that takes any bytes and panics at a fault.
//!
//! The fuzzers in `fuzz/` call these functions with bytes that libFuzzer makes up, and the tests in `tests/tests/hostile`
//! with the committed corpus and changes of it.

mod random_bytes;
mod container_parts;
mod glb_parts;
mod sound;
pub mod dictionary;
pub mod generated_level;
pub mod level_text;
pub mod reference_file;
pub mod scene_mesh;
mod corpus;

pub use container_parts::{Part, Parts};
pub use corpus::{corpus_folder, try_corpus};
pub use glb_parts::GlbParts;
pub use random_bytes::{change_bytes, change_tokens};

use crate::random::Random;

/// Changes bytes a little. The number is the most bytes that there may be afterwards.
pub type ChangeBytes<'a> = dyn FnMut(&mut Vec<u8>, usize) + 'a;

/// Something that takes bytes from strangers.
pub struct Target {
    /// Name of the fuzzer and of the folder of its corpus.
    pub name: &'static str,
    /// Tries bytes; panics at a fault.
    pub run: fn(&[u8]),
    /// Changes bytes, the more often usefully the more it knows of the format. Random choices come from the generator,
    /// and changes of a format's parts from the last argument.
    pub mutate: fn(&[u8], &mut Random, &mut ChangeBytes<'_>) -> Vec<u8>,
    /// Words of the format, for changes of text.
    pub words: &'static [&'static str],
}

/// All targets.
pub const TARGETS: [Target; 6] = [
    dictionary::TARGET,
    generated_level::TARGET,
    scene_mesh::GLTF,
    level_text::TARGET,
    scene_mesh::OBJ,
    reference_file::TARGET,
];

/// Most bytes of an input: faults hide in structure, not in length, and short inputs are tried sooner.
pub const MAX_INPUT_BYTES: usize = 1 << 16;

/// [`Target::mutate`] for formats of which nothing is known.
fn mutate_plain(bytes: &[u8], _: &mut Random, change: &mut ChangeBytes<'_>) -> Vec<u8> {
    let mut changed = bytes.to_vec();
    change(&mut changed, MAX_INPUT_BYTES);
    changed
}

/// Runs `read`, and returns what it returns and the most bytes that were allocated meanwhile.
fn measured<T>(read: impl FnOnce() -> T) -> (T, u64) {
    let mut result = None;
    let allocated = allocation_counter::measure(|| result = Some(read()));
    (result.expect("it ran"), allocated.bytes_max)
}
