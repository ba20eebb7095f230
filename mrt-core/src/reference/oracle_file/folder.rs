//! Finds the folders of ground truth.
//!
//! The build script `tests/build.rs` includes this file, which therefore imports nothing of this crate.

use std::path::{Path, PathBuf};

/// A folder of ground truth, if it exists.
///
/// It is `name` in the folder that the environment variable `MRT_SHARED` names. If that is not set, it
/// is `shared/name` in the folder of this package or in any folder above it.
pub fn ground_truth_folder(name: &str) -> Option<PathBuf> {
    if let Some(shared) = std::env::var_os("MRT_SHARED").filter(|shared| !shared.is_empty()) {
        return Some(PathBuf::from(shared).join(name)).filter(|folder| folder.is_dir());
    }
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|above| above.join("shared").join(name))
        .find(|folder| folder.is_dir())
}
