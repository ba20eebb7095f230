//! Reads and writes whole files.

use super::budget::ByteBudget;
use super::error::ContainerError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Reads a whole file, whose length is first taken from `budget`.
///
/// # Errors
/// [`ContainerError::Io`], and [`ContainerError::LimitExceeded`] if `budget` has fewer bytes left.
pub fn read_file(path: &Path, budget: &mut ByteBudget) -> Result<Vec<u8>, ContainerError> {
    let io_error = |source| ContainerError::Io {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(io_error)?;
    let length = file.metadata().map_err(io_error)?.len();
    budget.spend("file", length)?;
    let mut bytes = Vec::new();
    // If the file grows meanwhile, no more is read than the budget was charged for.
    file.take(length)
        .read_to_end(&mut bytes)
        .map_err(io_error)?;
    Ok(bytes)
}

/// Writes a file so that `path` holds either what it held before or all of `bytes`, never a part.
///
/// The bytes go to a temporary file in the same folder, which is synchronised to the disk and then
/// renamed.
///
/// # Errors
/// [`ContainerError::Io`]. The temporary file is then removed.
pub fn write_file_atomically(path: &Path, bytes: &[u8]) -> Result<(), ContainerError> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let io_error = |path: &Path| {
        let path = path.to_owned();
        move |source| ContainerError::Io { path, source }
    };
    let Some(name) = path.file_name() else {
        return Err(io_error(path)(io::ErrorKind::InvalidInput.into()));
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
    let mut temporary_name = std::ffi::OsString::from(".");
    temporary_name.push(name);
    temporary_name.push(format!(".{}-{unique}.tmp", std::process::id()));
    let temporary = folder.join(temporary_name);

    let write = || -> Result<(), ContainerError> {
        // A crashed process of the same number may have left a file: truncate it.
        let mut file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .open(&temporary)
            .map_err(io_error(path))?;
        file.write_all(bytes).map_err(io_error(path))?;
        file.sync_all().map_err(io_error(path))?;
        drop(file);
        fs::rename(&temporary, path).map_err(io_error(path))
    };
    if let Err(error) = write() {
        // An error of removing is ignored: the first error says more.
        let _ = fs::remove_file(&temporary);
        return Err(error);
    }
    // The rename reaches the disk when its folder is synchronised. Only Unix can open a folder.
    #[cfg(unix)]
    File::open(folder)
        .and_then(|folder| folder.sync_all())
        .map_err(io_error(folder))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn files_appear_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let names = || {
            let entries = fs::read_dir(folder.path()).unwrap();
            let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let path = folder.path().join("baked.bin");
        write_file_atomically(&path, b"old").unwrap();
        write_file_atomically(&path, &[7; 1000]).unwrap();
        let mut budget = ByteBudget::new(10_000);
        assert_eq!(read_file(&path, &mut budget).unwrap(), [7; 1000]);
        assert_eq!(budget.remaining(), 10_000 - 1000);
        let error = read_file(&path, &mut ByteBudget::new(100)).unwrap_err();
        assert!(
            matches!(error, ContainerError::LimitExceeded { .. }),
            "{error}"
        );
        // A folder cannot be replaced by a file.
        let occupied = folder.path().join("folder");
        fs::create_dir(&occupied).unwrap();
        fs::write(occupied.join("file"), b"x").unwrap();
        let missing = folder.path().join("missing").join("x.bin");
        for bad in [&occupied, &missing, &PathBuf::from("/")] {
            let error = write_file_atomically(bad, b"new").unwrap_err();
            assert!(matches!(error, ContainerError::Io { .. }), "{error}");
        }
        assert_eq!(names(), ["baked.bin", "folder"]);
    }
}
