//! What can go wrong.

use std::io;
use std::path::PathBuf;

/// Why a container was not written or read, by who can do something about it.
#[derive(Debug, thiserror::Error)]
pub enum ContainerError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is of another kind.
    #[error(
        "not a file of this kind: starts with \"{}\", expected \"{}\"",
        found.escape_ascii(),
        expected.escape_ascii()
    )]
    NotThisFormat {
        /// Magic and kind.
        expected: [u8; 12],
        /// The first 12 bytes of the file, or all of a shorter file.
        found: Vec<u8>,
    },
    /// A newer version of this program wrote the file, or one too old to read.
    #[error("{what} version {found} is not supported; supported are {oldest} to {newest}")]
    UnsupportedVersion {
        /// "layout" or "content".
        what: &'static str,
        /// Version of the file.
        found: u32,
        /// Oldest version that can be read.
        oldest: u32,
        /// Newest version that can be read.
        newest: u32,
    },
    /// The bytes break a rule of the format: whoever wrote the file is at fault.
    #[error("malformed {what} at byte {at}: expected {expected}, found {found}")]
    Malformed {
        /// The field at fault.
        what: &'static str,
        /// Its position in the file, in bytes.
        at: u64,
        /// The rule.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// The caller's budget or a limit of the format is exceeded.
    #[error("{what} needs {found}, more than the {limit} allowed")]
    LimitExceeded {
        /// What was asked for.
        what: &'static str,
        /// How much is left or allowed.
        limit: u64,
        /// How much it takes.
        found: u64,
    },
    /// The file was damaged after it was written.
    #[error("{section} is damaged: checksum {found:08x}, expected {expected:08x}")]
    Corrupt {
        /// A section's name, or "header".
        section: String,
        /// The checksum that the file states.
        expected: u32,
        /// The checksum of its bytes.
        found: u32,
    },
    /// The file has no section of this name.
    #[error("no section \"{name}\"")]
    MissingSection {
        /// The name asked for.
        name: String,
    },
    /// A section given to the writer breaks a rule: a bug in the caller.
    #[error("section \"{name}\": {reason}")]
    InvalidSection {
        /// The section's name.
        name: String,
        /// Which rule.
        reason: &'static str,
    },
}

/// [`ContainerError::Malformed`], for the field `what` at byte `at` of the file.
pub(crate) fn malformed(
    what: &'static str,
    at: usize,
    expected: impl ToString,
    found: impl ToString,
) -> ContainerError {
    ContainerError::Malformed {
        what,
        at: at as u64,
        expected: expected.to_string(),
        found: found.to_string(),
    }
}
