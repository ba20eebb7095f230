//! Matrices in fewer bytes: `f32`, `f16`, or `int8` with a scale a mode, owned or used where they lie
//! in the bytes of a file.
//!
//! A **mode** is a column of a basis (texels x modes) and a row of an operator that gives
//! coefficients (modes x texels): [`ModeAxis`] says which. Element (row, column) stands for
//! `values[column * rows + row] * scales[mode]`, computed in `f32`; `f32` itself has no scales.
//! How scales are chosen is in `encode.rs`, sections of a container in `sections.rs`.
//!
//! Errors are relative, in L2, of a matrix that is encoded and decoded. Those of products with it are
//! alike, unless the products cancel:
//!
//! | storage | bytes an element | error |
//! | --- | --- | --- |
//! | `f32` | 4 | 0 |
//! | `f16` | 2 | 0.02 %, whatever the magnitude; at most 2⁻¹¹ = 0.05 %, of a mode whose numbers are alike |
//! | `int8` | 1 | 0.23 % times the ratio of largest to root mean square, of typical modes |
//!
//! So `int8` suits modes without peaks. Measured on baked operators (16² texels, 32 modes, scales a mode): bases
//! of irradiance in a room 0.04 to 0.37 %, but operators that give their coefficients 0.66 to 1.2 %, light
//! that enters by an opening 1.2 %, operators between openings 0.4 to 1 %. The axis matters more
//! than its error tells: scales a texel make an operator that gives coefficients more exact (0.6 %) and the
//! light of those coefficients useless (tens of percent), for errors of weak modes reach the strong ones.

mod encode;
mod sections;

pub use half::f16;
pub use sections::{StoredSection, read_stored, write_stored};

use crate::container::ElementType;
use crate::linalg::matrix::Matrix;
use std::borrow::Cow;

/// How the numbers of a matrix are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// IEEE single precision, as it is.
    F32,
    /// IEEE half precision times a power of two a mode.
    F16,
    /// Integers from -127 to 127 times a scale a mode.
    Int8,
}

impl Storage {
    /// All of them, most exact first.
    pub const ALL: [Storage; 3] = [Storage::F32, Storage::F16, Storage::Int8];

    /// "f32", "f16" or "int8".
    pub const fn name(self) -> &'static str {
        match self {
            Storage::F32 => "f32",
            Storage::F16 => "f16",
            Storage::Int8 => "int8",
        }
    }

    /// The one of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|storage| storage.name() == name)
    }

    /// Type of the values in a container.
    pub const fn element_type(self) -> ElementType {
        match self {
            Storage::F32 => ElementType::F32,
            Storage::F16 => ElementType::F16,
            Storage::Int8 => ElementType::I8,
        }
    }

    /// The one whose values have that type in a container, if there is one.
    pub fn from_element_type(element_type: ElementType) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|storage| storage.element_type() == element_type)
    }

    /// Largest magnitude of a stored value; scales are such that this times a scale is finite.
    const fn largest_value(self) -> f32 {
        match self {
            Storage::F32 => f32::MAX,
            Storage::F16 => f16::MAX.to_f32_const(),
            Storage::Int8 => 127.0,
        }
    }
}

/// Which lines of a matrix are modes, and so share a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeAxis {
    /// Each row: operators that give coefficients, modes x anything.
    Rows,
    /// Each column: bases, anything x modes.
    Columns,
}

impl ModeAxis {
    /// Modes of a matrix of that shape.
    pub const fn count(self, rows: usize, columns: usize) -> usize {
        match self {
            ModeAxis::Rows => rows,
            ModeAxis::Columns => columns,
        }
    }
}

/// A column-major matrix as it is stored; a dense product may read it in place.
///
/// Every element decodes to a finite number.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredMatrix<'a> {
    rows: usize,
    columns: usize,
    modes: ModeAxis,
    values: CowValues<'a>,
    /// One a mode: finite, normal, positive; for `f16` powers of two. Empty for `f32`.
    scales: Cow<'a, [f32]>,
}

