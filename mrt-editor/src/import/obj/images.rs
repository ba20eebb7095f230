//! The images that materials of an OBJ name.

use super::image_use::ImageUse;
use super::lines::{before_comment, readable};
use super::notes::Notes;
use crate::import::file::{Refusal, SceneFolder, base_name, read_found, spellings};
use crate::import::limits::{MAX_IMAGE_BYTES, MAX_IMAGES};
use crate::import::raw_mesh::{PaintImage, RawImage, Wrap};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Reads each image once.
pub(super) struct Images<'a> {
    folder: &'a SceneFolder,
    images: Vec<RawImage>,
    by_path: HashMap<PathBuf, usize>,
    /// By folder and name in the file; `None` for those that cannot be read.
    by_name: HashMap<(PathBuf, Vec<u8>), Option<usize>>,
    /// Bytes that may still be read.
    left: u64,
    notes: Notes,
}

impl<'a> Images<'a> {
    pub(super) fn in_folder(folder: &'a SceneFolder) -> Self {
        Self {
            folder,
            images: Vec::new(),
            by_path: HashMap::new(),
            by_name: HashMap::new(),
            left: MAX_IMAGE_BYTES,
            notes: Notes::about("images"),
        }
    }

    /// The image that a library in `folder`, relative to the scene's, names; `None` if it cannot be read.
    pub(super) fn load(&mut self, image_use: &ImageUse, folder: &Path) -> Option<PaintImage> {
        let key = (folder.to_owned(), image_use.name.clone());
        let known = self.by_name.get(&key).copied();
        let image = known.unwrap_or_else(|| {
            let name = readable(before_comment(&image_use.name));
            let image = self.read(&image_use.name, folder);
            let image = image.map_err(|refusal| self.notes.add(format!("image {name} {refusal}")));
            self.by_name.insert(key, image.ok());
            image.ok()
        })?;
        let wrap = match image_use.is_clamped {
            true => Wrap::Clamp,
            false => Wrap::Repeat,
        };
        Some(PaintImage {
            image,
            wrap: [wrap; 2],
        })
    }

    fn read(&mut self, name: &[u8], folder: &Path) -> Result<usize, Refusal> {
        let names = [name, before_comment(name)];
        let mut paths = Vec::new();
        for name in names {
            let spellings = spellings(name);
            paths.extend(spellings.iter().map(|name| folder.join(name)));
            paths.extend(spellings);
        }
        for name in names {
            paths.push(folder.join(base_name(name)));
            paths.push(base_name(name));
        }
        let path = self.folder.find(&paths)?;
        if let Some(&image) = self.by_path.get(&path) {
            return Ok(image);
        }
        if self.images.len() == MAX_IMAGES {
            return Err(Refusal::TooMany { limit: MAX_IMAGES });
        }
        let bytes = read_found(&path, &mut self.left)?;
        let image = self.images.len();
        self.images.push(RawImage {
            name: readable(before_comment(name)),
            bytes,
        });
        self.by_path.insert(path, image);
        Ok(image)
    }

    /// The images, and sentences about those that cannot be read.
    pub(super) fn finish(self) -> (Vec<RawImage>, Vec<String>) {
        (self.images, self.notes.finish())
    }
}
