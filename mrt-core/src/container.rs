//! A versioned binary container for baked numbers: named sections behind a checked table.
//!
//! All integers are little-endian. A file has three parts:
//!
//! 1. A header of 64 bytes: magic (8), kind (4), layout version (4), content version (4), section
//!    count (4), file length (8), CRC-32 of header and table with this field zero (4), zeros (28).
//! 2. A table of 32 bytes for each section: name padded with zeros (8), offset (8), length in bytes (8),
//!    element type (4), CRC-32 of the section (4).
//! 3. The sections in the order of the table. Each starts at the next multiple of 64 bytes, gaps are
//!    zeros, and the last section ends the file.
//!
//! So the same sections always give the same file, and a mapped file can be used in place.
//!
//! Readers take bytes as hostile: everything is checked before it is used, every allocation is first
//! taken from a [`ByteBudget`], and no input makes them panic.

mod layout;
mod error;
mod budget;
mod element;
pub mod place;
mod file;
mod table;
mod writer;
mod reader;
mod in_place;

pub use budget::ByteBudget;
pub use element::{ElementType, SectionNumber};
pub use error::ContainerError;
pub(crate) use error::malformed;
pub use file::{
    StagedFile, check_folder_is_writable, read_file, remove_abandoned_parts, write_file_atomically,
};
pub use layout::{ALIGNMENT, Format, LAYOUT_VERSION, MAX_SECTIONS};
pub use reader::Container;
pub use writer::Writer;

#[cfg(test)]
pub(crate) mod fixtures;
#[cfg(test)]
mod tests;
