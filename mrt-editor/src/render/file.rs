//! Pictures as files, which are there whole or not at all.

use super::Picture;
use image::{ExtendedColorType, ImageEncoder};
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
        source: image::ImageError,
    },
}

/// Writes 8-bit sRGB pixels as PNG.
///
/// # Errors
/// [`WriteError`].
pub fn write_png(path: &Path, size: [usize; 2], srgb: &[u8]) -> Result<(), WriteError> {
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(
            srgb,
            size[0] as u32,
            size[1] as u32,
            ExtendedColorType::Rgb8,
        )
        .map_err(|source| WriteError::Encode {
            path: path.to_owned(),
            source,
        })?;
    Ok(write_file_atomically(path, &bytes)?)
}

/// Writes linear pixels as Radiance HDR.
///
/// # Errors
/// [`WriteError`].
pub fn write_hdr(path: &Path, picture: &Picture) -> Result<(), WriteError> {
    let mut bytes = Vec::new();
    let pixels: Vec<image::Rgb<f32>> = picture
        .pixels
        .iter()
        .map(|colour| image::Rgb(colour.to_array()))
        .collect();
    image::codecs::hdr::HdrEncoder::new(&mut bytes)
        .encode(&pixels, picture.width, picture.height)
        .map_err(|source| WriteError::Encode {
            path: path.to_owned(),
            source,
        })?;
    Ok(write_file_atomically(path, &bytes)?)
}
