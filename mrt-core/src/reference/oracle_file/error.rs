//! Why a reference file is refused.

/// Why a reference cannot be read, or lacks what was asked for.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// A file cannot be opened or read.
    #[error("{file}: cannot be read ({source}); expected a reference file")]
    Io {
        /// Which file.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The description is not JSON of the expected form.
    #[error("{file}: not a reference description: {found}; expected JSON with its keys")]
    Json {
        /// Which file.
        file: String,
        /// What the parser met and where. It quotes the file, so it is shortened.
        found: String,
    },
    /// A value contradicts the format or another value.
    #[error("{file}: {what} is {found}; expected {expected}")]
    Malformed {
        /// Which file.
        file: String,
        /// Which value.
        what: String,
        /// What the format asks for.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// A size is above a limit of the reader.
    #[error("{file}: {what} is {found}; expected at most {limit}")]
    LimitExceeded {
        /// Which file.
        file: String,
        /// Which size.
        what: String,
        /// Largest accepted.
        limit: u64,
        /// What the file holds.
        found: u64,
    },
    /// The file is sound but lacks what was asked for.
    #[error("{file} has no {what}; it has {found}")]
    NotInFile {
        /// Name of the reference.
        file: String,
        /// What was asked for.
        what: String,
        /// What the file holds instead.
        found: String,
    },
}
