//! The matrices of a dictionary: which operator each is, whether its rows or columns are modes, and how it is stored.

use mrt_core::linalg::matrix::Matrix;
use mrt_core::storage::{ModeAxis, Storage, StoredMatrix};
use std::borrow::Cow;

/// A matrix of a dictionary: as `f32`, or as a file stores it.
pub trait OperatorMatrix: Clone {
    /// Number of rows.
    fn rows(&self) -> usize;
    /// Number of columns.
    fn columns(&self) -> usize;
    /// Bytes of the matrix, scales included.
    fn bytes(&self) -> usize;
    /// The matrix as `f32`; borrowed if it is `f32` already.
    fn decode(&self) -> Cow<'_, Matrix<f32>>;
    /// The matrix as a file stores it. `modes` matters only for matrices without scales.
    fn as_stored(&self, modes: ModeAxis) -> StoredMatrix<'_>;
    /// A matrix without elements.
    ///
    /// # Panics
    /// If neither `rows` nor `columns` is 0.
    fn empty(rows: usize, columns: usize) -> Self;
}

impl OperatorMatrix for Matrix<f32> {
    fn rows(&self) -> usize {
        self.rows()
    }
    fn columns(&self) -> usize {
        self.columns()
    }
    fn bytes(&self) -> usize {
        size_of_val(self.data())
    }
    fn decode(&self) -> Cow<'_, Matrix<f32>> {
        Cow::Borrowed(self)
    }
    fn as_stored(&self, modes: ModeAxis) -> StoredMatrix<'_> {
        StoredMatrix::of(self, modes)
    }
    fn empty(rows: usize, columns: usize) -> Self {
        assert_eq!(rows * columns, 0, "a matrix without elements");
        Matrix::zeros(rows, columns)
    }
}

impl OperatorMatrix for StoredMatrix<'_> {
    fn rows(&self) -> usize {
        self.rows()
    }
    fn columns(&self) -> usize {
        self.columns()
    }
    fn bytes(&self) -> usize {
        self.bytes()
    }
    fn decode(&self) -> Cow<'_, Matrix<f32>> {
        Cow::Owned(self.to_matrix())
    }
    fn as_stored(&self, _: ModeAxis) -> StoredMatrix<'_> {
        self.borrowed()
    }
    fn empty(rows: usize, columns: usize) -> Self {
        assert_eq!(rows * columns, 0, "a matrix without elements");
        StoredMatrix::encode(
            &Matrix::zeros(rows, columns),
            Storage::F32,
            ModeAxis::Columns,
        )
    }
}

/// Which operator a matrix of a dictionary is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum OperatorKind {
    /// [`ShapeOperators::coefficients_from_direct`](crate::modular::dictionary::types::ShapeOperators::coefficients_from_direct).
    CoefficientsFromDirect,
    /// [`ShapeOperators::joint_basis`](crate::modular::dictionary::types::ShapeOperators::joint_basis).
    JointBasis,
    /// [`ShapeOperators::probe_basis`](crate::modular::dictionary::types::ShapeOperators::probe_basis).
    ProbeBasis,
    /// [`ShapeOperators::vector_basis`](crate::modular::dictionary::types::ShapeOperators::vector_basis).
    VectorBasis,
    /// [`ShapeOperators::implicit_lighting`](crate::modular::dictionary::types::ShapeOperators::implicit_lighting).
    ImplicitLighting,
    /// [`OpeningOperators::emission_from_coefficients`](crate::modular::dictionary::types::OpeningOperators::emission_from_coefficients).
    Emission,
    /// [`OpeningOperators::joint_from_response`](crate::modular::dictionary::types::OpeningOperators::joint_from_response).
    JointFromResponse,
    /// [`PathEntry::response_from_emission`](crate::modular::dictionary::types::PathEntry::response_from_emission).
    Path,
    /// All of [`LightfieldOperators`](crate::modular::dictionary::types::LightfieldOperators).
    Lightfield,
    /// [`Sources::emission_from_radiosity`](crate::modular::dictionary::types::Sources::emission_from_radiosity).
    EmissionSource,
    /// [`Sources::response_basis`](crate::modular::dictionary::types::Sources::response_basis).
    ResponseSource,
}

