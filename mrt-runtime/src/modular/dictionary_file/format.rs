//! Limits and errors of dictionary files, and what every version of them is read by.

use crate::level::shape::{SHAPES, Shape};
use crate::modular::dictionary::OperatorKind;
use mrt_core::container::{ByteBudget, Container, ContainerError, Format};
use mrt_core::storage::{StoredMatrix, StoredSection, read_stored};

/// Version that is written, and the newest that is read.
pub const DICTIONARY_VERSION: u32 = 2;

/// Bytes that reading a dictionary may allocate by default.
pub const DEFAULT_BYTE_BUDGET: u64 = 1 << 30;

/// Largest accepted resolution, texels along an edge of a wall.
pub const MAX_RESOLUTION: usize = 128;

/// Largest accepted number of probes along an edge of a block.
pub const MAX_PROBES: usize = 16;

/// Largest accepted number of modes of any kind.
pub const MAX_MODES: usize = 4096;

/// Most variants of shapes in a dictionary.
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
    /// The container is at fault, or the file system.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// A size is out of range.
    #[error("dictionary: {what} is {found}; expected {low} to {limit}")]
    Size {
        /// Which size.
        what: &'static str,
        /// Smallest accepted.
        low: usize,
        /// Largest accepted.
        limit: usize,
        /// The size in the file.
        found: usize,
    },
    /// A section's length does not follow from the sizes.
    #[error("dictionary: section `{section}` has {found} numbers; expected {expected}")]
    Length {
        /// Which section.
        section: String,
        /// Numbers that the sizes ask for.
        expected: usize,
        /// Numbers in the section.
        found: usize,
    },
    /// Not a path, or not in its place.
    #[error(
        "dictionary: word {index} is `{found}`; expected canonical words, each once, ascending"
    )]
    Word {
        /// Its position.
        index: usize,
        /// Its text.
        found: String,
    },
    /// A parity is not one of the four.
    #[error("dictionary: section `{section}` holds {found}; expected 0 to 3")]
    Parity {
        /// Which section.
        section: String,
        /// The value there.
        found: u16,
    },
    /// A shape that this release does not know.
    #[error("dictionary: shape {index} is `{found}`; expected one of {expected}")]
    UnknownShape {
        /// Which entry.
        index: usize,
        /// Names of all shapes.
        expected: String,
        /// The name in the file.
        found: String,
    },
    /// The same shape twice.
    #[error("dictionary: shape `{found}` is there twice; expected once")]
    ShapeTwice {
        /// Its name.
        found: &'static str,
    },
    /// Not a variant of a shape.
    #[error(
        "dictionary: variant {index} is `{found}`; expected the name of a shape of the dictionary, a colon, and \
         canonical, regathered or rebuilt"
    )]
    Variant {
        /// Which entry.
        index: usize,
        /// Its text.
        found: String,
    },
    /// A turn to the right, in a file of version 1, that no mirror makes of the turn to the left.
    #[error(
        "dictionary: element ({row}, {column}) of section `right` is {found}; expected {expected}, as in `left` \
         with the signs of odd modes changed"
    )]
    NotMirrored {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
        /// What the mirror makes of the element of `left`.
        expected: f32,
        /// What is there.
        found: f32,
    },
}

/// A container with what may still be allocated.
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

    pub(super) fn numbers(
        &mut self,
        section: &str,
        expected: usize,
    ) -> Result<Vec<f32>, DictionaryError> {
        self.check_length(section, expected)?;
        Ok(self.container.finite_numbers(section, self.budget)?)
    }

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

/// The shape of that name, which stands at `index` of a list of shapes.
pub(super) fn known_shape(index: usize, name: &str) -> Result<&'static Shape, DictionaryError> {
    Shape::from_name(name).ok_or_else(|| DictionaryError::UnknownShape {
        index,
        expected: SHAPES.each_ref().map(|shape| shape.name).join(", "),
        found: name.chars().take(32).collect(),
    })
}

/// Name of the section of scales of a matrix.
pub(super) fn scales_name(values: &str) -> String {
    format!("{values}*")
}
