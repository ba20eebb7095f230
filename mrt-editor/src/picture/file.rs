//! Writes files that are there whole or not at all.

use super::Picture;
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The system refuses.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The picture cannot be encoded.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// Which file.
        path: PathBuf,
        /// What the encoder says.
        source: image::ImageError,
    },
}

/// Writes beside the file and renames, so that a reader sees the old content or the new.
///
/// # Errors
/// [`WriteError::Io`]; then nothing is left behind.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let write = || {
        let mut file = std::fs::File::create(&part)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        drop(file);
        std::fs::rename(&part, path)
    };
    write().map_err(|source| {
        // The write's own error is the one to report.
        let _ = std::fs::remove_file(&part);
        WriteError::Io {
            path: path.to_owned(),
            source,
        }
    })
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
    write_whole(path, &bytes)
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
    write_whole(path, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        // A folder in the way: the rename fails.
        let target = folder.path().join("taken");
        std::fs::create_dir_all(target.join("inner")).expect("creates");
        assert!(write_whole(&target, b"text").is_err());
        let left = std::fs::read_dir(folder.path()).expect("reads").count();
        assert_eq!(left, 1);
        write_whole(&folder.path().join("free"), b"text").expect("writes");
    }
}
