//! A versioned binary container for baked numbers: named sections behind a checked table.
//!
//! All integers are little-endian. A header of 64 bytes: magic (8), kind (4), layout version (4),
//! content version (4), section count (4), file length (8), CRC-32 of header and table with this field
//! zero (4), zeros (28). Then the table, 32 bytes a section: name padded with zeros (8), offset (8),
//! length in bytes (8), element type (4), CRC-32 of the section (4). Then the sections in the order
//! of the table, each at the next multiple of 64 bytes with zeros between, the last one ending the
//! file. So there is one file for given sections, and a mapped file can be used in place.
//!
//! Readers take bytes as hostile: everything is checked before it is used, every allocation is first
//! taken from a [`ByteBudget`], and no input makes them panic.

mod element;
mod error;
mod file;
mod in_place;
mod reader;
mod writer;

pub use element::{Element, ElementType};
pub use error::{ByteBudget, ContainerError};
pub use file::{read_file, write_file_atomically};
pub use reader::Container;
pub use writer::Writer;

use std::ops::Range;

/// Version of the layout described above, apart from that of what the sections mean.
pub const LAYOUT_VERSION: u32 = 1;
/// Sections start at multiples of this many bytes.
pub const ALIGNMENT: usize = 64;
/// Most sections in a file.
pub const MAX_SECTIONS: u32 = 4096;

const HEADER_SIZE: usize = 64;
const ENTRY_SIZE: usize = 32;
const MAGIC: Range<usize> = 0..8;
const KIND: Range<usize> = 8..12;
const LAYOUT: usize = 12;
const CONTENT: usize = 16;
const COUNT: usize = 20;
const FILE_LENGTH: usize = 24;
const TABLE_CRC: usize = 32;
const RESERVED: Range<usize> = 36..HEADER_SIZE;

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
fn table_crc(header_and_table: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&header_and_table[..TABLE_CRC]);
    hasher.update(&[0; 4]);
    hasher.update(&header_and_table[TABLE_CRC + 4..]);
    hasher.finalize()
}

/// The first eight bytes of a name, padded with zeros.
fn encode_name(name: &str) -> [u8; 8] {
    let mut encoded = [0; 8];
    for (to, from) in encoded.iter_mut().zip(name.bytes()) {
        *to = from;
    }
    encoded
}

/// The name in eight bytes of the table, if it is one.
fn decode_name(encoded: &[u8]) -> Option<&str> {
    let length = encoded.iter().take_while(|b| b.is_ascii_graphic()).count();
    let (name, padding) = encoded.split_at(length);
    let legal = length > 0 && padding.iter().all(|&byte| byte == 0);
    std::str::from_utf8(name).ok().filter(|_| legal)
}

fn put_u32(bytes: &mut [u8], at: usize, value: u32) {
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

fn put_u64(bytes: &mut [u8], at: usize, value: u64) {
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
}

fn get_u32(bytes: &[u8], at: usize) -> u32 {
    u32::from_bytes(&bytes[at..at + 4])
}

fn get_u64(bytes: &[u8], at: usize) -> u64 {
    u64::from_bytes(&bytes[at..at + 8])
}

#[cfg(test)]
mod tests;
