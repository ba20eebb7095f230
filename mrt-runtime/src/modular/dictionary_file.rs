//! Dictionaries as bytes, in the versioned container of the core.
//!
//! Version 2, which is written. The values of a matrix are a section of F32, F16 or I8, column-major; unless they
//! are F32, the next section holds its scales, one F32 a mode (`OperatorKind::modes`), and is named like it with a
//! `*` behind, for which names are at most seven bytes long:
//!
//! | section | content |
//! | --- | --- |
//! | `preset`, `settings` | text |
//! | `sizes` | resolution, probes, shapes, variants, lightfield modes, emission modes, response modes, 1 with vertical openings, holes, depth, depth with holes |
//! | `dropped` | shares of energy left out: lightfield, emission, response modes |
//! | `rlf.par`, `e.par`, `r.par` | parities of lightfield, emission and response modes, U16 |
//! | `e_rlf`, `left`, `ahead`, `swap`, `hole<n>`, `T_rlf_r` | matrices of lightfields: from emission, left, straight, exchange, holes, response |
//! | `words`, `P<n>` | text, and for each word of it the matrix |
//! | `shapes`, `variants` | text: names; name and transport with a colon between |
//! | `corners` | 24 F32 a variant |
//! | `n.k`, `n.s`, `n.d` | for n counting shapes, then variants: modes and joint modes; singular values; dropped energy, the same of joint modes |
//! | `n.T`, `n.L` | matrices `T_d->b` and `L_imp` |
//! | `n.J`, `n.Jp`, `n.Jv` | matrices: the joint basis of irradiance, probes, vector irradiance |
//! | `n.E<m>`, `n.Q<m>` | of opening m: emission from coefficients, joint from response |
//! | `n.X<m>`, `n.Y<m>` | the same with x and y exchanged, in sets with vertical openings |
//! | `B_e`, `U_r` | matrices of the sources; absent from packed dictionaries |
//!
//! `swap`, `n.L` and `n.Jv` may be empty. Version 1 is read, by `version1.rs`.

mod read;
mod version1;
mod write;

use crate::level::shape::{Hole, SHAPES};
use crate::modular::dictionary::{Dictionary, StoredDictionary};
use crate::modular::path::MAX_WORD;
use mrt_core::container::{ByteBudget, Container, ContainerError, Format};

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

const FORMAT: Format = Format {
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

impl<'a> StoredDictionary<'a> {
    /// Reads the bytes of a dictionary file, of which the matrices stay where they are if the bytes start at a
    /// multiple of four in memory (a mapped file does); no input makes it panic or allocate beyond `budget`.
    ///
    /// Cost: two passes over the bytes. Matrices of bytes that start elsewhere, and some of files of version 1, are
    /// copied.
    ///
    /// # Errors
    /// [`DictionaryError`], at the first thing that is wrong.
    pub fn read(bytes: &'a [u8], budget: &mut ByteBudget) -> Result<Self, DictionaryError> {
        let container = Container::read(bytes, &FORMAT, budget)?;
        let mut source = Source {
            container: &container,
            budget,
        };
        match container.version() {
            1 => version1::read(&mut source),
            _ => read::read(&mut source),
        }
    }
}

impl Dictionary {
    /// Reads the bytes of a dictionary file and decodes every matrix; no input makes it panic or allocate beyond
    /// `budget`.
    ///
    /// # Errors
    /// As [`StoredDictionary::read`].
    pub fn from_bytes(bytes: &[u8], budget: &mut ByteBudget) -> Result<Self, DictionaryError> {
        let stored = StoredDictionary::read(bytes, budget)?;
        let mut numbers = 0u64;
        stored.map(|_, matrix| numbers += matrix.rows() as u64 * matrix.columns() as u64);
        budget.spend("decoded matrices", size_of::<f32>() as u64 * numbers)?;
        Ok(stored.decode())
    }
}

/// A container with what may still be allocated.
struct Source<'a, 'c, 'b> {
    container: &'c Container<'a>,
    budget: &'b mut ByteBudget,
}

impl Source<'_, '_, '_> {
    fn numbers(&mut self, section: &str, expected: usize) -> Result<Vec<f32>, DictionaryError> {
        self.check_length(section, expected)?;
        Ok(self.container.finite_numbers(section, self.budget)?)
    }

    fn sizes<const N: usize>(&mut self, section: &str) -> Result<[usize; N], DictionaryError> {
        let sizes: Vec<u32> = self.container.numbers(section, self.budget)?;
        let sizes = <[u32; N]>::try_from(sizes).map_err(|sizes| DictionaryError::Length {
            section: section.to_owned(),
            expected: N,
            found: sizes.len(),
        })?;
        Ok(sizes.map(|n| n as usize))
    }

    fn check_length(&self, section: &str, expected: usize) -> Result<(), DictionaryError> {
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

fn check_size(
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
fn known_shape(
    index: usize,
    name: &str,
) -> Result<&'static crate::level::shape::Shape, DictionaryError> {
    crate::level::shape::Shape::from_name(name).ok_or_else(|| DictionaryError::UnknownShape {
        index,
        expected: SHAPES.each_ref().map(|shape| shape.name).join(", "),
        found: name.chars().take(32).collect(),
    })
}
