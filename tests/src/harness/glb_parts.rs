//! A GLB file, taken apart however damaged it is, and put together with lengths that fit.

use super::target::ChangeBytes;
use crate::random::Random;

/// The two chunks of a GLB file.
#[derive(Clone, Debug)]
pub struct GlbParts {
    /// The document.
    pub json: Vec<u8>,
    /// The numbers.
    pub binary: Vec<u8>,
}

impl GlbParts {
    /// The chunks, as far as the bytes reach; `None` if the bytes do not start as a GLB does.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let content = bytes.strip_prefix(b"glTF")?.get(8..)?;
        let (json, rest) = chunk(content);
        Some(Self {
            json: json.to_vec(),
            binary: chunk(rest).0.to_vec(),
        })
    }

    /// The file of these chunks.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, content, padding) in [(b"JSON", &self.json, b' '), (b"BIN\0", &self.binary, 0)] {
            let padded = content.len().next_multiple_of(4);
            bytes.extend((padded as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(content);
            bytes.resize(bytes.len() + padded - content.len(), padding);
        }
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        bytes
    }

    /// Changes the document, or less often the numbers.
    pub fn change(&mut self, random: &mut Random, change: &mut ChangeBytes<'_>, most: usize) {
        match random.below(8) {
            0 => change(&mut self.binary, most),
            _ => change(&mut self.json, most),
        }
    }
}

/// The content of the chunk at the start, and what follows it.
fn chunk(bytes: &[u8]) -> (&[u8], &[u8]) {
    let Some((header, rest)) = bytes.split_at_checked(8) else {
        return (&[], &[]);
    };
    let length = u32::from_le_bytes([header[0], header[1], header[2], header[3]]);
    rest.split_at((length as usize).min(rest.len()))
}
