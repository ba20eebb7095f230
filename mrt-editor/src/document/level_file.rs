//! A level as a file.

use mrt_core::container::{ContainerError, StagedFile};
use mrt_runtime::low_level::level::text::MAX_TEXT_BYTES;
use mrt_runtime::{Level, LevelTextError};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Why a level's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LevelFileError {
    /// The file cannot be read.
    #[error("level {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file holds no sound level, or the level has no form as text.
    #[error("level {}: {source}", path.display())]
    Level {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: LevelTextError,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] ContainerError),
}

/// Reads and checks a level.
///
/// # Errors
/// [`LevelFileError::Read`] and [`LevelFileError::Level`].
pub fn read_level(path: &Path) -> Result<Level, LevelFileError> {
    let io = |source| LevelFileError::Read {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .map_err(io)?
        // One byte more than a level may have tells a text that is too long from one that just fits.
        .take(MAX_TEXT_BYTES as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    let text = String::from_utf8_lossy(&bytes);
    Level::from_text(&text).map_err(|source| LevelFileError::Level {
        path: path.to_owned(),
        source,
    })
}

/// Writes a level, whole or not at all.
///
/// # Errors
/// [`LevelFileError::Level`] and [`LevelFileError::Write`].
pub fn write_level(path: &Path, level: &Level) -> Result<(), LevelFileError> {
    Ok(stage_level(path, level)?.commit()?)
}

/// Writes a level beside its file, to be put in its place later.
///
/// # Errors
/// [`LevelFileError::Level`] and [`LevelFileError::Write`].
pub fn stage_level(path: &Path, level: &Level) -> Result<StagedFile, LevelFileError> {
    let text = level.to_text().map_err(|source| LevelFileError::Level {
        path: path.to_owned(),
        source,
    })?;
    Ok(StagedFile::write(path, text.as_bytes())?)
}
