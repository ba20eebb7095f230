//! What a path leads to.

use std::fs::{self, FileType, Metadata};
use std::io;
use std::path::{Path, PathBuf};

/// Links that are followed in a row, as on Linux; more are taken for a circle.
const MAX_LINKS: usize = 40;

/// The path after all symbolic links of its last part: that of a file, or of where one would be made.
///
/// # Errors
/// Those of the system; a path that names no file but a folder, as `a/` and `a/..` do; links in a circle; and as
/// [`check_is_file`].
pub fn target_of(path: &Path) -> io::Result<PathBuf> {
    check_name(path)?;
    // The system follows links that have no path, such as standard output's to a pipe.
    check_is_file(path)?;
    let mut target = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::symlink_metadata(&target) {
            Ok(found) if found.is_symlink() => {
                let link = fs::read_link(&target)?;
                // An absolute link replaces the folder.
                target = folder_of(&target).join(link);
            }
            Ok(_) => return Ok(target),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                check_name(&target)?;
                return Ok(target);
            }
            Err(error) => return Err(error),
        }
    }
    let message = format!("found over {MAX_LINKS} symbolic links, one to the next");
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}

/// Refuses paths that cannot be a file's: without a last name, or with a separator at the end.
fn check_name(path: &Path) -> io::Result<()> {
    let text = path.as_os_str().as_encoded_bytes();
    let ends_as_folder = text
        .last()
        .is_some_and(|&last| std::path::is_separator(char::from(last)) || text.ends_with(b"/."));
    if path.file_name().is_none() || ends_as_folder {
        let message = "found the name of a folder; expected that of a file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    Ok(())
}

/// The folder that a file is in.
pub fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// What is known of the plain file at a path; `None` if there is nothing.
///
/// # Errors
/// Those of the system, and [`io::ErrorKind::InvalidInput`] if something else than a file is there: a folder, a pipe, a
/// device, a socket. The message says which.
pub fn check_is_file(path: &Path) -> io::Result<Option<Metadata>> {
    match fs::metadata(path) {
        Ok(found) => check_plain(&found).map(|()| Some(found)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Refuses what is no plain file.
pub(crate) fn check_plain(found: &Metadata) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    let message = format!("found a {}; expected a file", kind_of(found.file_type()));
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}

fn kind_of(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "pipe";
        } else if kind.is_socket() {
            return "socket";
        } else if kind.is_block_device() || kind.is_char_device() {
            return "device";
        }
    }
    if kind.is_dir() {
        "folder"
    } else {
        "special file"
    }
}

/// What tells a file or folder from all others, whatever the path that leads to it. A hard link to a file is that file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity(IdentityKind);

#[derive(Clone, Debug, PartialEq, Eq)]
enum IdentityKind {
    /// Device and number of a file that exists.
    #[cfg(unix)]
    Node(u64, u64),
    /// Where a file is, or would be, without links.
    Place(PathBuf),
}

impl Identity {
    /// That of what a path leads to, or of the file that would be made there; `None` if the path leads nowhere.
    pub fn of(path: &Path) -> Option<Self> {
        #[cfg(unix)]
        if let Ok(found) = fs::metadata(path) {
            return Some(Self::of_metadata(&found));
        }
        if let Ok(place) = path.canonicalize() {
            return Some(Self(IdentityKind::Place(place)));
        }
        let target = target_of(path).ok()?;
        let folder = folder_of(&target).canonicalize().ok()?;
        let place = folder.join(target.file_name()?);
        Some(Self(IdentityKind::Place(place)))
    }

    /// That of an open file.
    #[cfg(unix)]
    pub fn of_metadata(found: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self(IdentityKind::Node(found.dev(), found.ino()))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn links_lead_to_their_file_even_if_it_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("inner")).unwrap();
        symlink("inner/new", at("first")).unwrap();
        symlink(at("first"), at("second")).unwrap();
        assert_eq!(target_of(&at("second")).unwrap(), at("inner/new"));
        assert_eq!(target_of(&at("plain")).unwrap(), at("plain"));
        symlink("circle", at("circle")).unwrap();
        symlink("inner/", at("folder")).unwrap();
        symlink("missing/", at("no folder")).unwrap();
        for bad in ["circle", "no folder", "missing/", "inner/.", "inner/.."] {
            assert!(target_of(&at(bad)).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_file_is_itself_by_all_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "x").unwrap();
        fs::write(at("same bytes"), "x").unwrap();
        fs::hard_link(at("file"), at("hard")).unwrap();
        symlink("hard", at("soft")).unwrap();
        symlink("new", at("dangling")).unwrap();
        let of = |name: &str| Identity::of(&at(name)).unwrap();
        assert_eq!(of("file"), of("hard"));
        assert_eq!(of("file"), of("soft"));
        assert_eq!(of("file"), of("./file"));
        assert_eq!(of("new"), of("dangling"));
        assert_ne!(of("file"), of("same bytes"));
        assert_ne!(of("new"), of("newer"));
        assert_eq!(Identity::of(&at("missing/file")), None);
    }
}
