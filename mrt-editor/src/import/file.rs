//! Reading a scene's files within limits.

use super::error::ImportError;
use super::limits::MAX_FILE_BYTES;
use std::io::Read;
use std::path::{Path, PathBuf};

/// All bytes of a scene's file.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, ImportError> {
    let io = |source| ImportError::Io {
        path: path.to_owned(),
        source,
    };
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too large from one that just fits, for pipes and devices too.
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(ImportError::TooLarge {
            path: path.to_owned(),
            found: bytes.len() as u64,
        });
    }
    Ok(bytes)
}

/// Why a file that a scene names is not read; the end of a sentence about it.
#[derive(Debug, thiserror::Error)]
pub(super) enum Refusal {
    #[error("is not there")]
    Missing,
    #[error("lies outside the scene's folder, and only files inside it are read")]
    Outside,
    #[error("is no regular file")]
    NotAFile,
    #[error("is larger than the {left} bytes that are left for files of its kind")]
    TooLarge { left: u64 },
    #[error("is one of more than {limit} files of its kind")]
    TooMany { limit: usize },
    #[error("cannot be read: {0}")]
    Unreadable(#[from] std::io::Error),
}

/// The folder of a scene, from which files that the scene names may be read.
pub(super) struct SceneFolder {
    /// Without links; `None` if the folder cannot be found.
    root: Option<PathBuf>,
}

impl SceneFolder {
    /// The folder that holds the file `scene`.
    pub(super) fn of(scene: &Path) -> Self {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        Self {
            root: folder.canonicalize().ok(),
        }
    }

    /// The first of `names`, relative to the scene's folder, that is a regular file inside it; its path without links.
    ///
    /// Nothing is opened, because opening a pipe waits for whoever writes into it.
    pub(super) fn find<N: AsRef<Path>>(
        &self,
        names: impl IntoIterator<Item = N>,
    ) -> Result<PathBuf, Refusal> {
        let mut refusal = Refusal::Missing;
        let Some(root) = &self.root else {
            return Err(refusal);
        };
        for name in names {
            let Ok(path) = root.join(name).canonicalize() else {
                continue;
            };
            if !path.starts_with(root) {
                refusal = Refusal::Outside;
            } else if path.is_file() {
                return Ok(path);
            } else {
                refusal = Refusal::NotAFile;
            }
        }
        Err(refusal)
    }

    /// Where the file at `path`, which [`SceneFolder::find`] gave, lies: a folder relative to the scene's.
    pub(super) fn folder_of(&self, path: &Path) -> PathBuf {
        let folder = path.parent().unwrap_or(Path::new(""));
        match &self.root {
            Some(root) => folder.strip_prefix(root).unwrap_or(folder).to_owned(),
            None => folder.to_owned(),
        }
    }
}

/// All bytes of a file that [`SceneFolder::find`] gave; `left` is how many bytes may be read, and goes down by as many as
/// were.
pub(super) fn read_found(path: &Path, left: &mut u64) -> Result<Vec<u8>, Refusal> {
    let file = std::fs::File::open(path)?;
    let too_large = Refusal::TooLarge { left: *left };
    if file.metadata()?.len() > *left {
        return Err(too_large);
    }
    let mut bytes = Vec::new();
    // The file may have grown since.
    file.take(*left + 1).read_to_end(&mut bytes)?;
    *left = left.checked_sub(bytes.len() as u64).ok_or(too_large)?;
    Ok(bytes)
}

/// What the bytes of a name in a file may mean as a path: as they are, or with the backslashes of Windows as separators.
pub(super) fn spellings(name: &[u8]) -> Vec<PathBuf> {
    let mut paths = vec![path_of(name)];
    if name.contains(&b'\\') {
        let slashes = |byte: &u8| if *byte == b'\\' { b'/' } else { *byte };
        paths.push(path_of(&name.iter().map(slashes).collect::<Vec<u8>>()));
    }
    paths
}

/// The last part of a path, whatever its separators: files that were written on another machine often lie beside the
/// scene on this one.
pub(super) fn base_name(name: &[u8]) -> PathBuf {
    let base = name.rsplit(|byte| matches!(byte, b'/' | b'\\')).next();
    path_of(base.unwrap_or_default())
}

#[cfg(unix)]
fn path_of(name: &[u8]) -> PathBuf {
    use std::os::unix::ffi::OsStrExt;
    PathBuf::from(std::ffi::OsStr::from_bytes(name))
}

#[cfg(not(unix))]
fn path_of(name: &[u8]) -> PathBuf {
    PathBuf::from(String::from_utf8_lossy(name).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn only_regular_files_inside_the_folder_are_found() {
        let outer = tempfile::tempdir().expect("a folder");
        let inner = outer.path().join("scene");
        fs::create_dir_all(inner.join("textures")).expect("writable");
        fs::write(outer.path().join("secret"), "x").expect("writable");
        fs::write(inner.join("textures/a.png"), "x").expect("writable");
        let folder = SceneFolder::of(&inner.join("a.obj"));
        let find = |name: &[u8]| folder.find(spellings(name));
        let found = find(b"textures\\a.png").expect("inside");
        assert_eq!(folder.folder_of(&found), Path::new("textures"));
        assert!(find(b"textures/../textures/a.png").is_ok());
        assert!(matches!(find(b"../secret"), Err(Refusal::Outside)));
        assert!(matches!(find(b"/etc/passwd"), Err(Refusal::Outside)));
        assert!(matches!(find(b"textures"), Err(Refusal::NotAFile)));
        assert!(matches!(find(b"gone"), Err(Refusal::Missing)));
        assert!(matches!(find(b"nul\0"), Err(Refusal::Missing)));
        #[cfg(unix)]
        {
            let link = |to: &str, name: &str| {
                std::os::unix::fs::symlink(to, inner.join(name)).expect("writable");
            };
            link("../secret", "out");
            link("textures/a.png", "in");
            assert!(matches!(find(b"out"), Err(Refusal::Outside)));
            assert_eq!(find(b"in").expect("inside"), found);
        }
    }

    #[test]
    fn a_file_beyond_what_is_left_is_not_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        fs::write(&path, [0; 10]).expect("writable");
        let mut left = 15;
        assert_eq!(read_found(&path, &mut left).expect("fits").len(), 10);
        assert_eq!(left, 5);
        let refused = read_found(&path, &mut left);
        assert!(matches!(refused, Err(Refusal::TooLarge { left: 5 })));
        assert_eq!(left, 5);
    }
}
