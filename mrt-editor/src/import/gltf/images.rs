//! Images of base colours: each is read once, and one that cannot be used becomes a warning.

use super::buffers::Buffers;
use super::document::TextureInfo;
use super::fault::{Fault, shown};
use crate::import::raw_mesh::RawImage;
use std::collections::{BTreeMap, HashMap};

/// A warning names at most this many materials.
const MAX_NAMED_MATERIALS: usize = 8;

/// More warnings than this are only counted.
const MAX_WARNINGS: usize = 32;

/// The images read so far.
#[derive(Default)]
pub(super) struct Images {
    /// By index in the document: index of the image that was read, or what keeps it from being used.
    read: HashMap<usize, Result<usize, String>>,
    /// What keeps images from being used, and the materials that have them.
    faults: BTreeMap<String, Vec<String>>,
}

impl Images {
    /// Reads the image of a material's texture if it is new, and returns its index in `raw`.
    pub(super) fn add(
        &mut self,
        buffers: &mut Buffers<'_>,
        texture: &TextureInfo,
        material: &str,
        raw: &mut Vec<RawImage>,
    ) -> Option<usize> {
        let found = source(buffers, texture).and_then(|index| {
            let read = || {
                raw.push(read_image(buffers, index)?);
                Ok(raw.len() - 1)
            };
            self.read.entry(index).or_insert_with(read).clone()
        });
        found
            .map_err(|fault| {
                self.faults
                    .entry(fault)
                    .or_default()
                    .push(material.to_owned())
            })
            .ok()
    }

    /// Sentences about images that are not used.
    pub(super) fn into_warnings(self) -> Vec<String> {
        let fault_count = self.faults.len();
        let sentence = |(fault, materials): (String, Vec<String>)| {
            let named = materials.iter().take(MAX_NAMED_MATERIALS);
            let mut names: Vec<String> = named.map(|name| format!("`{}`", shown(name))).collect();
            if materials.len() > MAX_NAMED_MATERIALS {
                names.push(format!("{} more", materials.len() - MAX_NAMED_MATERIALS));
            }
            format!(
                "base colour image not used by {}: {fault}",
                names.join(", ")
            )
        };
        let shown = self.faults.into_iter().take(MAX_WARNINGS).map(sentence);
        let mut warnings: Vec<String> = shown.collect();
        if fault_count > MAX_WARNINGS {
            let more = fault_count - MAX_WARNINGS;
            warnings.push(format!("{more} more base colour images are not used"));
        }
        warnings
    }
}

/// Index of a texture's image, preferably the one for readers without extensions.
fn source(buffers: &Buffers<'_>, texture: &TextureInfo) -> Result<usize, String> {
    let (textures, images) = (&buffers.document.textures, &buffers.document.images);
    let texture = textures
        .get(texture.index)
        .ok_or_else(|| format!("texture {} of {}", texture.index, textures.len()))?;
    let webp = texture
        .extensions
        .webp
        .as_ref()
        .and_then(|webp| webp.source);
    match texture.source.or(webp) {
        Some(source) if source < images.len() => Ok(source),
        Some(source) => Err(format!("image {source} of {}", images.len())),
        None => Err("it is neither PNG, JPEG nor WebP".to_owned()),
    }
}

fn read_image(buffers: &mut Buffers<'_>, index: usize) -> Result<RawImage, String> {
    let image = &buffers.document.images[index];
    let place = format!("images[{index}]");
    let is_data = |uri: &&String| {
        uri.get(..5)
            .is_some_and(|s| s.eq_ignore_ascii_case("data:"))
    };
    let file = image.uri.as_ref().filter(|uri| !is_data(uri));
    let name = file
        .or(image.name.as_ref())
        .map_or(place.clone(), |name| shown(name));
    let bytes = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => buffers.resource(uri, &place),
        (None, Some(view)) => buffers.copied_view(view, &place),
        (None, None) => return Err(format!("`{name}` has no data")),
    };
    let bytes = bytes.map_err(|fault| match fault {
        Fault::Malformed { place, expected } => format!("{place}: expected {expected}"),
        Fault::Unsupported(reason) => reason,
        Fault::Neighbour { name, reason } => format!("`{name}`: {reason}"),
    })?;
    if !is_readable(&bytes) {
        return Err(format!("`{name}` is neither PNG, JPEG nor WebP"));
    }
    Ok(RawImage { name, bytes })
}

/// By the first bytes: stated types and endings are often wrong.
fn is_readable(bytes: &[u8]) -> bool {
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    webp || bytes.starts_with(b"\x89PNG\r\n\x1a\n") || bytes.starts_with(b"\xff\xd8\xff")
}
