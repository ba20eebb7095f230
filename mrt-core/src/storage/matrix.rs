//! Matrices as they are stored, and how they are decoded.

use crate::container::ElementType;
use crate::linalg::matrix::Matrix;
use half::f16;
use std::borrow::Cow;

/// How the numbers of a matrix are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// IEEE single precision, without a scale.
    F32,
    /// IEEE half precision times one power of two per mode.
    F16,
    /// Integers from -127 to 127 times one scale per mode.
    Int8,
}

impl Storage {
    /// All storages, most exact first.
    pub const ALL: [Storage; 3] = [Storage::F32, Storage::F16, Storage::Int8];

    /// "f32", "f16" or "int8".
    pub const fn name(self) -> &'static str {
        match self {
            Storage::F32 => "f32",
            Storage::F16 => "f16",
            Storage::Int8 => "int8",
        }
    }

    /// Inverse of [`Storage::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|storage| storage.name() == name)
    }

    /// Type of the values as a section of a container.
    pub const fn element_type(self) -> ElementType {
        match self {
            Storage::F32 => ElementType::F32,
            Storage::F16 => ElementType::F16,
            Storage::Int8 => ElementType::I8,
        }
    }

    /// Inverse of [`Storage::element_type`]; `None` for types that store no matrix.
    pub fn from_element_type(element_type: ElementType) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|storage| storage.element_type() == element_type)
    }

    /// Largest magnitude of a stored value. Its product with any scale is finite.
    pub(super) const fn largest_value(self) -> f32 {
        match self {
            Storage::F32 => f32::MAX,
            Storage::F16 => f16::MAX.to_f32_const(),
            Storage::Int8 => 127.0,
        }
    }
}

/// Which lines of a matrix are modes. The numbers of a mode share a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeAxis {
    /// Each row is a mode: operators that give coefficients.
    Rows,
    /// Each column is a mode: bases.
    Columns,
}

impl ModeAxis {
    /// Number of modes of a rows x columns matrix.
    pub const fn count(self, rows: usize, columns: usize) -> usize {
        match self {
            ModeAxis::Rows => rows,
            ModeAxis::Columns => columns,
        }
    }
}

/// A column-major matrix as it is stored. Every element decodes to a finite number.
///
/// A dense product may read [`values`](Self::values) and [`scales`](Self::scales) in place.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredMatrix<'a> {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) modes: ModeAxis,
    pub(super) values: CowValues<'a>,
    /// One scale per mode: finite, normal, positive, and for `f16` a power of two. Empty for `f32`.
    pub(super) scales: Cow<'a, [f32]>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum CowValues<'a> {
    F32(Cow<'a, [f32]>),
    F16(Cow<'a, [f16]>),
    Int8(Cow<'a, [i8]>),
}

/// Column-major values before they are multiplied by the scales.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StoredValues<'a> {
    /// The elements themselves.
    F32(&'a [f32]),
    /// Values to be scaled; all are finite.
    F16(&'a [f16]),
    /// Values to be scaled. -128 does not occur, so every value can be negated.
    Int8(&'a [i8]),
}

impl<'a> StoredMatrix<'a> {
    /// Borrows a matrix as [`Storage::F32`], without a copy.
    ///
    /// # Panics
    /// If an element is infinite or NaN.
    pub fn of(matrix: &'a Matrix<f32>, modes: ModeAxis) -> Self {
        assert_finite(matrix);
        StoredMatrix {
            rows: matrix.rows(),
            columns: matrix.columns(),
            modes,
            values: CowValues::F32(Cow::Borrowed(matrix.data())),
            scales: Cow::Borrowed(&[]),
        }
    }

    /// Borrows the same matrix, without a copy.
    pub fn borrowed(&self) -> StoredMatrix<'_> {
        StoredMatrix {
            rows: self.rows,
            columns: self.columns,
            modes: self.modes,
            values: match self.values() {
                StoredValues::F32(values) => CowValues::F32(Cow::Borrowed(values)),
                StoredValues::F16(values) => CowValues::F16(Cow::Borrowed(values)),
                StoredValues::Int8(values) => CowValues::Int8(Cow::Borrowed(values)),
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
    /// Whether rows or columns are modes.
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
    /// The values before they are scaled, for a product that applies the scales itself.
    pub fn values(&self) -> StoredValues<'_> {
        match &self.values {
            CowValues::F32(values) => StoredValues::F32(values),
            CowValues::F16(values) => StoredValues::F16(values),
            CowValues::Int8(values) => StoredValues::Int8(values),
        }
    }
    /// What the values of each mode are multiplied by: one scale per mode, or none for `f32`.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// Bytes of values and scales, owned or borrowed.
    pub fn bytes(&self) -> usize {
        let values = match self.values() {
            StoredValues::F32(values) => size_of_val(values),
            StoredValues::F16(values) => size_of_val(values),
            StoredValues::Int8(values) => size_of_val(values),
        };
        values + size_of_val(self.scales())
    }

    /// True if the values are borrowed. The few scales may be a copy even then.
    pub fn is_borrowed(&self) -> bool {
        match &self.values {
            CowValues::F32(values) => matches!(values, Cow::Borrowed(_)),
            CowValues::F16(values) => matches!(values, Cow::Borrowed(_)),
            CowValues::Int8(values) => matches!(values, Cow::Borrowed(_)),
        }
    }

    /// The same matrix, owned: copies what is borrowed.
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

    /// The element in row `i` and column `j`. To read many, use [`StoredMatrix::decode_column`].
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
            StoredValues::F32(values) => values[at],
            StoredValues::F16(values) => values[at].to_f32_const() * scale(),
            StoredValues::Int8(values) => f32::from(values[at]) * scale(),
        }
    }

    /// Writes column `j` to `out`, as `f32`.
    ///
    /// # Panics
    /// If `j` is out of range, or `out` does not have `rows` entries.
    pub fn decode_column(&self, j: usize, out: &mut [f32]) {
        assert!(j < self.columns, "column {j} of {}", self.columns);
        assert_eq!(out.len(), self.rows, "column length");
        let column = j * self.rows..(j + 1) * self.rows;
        match self.values() {
            StoredValues::F32(values) => {
                out.copy_from_slice(&values[column]);
                return;
            }
            StoredValues::F16(values) => {
                for (o, x) in out.iter_mut().zip(&values[column]) {
                    // Not `to_f32`, whose code depends on the machine and on features that other
                    // crates may set.
                    *o = x.to_f32_const();
                }
            }
            StoredValues::Int8(values) => {
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

    /// The whole matrix as `f32`.
    pub fn to_matrix(&self) -> Matrix<f32> {
        let mut matrix = Matrix::zeros(self.rows, self.columns);
        for j in 0..self.columns {
            let column = j * self.rows..(j + 1) * self.rows;
            self.decode_column(j, &mut matrix.data_mut()[column]);
        }
        matrix
    }
}

/// # Panics
/// If an element is infinite or NaN.
pub(super) fn assert_finite(matrix: &Matrix<f32>) {
    assert!(
        matrix.data().iter().all(|x| x.is_finite()),
        "a matrix to store must be finite"
    );
}
