//! Finds the folder of reference files.

use std::path::{Path, PathBuf};

/// The folder of reference files, if it exists.
///
/// It is `oracle` in the folder that the environment variable `MRT_SHARED` names. If that is not set,
/// it is `shared/oracle` in the folder of this package or in any folder above it.
pub fn oracle_folder() -> Option<PathBuf> {
    if let Some(shared) = std::env::var_os("MRT_SHARED") {
        return Some(PathBuf::from(shared).join("oracle")).filter(|folder| folder.is_dir());
    }
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|above| above.join("shared").join("oracle"))
        .find(|folder| folder.is_dir())
}

/// [`oracle_folder`] for a test that needs it. If the folder is missing, it reports on standard error
/// which test did not run and why, and returns `None`.
///
/// # Panics
/// If the folder is missing and the environment variable `CI` is set.
pub fn oracle_folder_or_report(test: &str) -> Option<PathBuf> {
    let folder = oracle_folder();
    if folder.is_none() {
        let line = format!("not run: {test}: oracle folder not found; set MRT_SHARED");
        assert!(std::env::var_os("CI").is_none(), "{line}");
        // The test harness hides the output of `eprintln` when a test passes.
        use std::io::Write;
        let written = writeln!(std::io::stderr(), "{line}");
        assert!(written.is_ok(), "{line}");
    }
    folder
}
