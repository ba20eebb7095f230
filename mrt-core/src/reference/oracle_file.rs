//! Reads reference solutions (`NAME.json` beside `NAME.f32`) and turns them into what a solver
//! computes.
//!
//! The format is described beside the files (`oracle/README.md`). Both files are checked in full
//! before anything is returned: sizes against limits before they are read, every number for NaN, and
//! the list of walls against the one that the cells imply.

mod error;
mod reference_file;
mod context;
mod description;
mod parse;
mod folder;

use std::path::PathBuf;

pub use error::ReferenceError;
pub use folder::ground_truth_folder;
pub use parse::{from_bytes, read};
pub use reference_file::{Kind, PROBE_BOUNCES, RGB_BOUNCES, ReferenceFile};

/// Reference files of white walls and flat levels, which every set of shapes can build.
pub const WHITE_LEVELS: [&str; 6] = [
    "cube",
    "corridor5",
    "l_turn",
    "t_junction",
    "room3x3",
    "maze11",
];

/// The folder of reference files, `oracle`, if it exists; see [`ground_truth_folder`].
pub fn oracle_folder() -> Option<PathBuf> {
    ground_truth_folder("oracle")
}
