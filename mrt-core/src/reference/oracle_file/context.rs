//! Errors that name the file they are about.

use super::error::ReferenceError;
use crate::excerpt::excerpt;
use std::fmt::{Debug, Display};

/// The path of the file that errors are about.
pub(super) struct FileContext(pub(super) String);

impl FileContext {
    /// The error for `what`, a value that breaks a rule.
    pub(super) fn malformed(
        &self,
        what: impl Display,
        expected: impl Display,
        found: impl Display,
    ) -> ReferenceError {
        ReferenceError::Malformed {
            file: self.0.clone(),
            what: what.to_string(),
            expected: expected.to_string(),
            found: excerpt(&found.to_string()),
        }
    }

    /// The error for a file that the system does not read.
    pub(super) fn io(&self, source: std::io::Error) -> ReferenceError {
        ReferenceError::Io {
            file: self.0.clone(),
            source,
        }
    }

    /// The error for text that is not JSON of the expected form.
    pub(super) fn json(&self, error: &serde_json::Error) -> ReferenceError {
        ReferenceError::Json {
            file: self.0.clone(),
            found: excerpt(&error.to_string()),
        }
    }

    /// Refuses a size above `limit`.
    pub(super) fn check_limit(
        &self,
        what: &str,
        found: u64,
        limit: u64,
    ) -> Result<(), ReferenceError> {
        if found <= limit {
            return Ok(());
        }
        Err(ReferenceError::LimitExceeded {
            file: self.0.clone(),
            what: what.into(),
            limit,
            found,
        })
    }

    /// Refuses an albedo outside [0, 1].
    pub(super) fn check_albedo(&self, what: String, albedo: f64) -> Result<(), ReferenceError> {
        if (0.0..=1.0).contains(&albedo) {
            return Ok(());
        }
        Err(self.malformed(what, "a number from 0 to 1", albedo))
    }
}

/// Displays as `Debug` does: lists with brackets, text with quotes.
pub(super) struct Shown<T>(pub(super) T);

impl<T: Debug> Display for Shown<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}
