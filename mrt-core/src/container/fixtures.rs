//! What tests of containers share.

use super::{ALIGNMENT, ByteBudget, Container, Format};

pub(crate) const FORMAT: Format = Format {
    magic: *b"TESTDATA",
    kind: *b"unit",
    version: 3,
    oldest_version: 2,
};

/// A sound file of [`FORMAT`].
pub(crate) fn open(bytes: &[u8]) -> Container<'_> {
    Container::read(bytes, &FORMAT, &mut ByteBudget::new(1 << 16)).expect("a sound file")
}

/// A file at a chosen place in memory.
pub(crate) struct Placed {
    room: Vec<u8>,
    start: usize,
    length: usize,
}

impl Placed {
    /// Copies `file` to an address `shift` bytes after a multiple of 64.
    pub(crate) fn new(file: &[u8], shift: usize) -> Self {
        let mut room = vec![0; file.len() + 2 * ALIGNMENT];
        let start = room.as_ptr().align_offset(ALIGNMENT) + shift;
        room[start..start + file.len()].copy_from_slice(file);
        Self {
            room,
            start,
            length: file.len(),
        }
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.room[self.start..][..self.length]
    }
}
