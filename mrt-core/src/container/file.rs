//! Reads and writes whole files.

use super::budget::ByteBudget;
use super::error::ContainerError;
use super::place::{check_is_file, folder_of, target_of};
use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Reads a whole file, whose length is first taken from `budget`.
///
/// # Errors
/// [`ContainerError::Io`], also for folders, pipes and devices, and [`ContainerError::LimitExceeded`] if `budget` has
/// fewer bytes left.
pub fn read_file(path: &Path, budget: &mut ByteBudget) -> Result<Vec<u8>, ContainerError> {
    let io_error = in_place(path);
    // Before it is opened: opening a pipe waits until somebody writes to it.
    check_is_file(path).map_err(&io_error)?;
    let file = File::open(path).map_err(&io_error)?;
    let length = file.metadata().map_err(&io_error)?.len();
    budget.spend("file", length)?;
    let mut bytes = Vec::new();
    // If the file grows meanwhile, no more is read than the budget was charged for.
    file.take(length)
        .read_to_end(&mut bytes)
        .map_err(&io_error)?;
    Ok(bytes)
}

/// Writes a file so that `path` holds either what it held before or all of `bytes`, never a part, even if the program
/// or the machine stops meanwhile.
///
/// See [`StagedFile`] for links, permissions and what is refused.
///
/// # Errors
/// [`ContainerError::Io`]; the file is then as it was.
pub fn write_file_atomically(path: &Path, bytes: &[u8]) -> Result<(), ContainerError> {
    StagedFile::write(path, bytes)?.commit()
}

/// Checks that [`write_file_atomically`] can make a file in a folder, by making one that is removed again.
///
/// # Errors
/// [`ContainerError::Io`], with the folder's path.
pub fn check_folder_is_writable(folder: &Path) -> Result<(), ContainerError> {
    // Removed when it is dropped.
    let part = Part::create(folder).map_err(in_place(folder))?;
    drop(part);
    Ok(())
}

/// The new content of a file, on the disk beside it, which [`StagedFile::commit`] puts in its place.
///
/// Several files can be staged first and committed together, so that an error while writing changes none of them. A
/// symbolic link is followed, also to a file that does not exist yet: the link stays. A file that is replaced passes on
/// its permissions. Folders, pipes, devices and sockets are refused.
///
/// Until then the bytes are in a file of the same folder with a short name, `.mrt-` with eight digits and `.part`. It is
/// removed when this value is dropped; [`remove_abandoned_parts`] removes those of programs that were killed.
#[derive(Debug)]
pub struct StagedFile {
    part: Part,
    target: PathBuf,
}

impl StagedFile {
    /// Writes `bytes` beside the file that `path` leads to, and waits until they are on the disk.
    ///
    /// # Errors
    /// [`ContainerError::Io`]; nothing is left behind.
    pub fn write(path: &Path, bytes: &[u8]) -> Result<Self, ContainerError> {
        let io_error = in_place(path);
        let target = target_of(path).map_err(&io_error)?;
        let replaced = check_is_file(&target).map_err(&io_error)?;
        let mut part = Part::create(folder_of(&target)).map_err(&io_error)?;
        if let Some(replaced) = replaced {
            // Before the first byte: what only its owner may read is never open to others.
            let permissions = passed_on(replaced.permissions());
            part.file.set_permissions(permissions).map_err(&io_error)?;
        }
        part.file.write_all(bytes).map_err(&io_error)?;
        part.file.sync_all().map_err(&io_error)?;
        Ok(Self { part, target })
    }

    /// Puts the new content in the file's place.
    ///
    /// # Errors
    /// [`ContainerError::Io`]; unless only the last step failed, which waits for the folder to reach the disk, the file
    /// is as it was.
    pub fn commit(self) -> Result<(), ContainerError> {
        fs::rename(&self.part.path, &self.target).map_err(in_place(&self.target))?;
        // The rename reaches the disk when its folder is synchronised. Only Unix can open a folder.
        #[cfg(unix)]
        {
            let folder = folder_of(&self.target);
            File::open(folder)
                .and_then(|folder| folder.sync_all())
                .map_err(in_place(folder))?;
        }
        Ok(())
    }
}

/// The permissions of a file that is replaced, for the one that replaces it: who may read, write and execute it.
#[cfg(unix)]
fn passed_on(replaced: fs::Permissions) -> fs::Permissions {
    use std::os::unix::fs::PermissionsExt;
    fs::Permissions::from_mode(replaced.mode() & 0o777)
}

/// Permissions elsewhere are a mark that a file may not be written, and such a file cannot be replaced.
#[cfg(not(unix))]
fn passed_on(replaced: fs::Permissions) -> fs::Permissions {
    replaced
}

/// A new file under a temporary name, which is removed when this value is dropped. The lock says that its program runs.
#[derive(Debug)]
struct Part {
    file: File,
    path: PathBuf,
}

const PART_START: &str = ".mrt-";
const PART_END: &str = ".part";
const PART_DIGITS: usize = 8;

/// Names that are tried: with 2^32 of them, a second is hardly ever needed.
const PART_NAMES: usize = 16;

