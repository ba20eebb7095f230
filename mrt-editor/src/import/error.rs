//! Why a scene cannot be read.

use super::limits::{MAX_COORDINATE_M, MAX_FILE_BYTES};
use std::path::PathBuf;

/// Why a scene cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file cannot be opened or read.
    #[error("scene {}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is larger than [`MAX_FILE_BYTES`].
    #[error("scene {}: {found} bytes; expected at most {MAX_FILE_BYTES}", path.display())]
    TooLarge {
        /// Which file.
        path: PathBuf,
        /// Bytes that were read before it was refused.
        found: u64,
    },
    /// The file's name ends in neither `.obj` nor `.glb`.
    #[error("scene {}: found a file ending in `{found}`; expected .obj or .glb", path.display())]
    UnknownFormat {
        /// Which file.
        path: PathBuf,
        /// How its name ends.
        found: String,
    },
    /// The file is not what its name says.
    #[error("scene {}, {place}: expected {expected}", path.display())]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What should be there.
        expected: &'static str,
    },
    /// A line of a text file is faulty.
    #[error("scene {}, line {line}: found `{found}`; expected {expected}", path.display())]
    Line {
        /// Which file.
        path: PathBuf,
        /// Number of the line, from 1; of a wrapped line, its first.
        line: usize,
        /// The word at fault, readable.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// No triangle can be lit.
    #[error(
        "scene {}: found {found} triangles, none with an area and finite corners; expected at least \
         one", path.display()
    )]
    Empty {
        /// Which file.
        path: PathBuf,
        /// Triangles in the file.
        found: usize,
    },
    /// Scaled coordinates exceed [`MAX_COORDINATE_M`].
    #[error(
        "scene {}: scaled coordinates up to {found} m; expected at most {MAX_COORDINATE_M} m",
        path.display()
    )]
    OutOfRange {
        /// Which file.
        path: PathBuf,
        /// Largest coordinate, metres.
        found: f32,
    },
    /// The scale is not a positive number.
    #[error("scale {found}; expected a positive number of metres per unit")]
    Scale {
        /// The scale given.
        found: f64,
    },
    /// The albedo is not in [0, 1].
    #[error("albedo {found}; expected a number from 0 to 1")]
    Albedo {
        /// The albedo given.
        found: f32,
    },
}
