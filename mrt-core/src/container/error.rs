//! What can go wrong, and how much a reader may allocate.

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
    /// Another kind of file.
    #[error(
        "not a file of this kind: starts with \"{}\", expected \"{}\"",
        found.escape_ascii(),
        expected.escape_ascii()
    )]
    NotThisFormat {
        /// Magic and kind.
        expected: [u8; 12],
        /// The first bytes, fewer if there are no more.
        found: Vec<u8>,
    },
    /// Written by a newer version of this program, or one too old to read.
    #[error("{what} version {found} is not supported; supported are {oldest} to {newest}")]
    UnsupportedVersion {
        /// "layout" or "content".
        what: &'static str,
        /// That of the file.
        found: u32,
        /// Oldest that can be read.
        oldest: u32,
        /// Newest that can be read.
        newest: u32,
    },
    /// The bytes break a rule of the format: whoever wrote the file is at fault.
    #[error("malformed {what} at byte {at}: expected {expected}, found {found}")]
    Malformed {
        /// The field at fault.
        what: &'static str,
        /// Where in the file.
        at: u64,
        /// The rule.
        expected: String,
        /// What is there.
        found: String,
    },
    /// More than the caller allows, or than the format does.
    #[error("{what} needs {found}, more than the {limit} allowed")]
    LimitExceeded {
        /// What was asked for.
        what: &'static str,
        /// How much is left or allowed.
        limit: u64,
        /// How much it takes.
        found: u64,
    },
    /// Damaged after it was written.
    #[error("{section} is damaged: checksum {found:08x}, expected {expected:08x}")]
    Corrupt {
        /// A section's name, or "header".
        section: String,
        /// The checksum in the file.
        expected: u32,
        /// That of the bytes.
        found: u32,
    },
    /// The file has no such section.
    #[error("no section \"{name}\"")]
    MissingSection {
        /// Its name.
        name: String,
    },
    /// A section given to the writer breaks a rule: a bug in the caller.
    #[error("section \"{name}\": {reason}")]
    InvalidSection {
        /// Its name.
        name: String,
        /// Which rule.
        reason: &'static str,
    },
}

/// Bytes that a reader may still allocate.
#[derive(Clone, Debug)]
pub struct ByteBudget {
    remaining: u64,
}

impl ByteBudget {
    /// A budget of that many bytes.
    pub fn new(bytes: u64) -> Self {
        Self { remaining: bytes }
    }

    /// What is left.
    pub fn remaining(&self) -> u64 {
        self.remaining
    }

    /// Takes `bytes` for `what`; call it before allocating.
    ///
    /// # Errors
    /// [`ContainerError::LimitExceeded`] if fewer are left; nothing is taken then.
    pub fn spend(&mut self, what: &'static str, bytes: u64) -> Result<(), ContainerError> {
        match self.remaining.checked_sub(bytes) {
            Some(remaining) => {
                self.remaining = remaining;
                Ok(())
            }
            None => Err(ContainerError::LimitExceeded {
                what,
                limit: self.remaining,
                found: bytes,
            }),
        }
    }
}
