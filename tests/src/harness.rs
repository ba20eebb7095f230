//! What readers and frames are tried with: for each [`Target`], a function that takes any bytes and panics at a fault.
//!
//! The fuzzers in `fuzz/` call these functions with bytes that libFuzzer makes up, and the tests in `tests/tests/hostile`
//! with the committed corpus and changes of it.

mod target;
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
pub use target::{ChangeBytes, MAX_INPUT_BYTES, Target};

/// All targets.
pub const TARGETS: [Target; 6] = [
    dictionary::TARGET,
    generated_level::TARGET,
    scene_mesh::GLTF,
    level_text::TARGET,
    scene_mesh::OBJ,
    reference_file::TARGET,
];
