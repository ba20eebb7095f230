//! Pictures as files, which are there whole or not at all.

use super::ktx2::ktx2_bytes;
use super::picture::Picture;
use image::codecs::hdr::HdrEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use mrt_core::container::{ContainerError, StagedFile};
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
        source: image::ImageError,
    },
}

/// Makes a folder, and those that it is in.
///
/// # Errors
/// [`WriteError::Io`].
pub fn make_folder(path: &Path) -> Result<(), WriteError> {
    std::fs::create_dir_all(path).map_err(|source| WriteError::Io {
        path: path.to_owned(),
        source,
    })
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
    size: [usize; 2],
    srgb: &[u8],
    saves: Saves,
) -> Result<usize, WriteError> {
    let bytes = png(path, size, srgb, saves)?;
    StagedFile::write(path, &bytes)?.commit()?;
    Ok(bytes.len())
}

/// Same as [`write_png`], beside the file, to be put in its place later.
///
/// # Errors
/// [`WriteError`].
pub fn stage_png(
    path: &Path,
    size: [usize; 2],
    srgb: &[u8],
    saves: Saves,
) -> Result<StagedFile, WriteError> {
    Ok(StagedFile::write(path, &png(path, size, srgb, saves)?)?)
}

/// The bytes of a PNG file; an error names its path.
fn png(
    path: &Path,
    [width, height]: [usize; 2],
    srgb: &[u8],
    saves: Saves,
) -> Result<Vec<u8>, WriteError> {
    let compression = match saves {
        Saves::Time => CompressionType::Fast,
        Saves::Bytes => CompressionType::Best,
    };
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, compression, FilterType::Adaptive)
        .write_image(srgb, width as u32, height as u32, ExtendedColorType::Rgb8)
        .map_err(|source| WriteError::Encode {
            path: path.to_owned(),
            source,
        })?;
    Ok(bytes)
}

/// Writes linear pixels as KTX2, in half precision, beside the file, to be put in its place later.
///
/// # Errors
/// [`WriteError`].
pub fn stage_ktx2(path: &Path, picture: &Picture) -> Result<StagedFile, WriteError> {
    Ok(StagedFile::write(path, &ktx2_bytes(picture))?)
}

/// Writes linear pixels as Radiance HDR, beside the file, to be put in its place later: each channel keeps 8 bits
/// relative to the pixel's brightest one.
///
/// # Errors
/// [`WriteError`].
pub fn stage_hdr(path: &Path, picture: &Picture) -> Result<StagedFile, WriteError> {
    let mut bytes = Vec::new();
    let pixels = picture.pixels.iter();
    let pixels: Vec<_> = pixels.map(|colour| image::Rgb(colour.to_array())).collect();
    HdrEncoder::new(&mut bytes)
        .encode(&pixels, picture.width, picture.height)
        .map_err(|source| WriteError::Encode {
            path: path.to_owned(),
            source,
        })?;
    Ok(StagedFile::write(path, &bytes)?)
}
