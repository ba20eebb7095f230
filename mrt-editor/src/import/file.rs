//! Reading a scene's files within limits.

use super::error::ImportError;
use super::limits::{MAX_FILE_BYTES, MAX_LIBRARY_BYTES};
use std::io::Read;
use std::path::Path;

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

/// Text of a material library in the scene's folder; `None` if it is missing or cannot be read.
pub(super) fn read_library(folder: &Path, name: &str) -> Option<String> {
    let file = std::fs::File::open(folder.join(name)).ok()?;
    let mut bytes = Vec::new();
    file.take(MAX_LIBRARY_BYTES).read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}
