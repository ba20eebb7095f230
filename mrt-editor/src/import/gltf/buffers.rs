//! Bytes that a document names: the binary chunk, data URIs and files in the scene's folder.

use super::container::Content;
use super::document::Document;
use super::extensions::{self, KHR_MESHOPT, MESHOPT};
use super::fault::{Fault, shown};
use crate::import::limits::MAX_NEIGHBOUR_BYTES;
use crate::import::neighbour::read_neighbour;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::path::Path;

/// Padding at the end may be missing.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Reads each buffer when it is first asked for, so that one that only animations use may be missing.
pub(super) struct Buffers<'a> {
    pub(super) document: &'a Document,
    folder: &'a Path,
    bin: Option<&'a [u8]>,
    loaded: Vec<Option<Cow<'a, [u8]>>>,
    /// What files, data URIs and images may still hold, all together.
    bytes_left: u64,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(content: &'a Content<'a>, folder: &'a Path) -> Self {
        Self {
            document: &content.document,
            folder,
            bin: content.bin,
            loaded: vec![None; content.document.buffers.len()],
            bytes_left: MAX_NEIGHBOUR_BYTES,
        }
    }

    /// The bytes of a buffer view; `place` is what names it.
    pub(super) fn view(&mut self, index: usize, place: &str) -> Result<&[u8], Fault> {
        let views = &self.document.buffer_views;
        let view = views
            .get(index)
            .ok_or_else(|| Fault::index(place, "buffer view", index, views.len()))?;
        let buffers = &self.document.buffers;
        let here = format!("bufferViews[{index}]");
        if view.buffer >= buffers.len() {
            return Err(Fault::index(&here, "buffer", view.buffer, buffers.len()));
        }
        self.refuse_compressed(index)?;
        let bytes = self.buffer(view.buffer)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        end.and_then(|end| bytes.get(view.byte_offset..end))
            .ok_or_else(|| Fault::at(here, "its data inside its buffer"))
    }

    /// A copy of a buffer view; many images may name the same one, so that each counts.
    pub(super) fn copied_view(&mut self, index: usize, place: &str) -> Result<Vec<u8>, Fault> {
        let bytes = self.view(index, place)?.len();
        self.charge(bytes, place)?;
        Ok(self.view(index, place)?.to_vec())
    }

    /// Beside compressed data there may be plain ones, unless the extension is required.
    fn refuse_compressed(&self, index: usize) -> Result<(), Fault> {
        let view = &self.document.buffer_views[index];
        let extensions = &view.extensions;
        let name = match (&extensions.ext_meshopt, &extensions.khr_meshopt) {
            (Some(_), _) => MESHOPT,
            (None, Some(_)) => KHR_MESHOPT,
            (None, None) => return Ok(()),
        };
        let is_required = self.document.extensions_required.iter().any(|r| r == name);
        let is_chunk = view.buffer == 0 && self.bin.is_some();
        if is_required || (self.document.buffers[view.buffer].uri.is_none() && !is_chunk) {
            return Err(extensions::compressed(name));
        }
        Ok(())
    }

    /// The bytes of a buffer of the document.
    fn buffer(&mut self, index: usize) -> Result<&[u8], Fault> {
        if self.loaded[index].is_none() {
            let place = format!("buffers[{index}]");
            let bytes = match (&self.document.buffers[index].uri, self.bin) {
                (Some(uri), _) => Cow::Owned(self.resource(uri, &place)?),
                (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
                (None, _) => return Err(Fault::at(place, "a URI, or the binary chunk of a .glb")),
            };
            self.loaded[index] = Some(bytes);
        }
        Ok(self.loaded[index].as_deref().unwrap_or_default())
    }

    /// The bytes of a data URI or of a file in the scene's folder.
    pub(super) fn resource(&mut self, uri: &str, place: &str) -> Result<Vec<u8>, Fault> {
        let bytes = match uri.get(..5) {
            Some(scheme) if scheme.eq_ignore_ascii_case("data:") => {
                decode(&uri[5..]).ok_or_else(|| Fault::at(place, "a data URI in base64"))?
            }
            _ => self.file(uri)?,
        };
        self.charge(bytes.len(), place)?;
        Ok(bytes)
    }

    fn charge(&mut self, bytes: usize, place: &str) -> Result<(), Fault> {
        let left = self.bytes_left.checked_sub(bytes as u64);
        let fault = || Fault::at(place, "at most 1 GiB in all files and images of the scene");
        self.bytes_left = left.ok_or_else(fault)?;
        Ok(())
    }

    fn file(&self, uri: &str) -> Result<Vec<u8>, Fault> {
        let fault = |name: &str, reason: String| Fault::Neighbour {
            name: shown(name),
            reason,
        };
        if has_scheme(uri) {
            let reason = "only files inside the scene's folder are read, none from elsewhere";
            return Err(fault(uri, reason.to_owned()));
        }
        let name = percent_decode_str(uri).decode_utf8_lossy();
        let read = |name: &str| read_neighbour(self.folder, name, self.bytes_left);
        // Some exporters leave percent signs as they are, or write the separators of Windows.
        read(&name)
            .or_else(|reason| read(uri).map_err(|_| reason))
            .or_else(|reason| read(&name.replace('\\', "/")).map_err(|_| reason))
            .map_err(|reason| fault(&name, reason))
    }
}

/// `http:` and the like; a single letter is a drive of Windows.
fn has_scheme(uri: &str) -> bool {
    let is_scheme = |scheme: &str| {
        let legal = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
        scheme.len() > 1
            && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(legal)
    };
    uri.split_once(':')
        .is_some_and(|(scheme, _)| is_scheme(scheme))
}

/// What stands behind `data:`.
fn decode(data: &str) -> Option<Vec<u8>> {
    let (kind, data) = data.split_once(',')?;
    let bytes: Cow<'_, [u8]> = percent_decode_str(data).into();
    if kind.to_ascii_lowercase().ends_with(";base64") {
        return BASE64.decode(bytes).ok();
    }
    Some(bytes.into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_are_decoded() {
        assert_eq!(decode("image/png;base64,AQID"), Some(vec![1, 2, 3]));
        assert_eq!(decode(";BASE64,AQ=="), Some(vec![1]));
        assert_eq!(decode(";base64,AQ"), Some(vec![1]));
        assert_eq!(decode(";base64,AQ%3D%3D"), Some(vec![1]));
        assert_eq!(decode("text/plain,a%20b"), Some(b"a b".to_vec()));
        assert_eq!(decode(";base64,A*"), None);
        assert_eq!(decode(";base64"), None);
    }

    #[test]
    fn schemes_are_told_from_names() {
        for uri in [
            "http://a/b.bin",
            "HTTPS:b",
            "file:///etc/hosts",
            "a+b.c-1:x",
        ] {
            assert!(has_scheme(uri), "{uri}");
        }
        for name in ["b.bin", "C:\\b.bin", "sub/a:b.bin", ":b", "1a:b"] {
            assert!(!has_scheme(name), "{name}");
        }
    }
}
