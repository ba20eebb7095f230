//! Pictures as files, which are there whole or not at all.

use super::{Picture, hdr};
use mrt_core::container::{ContainerError, write_file_atomically};
use std::path::{Path, PathBuf};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// A folder cannot be made or filled.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] ContainerError),
    /// The picture cannot be encoded.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// Which file.
        path: PathBuf,
        /// What the encoder says.
        source: png::EncodingError,
    },
}

/// What the encoder of a PNG file saves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Saves {
    /// Time: for pictures that are looked at and thrown away.
    Time,
    /// Bytes: for pictures that are kept.
    Bytes,
}

/// Writes 8-bit sRGB pixels, row by row from the top, as PNG; returns the file's bytes.
///
/// # Errors
/// [`WriteError`].
pub fn write_png(
    path: &Path,
    [width, height]: [usize; 2],
    srgb: &[u8],
    saves: Saves,
) -> Result<usize, WriteError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(match saves {
        Saves::Time => png::Compression::Fast,
        Saves::Bytes => png::Compression::High,
    });
    encoder.set_filter(png::Filter::Adaptive);
    encoder
        .write_header()
        .and_then(|mut writer| {
            writer.write_image_data(srgb)?;
            writer.finish()
        })
        .map_err(|source| WriteError::Encode {
            path: path.to_owned(),
            source,
        })?;
    write_file_atomically(path, &bytes)?;
    Ok(bytes.len())
}

/// Writes linear pixels as Radiance HDR.
///
/// # Errors
/// [`WriteError::File`].
pub fn write_hdr(path: &Path, picture: &Picture) -> Result<(), WriteError> {
    Ok(write_file_atomically(path, &hdr::encode(picture))?)
}
