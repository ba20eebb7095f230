//! The container of binary glTF (glTF 2.0 specification, section 4.4): a header and chunks of JSON and of numbers.

/// Bytes of the header, and of what stands before each chunk.
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;

/// The chunks that a GLB may have.
pub(super) struct Chunks<'a> {
    /// The document.
    pub(super) json: &'a [u8],
    /// Numbers; empty if there is no such chunk.
    pub(super) bin: &'a [u8],
}

/// Finds the chunks; `None` if this is no complete GLB of version 2.
pub(super) fn chunks(bytes: &[u8]) -> Option<Chunks<'_>> {
    let is_glb = bytes.get(0..4)? == b"glTF" && word(bytes, 4)? == 2;
    let length = word(bytes, 8)? as usize;
    if !is_glb || length < HEADER_BYTES {
        return None;
    }
    let bytes = bytes.get(..length)?;
    let (json, rest) = chunk(&bytes[HEADER_BYTES..], b"JSON")?;
    let bin = chunk(rest, b"BIN\0").map_or(&[][..], |(bin, _)| bin);
    Some(Chunks { json, bin })
}

/// The content of the first chunk, if it is of this kind, and what follows it.
fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let length = word(bytes, 0)? as usize;
    if bytes.get(4..8)? != kind {
        return None;
    }
    bytes[CHUNK_HEADER_BYTES..].split_at_checked(length)
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A GLB with these chunks.
    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut content = Vec::new();
        for (kind, bytes) in chunks {
            content.extend((bytes.len() as u32).to_le_bytes());
            content.extend(*kind);
            content.extend(*bytes);
        }
        let length = (HEADER_BYTES + content.len()) as u32;
        [b"glTF\x02\0\0\0", &length.to_le_bytes()[..], &content].concat()
    }

    #[test]
    fn chunks_are_found_whole_or_not_at_all() {
        let whole = glb(&[(b"JSON", b"{} "), (b"BIN\0", &[7; 5])]);
        let found = chunks(&whole).expect("a GLB");
        assert_eq!((found.json, found.bin), (&b"{} "[..], &[7; 5][..]));
        for length in 0..whole.len() {
            assert!(chunks(&whole[..length]).is_none(), "{length} bytes");
        }
        let without_numbers = glb(&[(b"JSON", b"{}")]);
        assert!(chunks(&without_numbers).is_some_and(|found| found.bin.is_empty()));
        assert!(chunks(&glb(&[(b"BIN\0", b"{}")])).is_none());
    }
}