impl Part {
    fn create(folder: &Path) -> io::Result<Self> {
        let mut taken = None;
        for _ in 0..PART_NAMES {
            // The standard library has no random numbers but the keys of its hash maps.
            let number = RandomState::new().hash_one(std::process::id()) as u32;
            let path = folder.join(format!("{PART_START}{number:08x}{PART_END}"));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    // Where there are no locks, as on some network drives, no file can be taken for abandoned either.
                    let _ = file.try_lock();
                    return Ok(Self { file, path });
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => taken = Some(error),
                Err(error) => return Err(error),
            }
        }
        Err(taken.unwrap_or_else(|| io::ErrorKind::AlreadyExists.into()))
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // After the rename there is none. An error is ignored: the one that led here says more.
        let _ = fs::remove_file(&self.path);
    }
}

/// Parts that are younger are never taken for abandoned: their program may be about to lock them.
const LEAST_AGE: Duration = Duration::from_secs(60);

/// Removes the temporary files in a folder that programs left behind which were killed while they wrote: files with the
/// names that [`StagedFile`] gives, over a minute old, and locked by nobody.
///
/// Nothing is reported: what cannot be read, locked or removed stays.
pub fn remove_abandoned_parts(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.filter_map(Result::ok) {
        if entry.file_name().to_str().is_some_and(is_part_name) && is_abandoned(&entry) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_part_name(name: &str) -> bool {
    let digits = name.strip_prefix(PART_START);
    let digits = digits.and_then(|rest| rest.strip_suffix(PART_END));
    digits.is_some_and(|digits| {
        digits.len() == PART_DIGITS && digits.bytes().all(|b| b.is_ascii_hexdigit())
    })
}

fn is_abandoned(entry: &fs::DirEntry) -> bool {
    // Of the entry itself, not of what a link leads to.
    let Some(metadata) = entry.metadata().ok().filter(fs::Metadata::is_file) else {
        return false;
    };
    let age = metadata.modified().ok();
    let age = age.and_then(|modified| SystemTime::now().duration_since(modified).ok());
    age.is_some_and(|age| age >= LEAST_AGE)
        && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok())
}

/// Names the file or folder of an error.
fn in_place(path: &Path) -> impl Fn(io::Error) -> ContainerError {
    move |source| ContainerError::Io {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name();
        let mut names: Vec<_> = entries
            .map(|entry| name(entry).into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
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
        let missing = folder.path().join("missing").join("x.bin");
        for bad in [&occupied, &missing, &PathBuf::from("/")] {
            let error = write_file_atomically(bad, b"new").unwrap_err();
            assert!(matches!(error, ContainerError::Io { .. }), "{error}");
        }
        assert_eq!(names(folder.path()), ["baked.bin", "folder"]);
    }

    #[test]
    fn staged_files_change_nothing_until_they_are_committed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "old").unwrap();
        drop(StagedFile::write(&path, b"never seen").unwrap());
        let staged = StagedFile::write(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        staged.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_name_may_be_as_long_as_the_system_allows() {
        let folder = tempfile::tempdir().unwrap();
        let longest = folder.path().join("x".repeat(255));
        write_file_atomically(&longest, b"new").unwrap();
        assert_eq!(fs::read(&longest).unwrap(), b"new");
    }

    #[test]
    fn only_old_parts_that_nobody_writes_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let aged = |name: &str| {
            let file = File::create(at(name)).unwrap();
            let age = SystemTime::now() - 2 * LEAST_AGE;
            file.set_modified(age).unwrap();
            file
        };
        aged(".mrt-0123abcd.part");
        let others = [
            "mrt-0123abcd.part",
            ".mrt-0123abc.part",
            ".mrt-0123abcg.part",
            ".mrt-0123abcd.parts",
            ".other-0123abcd.part",
        ];
        for other in others {
            aged(other);
        }
        let written = aged(".mrt-00000001.part");
        written.lock().unwrap();
        File::create(at(".mrt-00000002.part")).unwrap();
        fs::create_dir(at(".mrt-00000003.part")).unwrap();
        let kept = names(folder.path());
        remove_abandoned_parts(folder.path());
        let kept: Vec<String> = kept
            .into_iter()
            .filter(|name| name != ".mrt-0123abcd.part")
            .collect();
        assert_eq!(names(folder.path()), kept);
        assert_eq!(kept.len(), others.len() + 3);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_permissions_are_passed_on() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "old").unwrap();
        symlink("file", at("link")).unwrap();
        symlink("made", at("dangling")).unwrap();
        for mode in [0o600, 0o640, 0o755, 0o444] {
            fs::set_permissions(at("file"), fs::Permissions::from_mode(mode)).unwrap();
            write_file_atomically(&at("link"), b"new").unwrap();
            let found = fs::symlink_metadata(at("file")).unwrap();
            assert_eq!(found.permissions().mode() & 0o7777, mode);
        }
        write_file_atomically(&at("dangling"), b"new").unwrap();
        for name in ["link", "dangling"] {
            assert!(fs::symlink_metadata(at(name)).unwrap().is_symlink());
            assert_eq!(fs::read(at(name)).unwrap(), b"new");
        }
        assert_eq!(names(folder.path()), ["dangling", "file", "link", "made"]);
    }

    #[cfg(unix)]
    #[test]
    fn sockets_and_devices_are_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        for (path, kind) in [(&*socket, "socket"), (Path::new("/dev/null"), "device")] {
            let written = write_file_atomically(path, b"new").unwrap_err();
            let read = read_file(path, &mut ByteBudget::new(1000)).unwrap_err();
            for error in [written, read] {
                assert!(error.to_string().contains(kind), "{error}");
            }
        }
        assert_eq!(names(folder.path()), ["socket"]);
    }
}
