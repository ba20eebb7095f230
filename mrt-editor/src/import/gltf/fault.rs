//! What is wrong with a file, before its path is known.

use crate::import::error::ImportError;
use std::path::Path;

/// Names in messages are cut after this many characters.
const SHOWN_CHARACTERS: usize = 80;

/// What is wrong with a file.
#[derive(Debug)]
pub(super) enum Fault {
    /// A place in the file, and what should be there.
    Malformed {
        place: String,
        expected: &'static str,
    },
    /// A sentence about what the file needs and this reader cannot do.
    Unsupported(String),
    /// A file that the scene needs, and what is wrong with it.
    Neighbour { name: String, reason: String },
}

impl Fault {
    pub(super) fn at(place: impl Into<String>, expected: &'static str) -> Self {
        let place = place.into();
        Self::Malformed { place, expected }
    }

    /// An index that points nowhere.
    pub(super) fn index(place: &str, list: &str, index: usize, count: usize) -> Self {
        let place = format!("{place}: {list} {index} of {count}");
        Self::at(place, "an index below the number of entries")
    }

    pub(super) fn into_error(self, path: &Path) -> ImportError {
        let path = path.to_owned();
        match self {
            Self::Malformed { place, expected } => ImportError::Malformed {
                path,
                place,
                expected,
            },
            Self::Unsupported(found) => ImportError::Unsupported { path, found },
            Self::Neighbour { name, reason } => ImportError::Neighbour { path, name, reason },
        }
    }
}

/// A name of the file as a message can show it: short, and without characters that steer a terminal.
pub(super) fn shown(name: &str) -> String {
    let mut characters = name.chars();
    let kept = characters.by_ref().take(SHOWN_CHARACTERS);
    let plain = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let mut text: String = kept.map(plain).collect();
    if characters.next().is_some() {
        text.push_str("...");
    }
    text
}
