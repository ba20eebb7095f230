//! Checks of the files that a command is asked to write. They come before its work, which may take minutes.
//!
//! An output names a file and never a stream: the report goes to standard output, and whoever reads a level or a
//! dictionary needs all of it. So pipes, devices and `-` are refused.

use mrt_core::container::place::{Identity, check_is_file, folder_of, target_of};
use mrt_core::container::{ContainerError, check_folder_is_writable, remove_abandoned_parts};
use std::io;
use std::path::{Path, PathBuf};

/// Why an output is refused.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The output would replace what the command reads.
    #[error("{flag} {}: found {}, which is read; expected another file", path.display(), input.display())]
    IsInput {
        /// The flag that names the output.
        flag: &'static str,
        /// The output.
        path: PathBuf,
        /// The input that is the same file.
        input: PathBuf,
    },
    /// Two outputs are one file.
    #[error("{flag} {}: found the file of {}, which is written too; expected two files", path.display(), other.display())]
    Twice {
        /// The flag that names the second output.
        flag: &'static str,
        /// The second output.
        path: PathBuf,
        /// The first output.
        other: PathBuf,
    },
    /// The output is the file that standard output goes to.
    #[error("{flag} {}: found standard output, which holds the report; expected a file", path.display())]
    IsStandardOutput {
        /// The flag that names the output.
        flag: &'static str,
        /// The output.
        path: PathBuf,
    },
    /// No file can be there, or something else is.
    #[error("{flag} {}: {source}", path.display())]
    NoFile {
        /// The flag that names the output.
        flag: &'static str,
        /// The output.
        path: PathBuf,
        /// What the system says, or what was found.
        source: io::Error,
    },
    /// The folder does not exist.
    #[error("{flag} {}: found no folder {}; expected one that exists", path.display(), folder.display())]
    NoFolder {
        /// The flag that names the output.
        flag: &'static str,
        /// The output.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// A file stands where the output folder should be.
    #[error("{flag} {}: found a file; expected a folder or a new name", path.display())]
    FolderIsFile {
        /// The flag that names the folder.
        flag: &'static str,
        /// The file.
        path: PathBuf,
    },
    /// Files cannot be made in the folder.
    #[error("{flag} {}: {source}", path.display())]
    NotWritable {
        /// The flag that names the output.
        flag: &'static str,
        /// The output.
        path: PathBuf,
        /// What the system says of which folder.
        source: ContainerError,
    },
}

/// What a command reads, and what of its outputs has been checked.
#[derive(Clone, Debug)]
pub struct OutputFiles {
    inputs: Vec<(PathBuf, Identity)>,
    outputs: Vec<(PathBuf, Identity)>,
}

impl OutputFiles {
    /// For a command that reads these files. Those that are missing will be reported when they are read.
    pub fn new<'a>(inputs: impl IntoIterator<Item = &'a Path>) -> Self {
        let identified = inputs
            .into_iter()
            .filter_map(|path| Some((path.to_owned(), Identity::of(path)?)));
        Self {
            inputs: identified.collect(),
            outputs: Vec::new(),
        }
    }

    /// Checks that a file can be written: it is no input and no other output, by whatever links, it is no folder, pipe
    /// or device, its name is legal, and its folder is there and can be written to. Parts of files that killed programs
    /// left in that folder are removed.
    ///
    /// # Errors
    /// [`OutputError`]; `flag` is named in it.
    pub fn check_file(&mut self, flag: &'static str, path: &Path) -> Result<(), OutputError> {
        let no_file = |source| OutputError::NoFile {
            flag,
            path: path.to_owned(),
            source,
        };
        if path == Path::new("-") {
            let message = "found the sign for standard output, which holds the report; expected a file, or ./- if that \
                           is its name";
            return Err(no_file(io::Error::new(
                io::ErrorKind::InvalidInput,
                message,
            )));
        }
        let target = target_of(path).map_err(no_file)?;
        let folder = folder_of(&target);
        if !folder.is_dir() {
            return Err(OutputError::NoFolder {
                flag,
                path: path.to_owned(),
                folder: folder.to_owned(),
            });
        }
        let found = check_is_file(&target).map_err(no_file)?;
        if let Some(identity) = Identity::of(&target) {
            self.check_identity(flag, path, &identity)?;
            if found.is_some() && standard_output().as_ref() == Some(&identity) {
                return Err(OutputError::IsStandardOutput {
                    flag,
                    path: path.to_owned(),
                });
            }
            self.outputs.push((path.to_owned(), identity));
        }
        check_writable(flag, path, folder)
    }

    /// Checks that files can be written into a folder, which is there or can be made, and that none of the files in it
    /// that may be replaced is an input: those with one of the `endings`, such as `png`.
    ///
    /// # Errors
    /// [`OutputError`]; `flag` is named in it.
    pub fn check_folder(
        &self,
        flag: &'static str,
        folder: &Path,
        endings: &[&str],
    ) -> Result<(), OutputError> {
        let no_file = |source| OutputError::NoFile {
            flag,
            path: folder.to_owned(),
            source,
        };
        match std::fs::metadata(folder) {
            Ok(found) if !found.is_dir() => Err(OutputError::FolderIsFile {
                flag,
                path: folder.to_owned(),
            }),
            Ok(_) => {
                for entry in std::fs::read_dir(folder).map_err(no_file)? {
                    let path = entry.map_err(no_file)?.path();
                    let is_replaced = |ending: &&str| path.extension() == Some(ending.as_ref());
                    if endings.iter().any(is_replaced)
                        && let Some(identity) = Identity::of(&path)
                    {
                        self.check_identity(flag, &path, &identity)?;
                    }
                }
                check_writable(flag, folder, folder)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let mut above = folder.ancestors().map(|folder| match folder {
                    empty if empty == Path::new("") => Path::new("."),
                    named => named,
                });
                let above = above.find(|folder| folder.exists());
                check_writable(flag, folder, above.unwrap_or(Path::new(".")))
            }
            Err(error) => Err(no_file(error)),
        }
    }

    fn check_identity(
        &self,
        flag: &'static str,
        path: &Path,
        identity: &Identity,
    ) -> Result<(), OutputError> {
        let same = |files: &[(PathBuf, Identity)]| {
            let mut files = files.iter();
            let found = files.find(|(_, other)| other == identity);
            found.map(|(path, _)| path.clone())
        };
        let path = path.to_owned();
        if let Some(input) = same(&self.inputs) {
            return Err(OutputError::IsInput { flag, path, input });
        }
        match same(&self.outputs) {
            Some(other) => Err(OutputError::Twice { flag, path, other }),
            None => Ok(()),
        }
    }
}

fn check_writable(flag: &'static str, path: &Path, folder: &Path) -> Result<(), OutputError> {
    remove_abandoned_parts(folder);
    check_folder_is_writable(folder).map_err(|source| OutputError::NotWritable {
        flag,
        path: path.to_owned(),
        source,
    })
}

/// The file that standard output goes to; `None` if it is a terminal or a pipe, or where nobody can tell.
fn standard_output() -> Option<Identity> {
    #[cfg(unix)]
    {
        use std::os::fd::AsFd;
        let copy = io::stdout().as_fd().try_clone_to_owned().ok()?;
        let found = std::fs::File::from(copy).metadata().ok()?;
        found.is_file().then(|| Identity::of_metadata(&found))
    }
    #[cfg(not(unix))]
    None
}

/// True when both paths lead to the same file or folder, or would.
pub fn is_same_place(a: &Path, b: &Path) -> bool {
    match (Identity::of(a), Identity::of(b)) {
        (Some(a), Some(b)) => a == b,
        _ => false,
    }
}
