//! Dictionaries as bytes, in the versioned container of the core.
//!
//! This is version 2, the version that is written. The values of a matrix are a section of F32, F16 or I8,
//! column-major. A matrix of F16 or I8 has a second section with its scales, one F32 for each mode
//! (`OperatorKind::modes`). Its name is that of the values followed by `*`, so names of values are at most seven bytes
//! long.
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
//! | `n.k`, `n.s`, `n.d` | with n counting shapes, then variants: numbers of modes and joint modes; singular values; dropped energy of modes and joint modes |
//! | `n.T`, `n.L` | matrices `T_d->b` and `L_imp` |
//! | `n.J`, `n.Jp`, `n.Jv` | matrices: the joint basis of irradiance, probes, vector irradiance |
//! | `n.E<m>`, `n.Q<m>` | of opening m: emission from coefficients, joint from response |
//! | `n.X<m>`, `n.Y<m>` | the same with x and y exchanged, in sets with vertical openings |
//! | `B_e`, `U_r` | matrices of the sources; absent from packed dictionaries |
//!
//! `swap`, `n.L` and `n.Jv` may be empty. `version1.rs` reads version 1.

pub mod format;
mod read;
mod version1;
mod write;

pub use format::{
    DEFAULT_BYTE_BUDGET, DICTIONARY_VERSION, DictionaryError, MAX_MODES, MAX_PROBES,
    MAX_RESOLUTION, MAX_TEXT_BYTES, MAX_VARIANTS,
};

use crate::modular::dictionary::{Dictionary, StoredDictionary};
use crate::modular::dictionary_file::format::{FORMAT, Source};
use mrt_core::container::{ByteBudget, Container};

impl<'a> StoredDictionary<'a> {
    /// Reads the bytes of a dictionary file. Matrices borrow the bytes if those start at a multiple of four in memory,
    /// as a mapped file does. No input makes it panic or allocate beyond `budget`.
    ///
    /// Cost: two passes over the bytes. Matrices are copied if the bytes are not aligned, and some matrices of version
    /// 1 always are.
    ///
    /// # Errors
    /// [`DictionaryError`], for the first fault found.
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
    /// Reads the bytes of a dictionary file and decodes every matrix. No input makes it panic or allocate more than
    /// [`DEFAULT_BYTE_BUDGET`].
    ///
    /// # Errors
    /// The errors of [`StoredDictionary::read`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, DictionaryError> {
        Self::from_bytes_within(bytes, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET))
    }

    /// Reads the bytes of a dictionary file and decodes every matrix. No input makes it panic or allocate beyond
    /// `budget`.
    ///
    /// # Errors
    /// The errors of [`StoredDictionary::read`].
    pub fn from_bytes_within(
        bytes: &[u8],
        budget: &mut ByteBudget,
    ) -> Result<Self, DictionaryError> {
        let stored = StoredDictionary::read(bytes, budget)?;
        let mut numbers = 0u64;
        stored.map(|_, matrix| numbers += matrix.rows() as u64 * matrix.columns() as u64);
        budget.spend("decoded matrices", size_of::<f32>() as u64 * numbers)?;
        let text = stored.preset.len() + stored.settings.len();
        budget.spend("text", text as u64)?;
        Ok(stored.decode())
    }
}
