//! Limits and errors of dictionary files, and readers that all versions share.

use crate::level::shape::{SHAPES, Shape};
use crate::modular::dictionary::OperatorKind;
use mrt_core::container::{ByteBudget, Container, ContainerError, Format};
use mrt_core::excerpt::excerpt;
use mrt_core::storage::{StoredMatrix, StoredSection, read_stored};

/// The version that is written, and the newest that is read.
pub const DICTIONARY_VERSION: u32 = 2;

/// Default limit of the bytes that reading a dictionary allocates.
pub const DEFAULT_BYTE_BUDGET: u64 = 1 << 30;

/// Largest accepted resolution, texels along an edge of a wall.
pub const MAX_RESOLUTION: usize = 128;

/// Largest accepted number of probes along an edge of a block.
pub const MAX_PROBES: usize = 16;

/// Largest accepted number of modes of any kind.
pub const MAX_MODES: usize = 4096;

/// Most bytes accepted of the preset's name, and of the settings; those of a bake take under a thousand.
pub const MAX_TEXT_BYTES: u64 = 1 << 16;

/// Largest accepted number of variants.
pub const MAX_VARIANTS: usize = 512;

pub(super) const FORMAT: Format = Format {
    magic: *b"\x89MRT\r\n\x1a\n",
    kind: *b"DICT",
    version: DICTIONARY_VERSION,
    oldest_version: 1,
};

/// Why bytes are not a dictionary.
#[derive(Debug, thiserror::Error)]
pub enum DictionaryError {
    /// The container is malformed, or the file could not be read.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// A size is out of its range.
    #[error("dictionary: {what} is {found}; expected {low} to {limit}")]
    Size {
        /// Which size.
        what: &'static str,
        /// Smallest size accepted.
        low: usize,
        /// Largest size accepted.
        limit: usize,
        /// The size in the file.
        found: usize,
    },
    /// The length of a section does not match the sizes.
    #[error("dictionary: section `{section}` has {found} numbers; expected {expected}")]
    Length {
        /// Which section.
        section: String,
        /// Number of numbers by the sizes.
        expected: usize,
        /// Number of numbers in the section.
        found: usize,
    },
    /// A word is not canonical, or not in ascending order.
    #[error(
        "dictionary: word {index} is `{found}`; expected canonical words, each once, ascending"
    )]
    Word {
        /// Position of the word.
        index: usize,
        /// Text of the word.
        found: String,
    },
    /// A parity is not in 0 to 3.
    #[error("dictionary: section `{section}` holds {found}; expected 0 to 3")]
    Parity {
        /// Which section.
        section: String,
        /// The value found.
        found: u16,
    },
    /// A shape is unknown to this release.
    #[error("dictionary: shape {index} is `{found}`; expected one of {expected}")]
    UnknownShape {
        /// Position of the entry.
        index: usize,
        /// Names of all known shapes.
        expected: String,
        /// The name in the file.
        found: String,
    },
    /// A shape is there twice.
    #[error("dictionary: shape `{found}` is there twice; expected once")]
    ShapeTwice {
        /// Name of the shape.
        found: &'static str,
    },
    /// The name of a variant does not give a shape of the dictionary and a transport.
    #[error(
        "dictionary: variant {index} is `{found}`; expected the name of a shape of the dictionary, a colon, and \
         canonical, regathered or rebuilt"
    )]
    Variant {
        /// Position of the entry.
        index: usize,
        /// Text of the entry.
        found: String,
    },
    /// In a file of version 1, the turn to the right is not the mirror image of the turn to the left.
    #[error(
        "dictionary: element ({row}, {column}) of section `right` is {found}; expected {expected}, as in `left` \
         with the signs of odd modes changed"
    )]
    NotMirrored {
        /// Row of the element.
        row: usize,
        /// Column of the element.
        column: usize,
        /// The element of `left`, with the sign that the mirror gives it.
        expected: f32,
        /// The element of `right`.
        found: f32,
    },
}

/// A container, and the bytes that may still be allocated.
pub(super) struct Source<'a, 'c, 'b> {
    pub container: &'c Container<'a>,
    pub budget: &'b mut ByteBudget,
}

impl<'a> Source<'a, '_, '_> {
    /// A matrix of these sizes. Version 1 has no scales, so it can only hold matrices of F32.
    pub(super) fn matrix(
        &mut self,
        kind: OperatorKind,
        section: &str,
        [rows, columns]: [usize; 2],
    ) -> Result<StoredMatrix<'a>, DictionaryError> {
        self.check_length(section, rows * columns)?;
        let section = StoredSection {
            values: section,
            scales: &scales_name(section),
            rows,
            columns,
            modes: kind.modes(),
        };
        Ok(read_stored(self.container, &section, self.budget)?)
    }

    /// A section of finite numbers, which must have the expected length.
    pub(super) fn numbers(
        &mut self,
        section: &str,
        expected: usize,
    ) -> Result<Vec<f32>, DictionaryError> {
        self.check_length(section, expected)?;
        Ok(self.container.finite_numbers(section, self.budget)?)
    }

    /// A copy of a section of text, of [`MAX_TEXT_BYTES`] at most.
    pub(super) fn owned_text(&mut self, section: &str) -> Result<String, DictionaryError> {
        let text = self.container.text(section)?;
        let found = text.len() as u64;
        if found > MAX_TEXT_BYTES {
            return Err(DictionaryError::Container(ContainerError::LimitExceeded {
                what: "text",
                limit: MAX_TEXT_BYTES,
                found,
            }));
        }
        self.budget.spend("text", found)?;
        Ok(text.to_owned())
    }

    /// A section of exactly `N` sizes.
    pub(super) fn sizes<const N: usize>(
        &mut self,
        section: &str,
    ) -> Result<[usize; N], DictionaryError> {
        let sizes: Vec<u32> = self.container.numbers(section, self.budget)?;
        let sizes = <[u32; N]>::try_from(sizes).map_err(|sizes| DictionaryError::Length {
            section: section.to_owned(),
            expected: N,
            found: sizes.len(),
        })?;
        Ok(sizes.map(|n| n as usize))
    }

    /// Checks the number of elements of a section.
    pub(super) fn check_length(
        &self,
        section: &str,
        expected: usize,
    ) -> Result<(), DictionaryError> {
        let found = self.container.element_count(section)?;
        if found == expected {
            Ok(())
        } else {
            Err(DictionaryError::Length {
                section: section.to_owned(),
                expected,
                found,
            })
        }
    }
}

/// Checks that a size, named `what` in the error, is in `low..=high`.
pub(super) fn check_size(
    what: &'static str,
    found: usize,
    low: usize,
    high: usize,
) -> Result<(), DictionaryError> {
    if (low..=high).contains(&found) {
        Ok(())
    } else {
        Err(DictionaryError::Size {
            what,
            low,
            limit: high,
            found,
        })
    }
}

/// The shape with a name from position `index` of a list of shapes.
pub(super) fn known_shape(index: usize, name: &str) -> Result<&'static Shape, DictionaryError> {
    Shape::from_name(name).ok_or_else(|| DictionaryError::UnknownShape {
        index,
        expected: SHAPES.each_ref().map(|shape| shape.name).join(", "),
        found: excerpt(name),
    })
}

/// Name of the section with the scales of a matrix.
pub(super) fn scales_name(values: &str) -> String {
    format!("{values}*")
}