#[derive(Clone, Debug, PartialEq)]
enum CowValues<'a> {
    F32(Cow<'a, [f32]>),
    F16(Cow<'a, [f16]>),
    Int8(Cow<'a, [i8]>),
}

/// Column-major values before they are multiplied by the scales.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values<'a> {
    /// The elements themselves.
    F32(&'a [f32]),
    /// To be scaled; all finite.
    F16(&'a [f16]),
    /// To be scaled; -128 does not occur, so every value can be negated.
    Int8(&'a [i8]),
}

impl StoredMatrix<'static> {
    /// Rounds a matrix to `storage`, with a scale a mode unless that is `f32`.
    ///
    /// `f16` rounds to nearest, ties to even, after an exact division by a power of two, so the error does
    /// not depend on the magnitude of a mode; `int8` rounds multiples of the largest magnitude of the mode
    /// / 127 likewise. The same matrix gives the same bits on every machine.
    ///
    /// Cost: two passes over the matrix.
    ///
    /// # Panics
    /// If an element is infinite or not a number.
    pub fn encode(matrix: &Matrix<f32>, storage: Storage, modes: ModeAxis) -> Self {
        encode::encode(matrix, storage, modes)
    }
}

impl<'a> StoredMatrix<'a> {
    /// The matrix as it is, in `f32`, without a copy.
    ///
    /// # Panics
    /// If an element is infinite or not a number.
    pub fn of(matrix: &'a Matrix<f32>, modes: ModeAxis) -> Self {
        assert!(
            matrix.data().iter().all(|x| x.is_finite()),
            "a matrix to store must be finite"
        );
        StoredMatrix {
            rows: matrix.rows(),
            columns: matrix.columns(),
            modes,
            values: CowValues::F32(Cow::Borrowed(matrix.data())),
            scales: Cow::Borrowed(&[]),
        }
    }

    /// The same matrix without a copy.
    pub fn borrowed(&self) -> StoredMatrix<'_> {
        StoredMatrix {
            rows: self.rows,
            columns: self.columns,
            modes: self.modes,
            values: match self.values() {
                Values::F32(values) => CowValues::F32(Cow::Borrowed(values)),
                Values::F16(values) => CowValues::F16(Cow::Borrowed(values)),
                Values::Int8(values) => CowValues::Int8(Cow::Borrowed(values)),
            },
            scales: Cow::Borrowed(self.scales()),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }
    /// Which lines share a scale.
    pub fn modes(&self) -> ModeAxis {
        self.modes
    }
    /// How the numbers are stored.
    pub fn storage(&self) -> Storage {
        match self.values {
            CowValues::F32(_) => Storage::F32,
            CowValues::F16(_) => Storage::F16,
            CowValues::Int8(_) => Storage::Int8,
        }
    }
    /// The values, for a product that applies the scales itself.
    pub fn values(&self) -> Values<'_> {
        match &self.values {
            CowValues::F32(values) => Values::F32(values),
            CowValues::F16(values) => Values::F16(values),
            CowValues::Int8(values) => Values::Int8(values),
        }
    }
    /// What the values of each mode are multiplied by: one a mode, none for `f32`.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// Bytes of values and scales, be they in a file or not.
    pub fn bytes(&self) -> usize {
        let values = match self.values() {
            Values::F32(values) => size_of_val(values),
            Values::F16(values) => size_of_val(values),
            Values::Int8(values) => size_of_val(values),
        };
        values + size_of_val(self.scales())
    }

    /// Whether the values lie in the bytes of a file. The few scales may be a copy even then.
    pub fn is_borrowed(&self) -> bool {
        match &self.values {
            CowValues::F32(values) => matches!(values, Cow::Borrowed(_)),
            CowValues::F16(values) => matches!(values, Cow::Borrowed(_)),
            CowValues::Int8(values) => matches!(values, Cow::Borrowed(_)),
        }
    }

    /// The same matrix, independent of the file; copies what is borrowed.
    pub fn into_owned(self) -> StoredMatrix<'static> {
        StoredMatrix {
            rows: self.rows,
            columns: self.columns,
            modes: self.modes,
            values: match self.values {
                CowValues::F32(values) => CowValues::F32(Cow::Owned(values.into_owned())),
                CowValues::F16(values) => CowValues::F16(Cow::Owned(values.into_owned())),
                CowValues::Int8(values) => CowValues::Int8(Cow::Owned(values.into_owned())),
            },
            scales: Cow::Owned(self.scales.into_owned()),
        }
    }

    /// One element; to read many, decode a column.
    ///
    /// # Panics
    /// If `i` or `j` is out of range.
    pub fn get(&self, i: usize, j: usize) -> f32 {
        assert!(i < self.rows && j < self.columns, "element ({i}, {j})");
        let at = j * self.rows + i;
        let scale = || match self.modes {
            ModeAxis::Rows => self.scales[i],
            ModeAxis::Columns => self.scales[j],
        };
        match self.values() {
            Values::F32(values) => values[at],
            Values::F16(values) => values[at].to_f32_const() * scale(),
            Values::Int8(values) => f32::from(values[at]) * scale(),
        }
    }

    /// Writes column `j`, as `f32`, to `out`.
    ///
    /// # Panics
    /// If `j` is out of range, or `out` does not have one entry a row.
    pub fn decode_column(&self, j: usize, out: &mut [f32]) {
        assert!(j < self.columns, "column {j} of {}", self.columns);
        assert_eq!(out.len(), self.rows, "column length");
        let column = j * self.rows..(j + 1) * self.rows;
        match self.values() {
            Values::F32(values) => {
                out.copy_from_slice(&values[column]);
                return;
            }
            Values::F16(values) => {
                for (o, x) in out.iter_mut().zip(&values[column]) {
                    // Not `to_f32`, whose path depends on how the machine and other crates are set up.
                    *o = x.to_f32_const();
                }
            }
            Values::Int8(values) => {
                for (o, &x) in out.iter_mut().zip(&values[column]) {
                    *o = f32::from(x);
                }
            }
        }
        match self.modes {
            ModeAxis::Rows => {
                for (o, scale) in out.iter_mut().zip(self.scales()) {
                    *o *= scale;
                }
            }
            ModeAxis::Columns => {
                let scale = self.scales[j];
                for o in out {
                    *o *= scale;
                }
            }
        }
    }

    /// All of it as `f32`.
    pub fn to_matrix(&self) -> Matrix<f32> {
        let mut matrix = Matrix::zeros(self.rows, self.columns);
        for j in 0..self.columns {
            let column = j * self.rows..(j + 1) * self.rows;
            self.decode_column(j, &mut matrix.data_mut()[column]);
        }
        matrix
    }
}

#[cfg(test)]
mod tests;
