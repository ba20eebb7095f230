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
    /// The file's name ends in none of `.obj`, `.glb` and `.gltf`.
    #[error("scene {}: found a file ending in `{found}`; expected .obj, .glb or .gltf", path.display())]
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
    /// The file needs what this reader cannot do.
    #[error("scene {}: {found}", path.display())]
    Unsupported {
        /// Which file.
        path: PathBuf,
        /// A sentence about what it needs and what to do.
        found: String,
    },
    /// A file that the scene names and needs cannot be read.
    #[error("scene {}, its file `{name}`: {reason}", path.display())]
    Neighbour {
        /// Which scene.
        path: PathBuf,
        /// The file's name in the scene.
        name: String,
        /// What is wrong with it.
        reason: String,
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
        "scene {}: found coordinates up to {found:e} m in a mesh of {size:e} m; expected at most {MAX_COORDINATE_M:e} m",
        path.display()
    )]
    OutOfRange {
        /// Which file.
        path: PathBuf,
        /// Largest coordinate, metres.
        found: f64,
        /// Longest side of the mesh, metres.
        size: f64,
    },
    /// No material has a name that was asked for.
    #[error("scene {}: no material is named `{found}`; expected one of {expected}", path.display())]
    NoSuchMaterial {
        /// Which file.
        path: PathBuf,
        /// The name or pattern.
        found: String,
        /// Names of the mesh's materials.
        expected: String,
    },
    /// Every triangle has a material that is left out.
    #[error(
        "scene {}: all {found} triangles have materials that are left out: {names}; expected at least one that is read",
        path.display()
    )]
    AllLeftOut {
        /// Which file.
        path: PathBuf,
        /// Triangles in the file.
        found: usize,
        /// Names of the materials.
        names: String,
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
