//! What a matrix of a dictionary is: which operator, which lines of it are modes, and how it may be held.

use super::{
    Dictionary, LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators,
    Sources, Variant,
};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::storage::{ModeAxis, Storage, StoredMatrix};
use std::borrow::Cow;

/// A matrix of a dictionary, as `f32` or as a file stores it.
pub trait OperatorMatrix: Clone {
    /// Number of rows.
    fn rows(&self) -> usize;
    /// Number of columns.
    fn columns(&self) -> usize;
    /// Bytes that it takes, scales included.
    fn bytes(&self) -> usize;
    /// As `f32`; borrowed if it is that already.
    fn decode(&self) -> Cow<'_, Matrix<f32>>;
    /// As stored; `modes` is only asked of matrices that have no scales yet.
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
    /// [`ShapeOperators::coefficients_from_direct`].
    CoefficientsFromDirect,
    /// [`ShapeOperators::joint_basis`].
    JointBasis,
    /// [`ShapeOperators::probe_basis`].
    ProbeBasis,
    /// [`ShapeOperators::vector_basis`].
    VectorBasis,
    /// [`ShapeOperators::implicit_lighting`].
    ImplicitLighting,
    /// [`OpeningOperators::emission_from_coefficients`].
    Emission,
    /// [`OpeningOperators::joint_from_response`].
    JointFromResponse,
    /// [`PathEntry::response_from_emission`].
    Path,
    /// All of [`LightfieldOperators`].
    Lightfield,
    /// [`Sources::emission_from_radiosity`].
    EmissionSource,
    /// [`Sources::response_basis`].
    ResponseSource,
}

impl OperatorKind {
    /// All of them.
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

    /// For tables.
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

    /// Which lines share a scale: columns of bases, rows of operators that give coefficients. What a shape emits
    /// counts as a basis: scales an emission mode would let errors of the strong modes reach the weak ones, which are
    /// those that get far (2.4 % of the light against 0.05 %, in `int8`).
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

    /// How matrices of this kind are stored in a dictionary that is to be stored as `storage`: as it says, but for
    /// small kinds that are worth more bytes.
    ///
    /// Chosen by the error of light: relative L2 of indirect irradiance over a level, the worst of four light sets on
    /// four levels (maze, corridor, cube, room) with one and with four bounces:
    ///
    /// | stored so, the rest `f32` | `f16`: mobile, standard | `int8`: mobile, standard | share of bytes |
    /// | --- | --- | --- | --- |
    /// | bases | 0.026 %, 0.024 % | 0.39 %, 0.45 % | 20 % |
    /// | `T_d->b` | 0.012 %, 0.003 % | 0.20 %, 0.13 % | 14 % |
    /// | responses | 0.021 %, 0.014 % | 0.17 %, 0.17 % | 3 % |
    /// | emission | 0.013 %, 0.003 % | 0.05 %, 0.12 % | 3 % |
    /// | paths | 0.004 %, 0.006 % | 0.09 %, 0.09 % | 14 % |
    /// | all | 0.034 %, 0.029 % | 0.50 %, 0.49 % | |
    ///
    /// Light is to be within 0.03 % with `f16` and within 0.5 % with `int8`. Responses and emission cost the least for
    /// what they err, so they are stored one step more exactly. So are lightfields beside `f16`, since they are multiplied once an
    /// opening: with them at `f16` the preset mobile errs by 0.03 %.
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

/// Every matrix replaced by what `f` makes of it.
pub(super) fn map<'s, M, N>(
    dictionary: &'s Dictionary<M>,
    f: &mut impl FnMut(OperatorKind, &'s M) -> N,
) -> Dictionary<N> {
    let paths = &dictionary.paths;
    let lightfields = map_lightfields(&dictionary.lightfields, f);
    let entries = paths.entries.iter().map(|entry| PathEntry {
        word: entry.word.clone(),
        response_from_emission: f(OperatorKind::Path, &entry.response_from_emission),
    });
    let paths = PathTable {
        emission_parity: paths.emission_parity.clone(),
        response_parity: paths.response_parity.clone(),
        depth: paths.depth,
        hole_depth: paths.hole_depth,
        entries: entries.collect(),
        emission_dropped_energy: paths.emission_dropped_energy,
        response_dropped_energy: paths.response_dropped_energy,
    };
    let sources = dictionary.sources.as_ref().map(|sources| Sources {
        emission_from_radiosity: f(
            OperatorKind::EmissionSource,
            &sources.emission_from_radiosity,
        ),
        response_basis: f(OperatorKind::ResponseSource, &sources.response_basis),
    });
    let shapes = dictionary.shapes.iter().map(|entry| map_shape(entry, f));
    let shapes = shapes.collect();
    let variants = dictionary.variants.iter().map(|variant| Variant {
        transport: variant.transport,
        corners: variant.corners,
        operators: map_shape(&variant.operators, f),
    });
    Dictionary {
        preset: dictionary.preset.clone(),
        settings: dictionary.settings.clone(),
        resolution: dictionary.resolution,
        probes: dictionary.probes,
        shapes,
        lightfields,
        paths,
        variants: variants.collect(),
        sources,
    }
}

/// [`map`] of the lightfields alone.
pub(super) fn map_lightfields<'s, M, N>(
    fields: &'s LightfieldOperators<M>,
    f: &mut impl FnMut(OperatorKind, &'s M) -> N,
) -> LightfieldOperators<N> {
    let mut field = |matrix| f(OperatorKind::Lightfield, matrix);
    LightfieldOperators {
        parity: fields.parity.clone(),
        from_emission: field(&fields.from_emission),
        straight: field(&fields.straight),
        left: field(&fields.left),
        exchange: field(&fields.exchange),
        holes: fields.holes.iter().map(&mut field).collect(),
        response_from_lightfield: field(&fields.response_from_lightfield),
        dropped_energy: fields.dropped_energy,
    }
}

fn map_shape<'s, M, N>(
    entry: &'s ShapeOperators<M>,
    f: &mut impl FnMut(OperatorKind, &'s M) -> N,
) -> ShapeOperators<N> {
    let openings = entry.openings.iter().map(|opening| OpeningOperators {
        emission_from_coefficients: opening
            .emission_from_coefficients
            .iter()
            .map(|matrix| f(OperatorKind::Emission, matrix))
            .collect(),
        joint_from_response: opening
            .joint_from_response
            .iter()
            .map(|matrix| f(OperatorKind::JointFromResponse, matrix))
            .collect(),
    });
    let openings = openings.collect();
    ShapeOperators {
        shape: entry.shape,
        coefficients_from_direct: f(
            OperatorKind::CoefficientsFromDirect,
            &entry.coefficients_from_direct,
        ),
        joint_basis: f(OperatorKind::JointBasis, &entry.joint_basis),
        probe_basis: f(OperatorKind::ProbeBasis, &entry.probe_basis),
        vector_basis: f(OperatorKind::VectorBasis, &entry.vector_basis),
        openings,
        implicit_lighting: f(OperatorKind::ImplicitLighting, &entry.implicit_lighting),
        singular_values: entry.singular_values.clone(),
        dropped_energy: entry.dropped_energy,
        joint_dropped_energy: entry.joint_dropped_energy,
    }
}