impl OperatorKind {
    /// All kinds.
    pub const ALL: [OperatorKind; 11] = [
        OperatorKind::CoefficientsFromDirect,
        OperatorKind::JointBasis,
        OperatorKind::ProbeBasis,
        OperatorKind::VectorBasis,
        OperatorKind::ImplicitLighting,
        OperatorKind::Emission,
        OperatorKind::JointFromResponse,
        OperatorKind::Path,
        OperatorKind::Lightfield,
        OperatorKind::EmissionSource,
        OperatorKind::ResponseSource,
    ];

    /// A short name, for tables.
    pub const fn name(self) -> &'static str {
        match self {
            OperatorKind::CoefficientsFromDirect => "T_d->b",
            OperatorKind::JointBasis => "bases",
            OperatorKind::ProbeBasis => "probe bases",
            OperatorKind::VectorBasis => "vector bases",
            OperatorKind::ImplicitLighting => "L_imp",
            OperatorKind::Emission => "emission",
            OperatorKind::JointFromResponse => "responses",
            OperatorKind::Path => "paths",
            OperatorKind::Lightfield => "lightfields",
            OperatorKind::EmissionSource => "emission source",
            OperatorKind::ResponseSource => "response source",
        }
    }

    /// Which lines are modes and have a scale each: columns of bases, rows of operators that give coefficients. The
    /// emission of a shape counts as a basis. With one scale for each emission mode instead, errors of strong modes
    /// would reach the weak ones, whose light gets far: an error of light of 2.4 % instead of 0.05 %, in `int8`.
    pub const fn modes(self) -> ModeAxis {
        match self {
            OperatorKind::JointBasis
            | OperatorKind::ProbeBasis
            | OperatorKind::VectorBasis
            | OperatorKind::ImplicitLighting
            | OperatorKind::Emission
            | OperatorKind::ResponseSource => ModeAxis::Columns,
            _ => ModeAxis::Rows,
        }
    }

    /// The number format of matrices of this kind in a dictionary with format `storage`: the same, except that small
    /// kinds with large errors get a more exact one.
    ///
    /// It was chosen by the error of light: relative L2 of indirect irradiance over a level, the worst of four light
    /// sets on four levels (maze, corridor, cube, room) with one and with four bounces:
    ///
    /// | kind in this format, the rest `f32` | `f16`: mobile, standard | `int8`: mobile, standard | share of bytes |
    /// | --- | --- | --- | --- |
    /// | bases | 0.026 %, 0.024 % | 0.39 %, 0.45 % | 20 % |
    /// | `T_d->b` | 0.012 %, 0.003 % | 0.20 %, 0.13 % | 14 % |
    /// | responses | 0.021 %, 0.014 % | 0.17 %, 0.17 % | 3 % |
    /// | emission | 0.013 %, 0.003 % | 0.05 %, 0.12 % | 3 % |
    /// | paths | 0.004 %, 0.006 % | 0.09 %, 0.09 % | 14 % |
    /// | all | 0.034 %, 0.029 % | 0.50 %, 0.49 % | |
    ///
    /// The error of light should be at most 0.03 % with `f16` and 0.5 % with `int8`. Responses and emission have the
    /// fewest bytes for their error, so they are stored one step more exactly. So are lightfields in `f16`
    /// dictionaries, since they are multiplied once for each opening: with lightfields in `f16`, the error of the
    /// preset mobile is 0.03 %.
    pub const fn storage(self, storage: Storage) -> Storage {
        match (self, storage) {
            (
                OperatorKind::JointFromResponse | OperatorKind::Emission | OperatorKind::Lightfield,
                Storage::F16,
            ) => Storage::F32,
            (OperatorKind::JointFromResponse | OperatorKind::Emission, Storage::Int8) => {
                Storage::F16
            }
            _ => storage,
        }
    }
}
