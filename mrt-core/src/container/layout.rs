//! Where the fields of a file are, and how they are encoded.

use super::element::SectionNumber;
use std::ops::Range;

/// Version of the file layout; the version of what the sections mean is [`Format::version`].
pub const LAYOUT_VERSION: u32 = 1;
/// Sections start at multiples of this many bytes.
pub const ALIGNMENT: usize = 64;
/// Largest number of sections in a file.
pub const MAX_SECTIONS: u32 = 4096;

pub(super) const HEADER_SIZE: usize = 64;
pub(super) const MAGIC: Range<usize> = 0..8;
pub(super) const KIND: Range<usize> = 8..12;
pub(super) const LAYOUT: usize = 12;
pub(super) const CONTENT: usize = 16;
pub(super) const COUNT: usize = 20;
pub(super) const FILE_LENGTH: usize = 24;
pub(super) const TABLE_CRC: usize = 32;
pub(super) const RESERVED: Range<usize> = 36..HEADER_SIZE;

pub(super) const ENTRY_SIZE: usize = 32;
// Fields of a table entry, in bytes from its start.
pub(super) const ENTRY_NAME: Range<usize> = 0..8;
pub(super) const ENTRY_OFFSET: usize = 8;
pub(super) const ENTRY_LENGTH: usize = 16;
pub(super) const ENTRY_TYPE: usize = 24;
pub(super) const ENTRY_CRC: usize = 28;

/// What a file claims to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// First bytes of the file; the same for all files of an application.
    pub magic: [u8; 8],
    /// Which kind of content.
    pub kind: [u8; 4],
    /// Version of the content that is written, and the newest that is read.
    pub version: u32,
    /// Oldest version of the content that is read.
    pub oldest_version: u32,
}

/// CRC-32 of header and table with the field of the checksum itself taken as zero.
pub(super) fn table_crc(header_and_table: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&header_and_table[..TABLE_CRC]);
    hasher.update(&[0; 4]);
    hasher.update(&header_and_table[TABLE_CRC + 4..]);
    hasher.finalize()
}

/// The first eight bytes of a name, padded with zeros.
pub(super) fn encode_name(name: &str) -> [u8; 8] {
    let mut encoded = [0; 8];
    for (to, from) in encoded.iter_mut().zip(name.bytes()) {
        *to = from;
    }
    encoded
}

/// The name in eight bytes of the table; `None` unless they are 1 to 8 printing ASCII characters
/// without space, padded with zeros.
pub(super) fn decode_name(encoded: &[u8]) -> Option<&str> {
    let length = encoded.iter().take_while(|b| b.is_ascii_graphic()).count();
    let (name, padding) = encoded.split_at(length);
    let legal = length > 0 && padding.iter().all(|&byte| byte == 0);
    std::str::from_utf8(name).ok().filter(|_| legal)
}

pub(super) fn put_u32(bytes: &mut [u8], at: usize, value: u32) {
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

pub(super) fn put_u64(bytes: &mut [u8], at: usize, value: u64) {
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
}

pub(super) fn get_u32(bytes: &[u8], at: usize) -> u32 {
    u32::from_bytes(&bytes[at..at + 4])
}

pub(super) fn get_u64(bytes: &[u8], at: usize) -> u64 {
    u64::from_bytes(&bytes[at..at + 8])
}
