//! The parts of a dictionary: plain data.

use crate::level::shape::Shape;
use crate::level::warp_form::WarpForm;
use crate::level::warp_transport::WarpTransport;
use crate::modular::path::Word;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::storage::StoredMatrix;

/// A dictionary whose matrices are as a file stores them, and borrow the bytes of the file where their alignment
/// allows.
pub type StoredDictionary<'a> = Dictionary<StoredMatrix<'a>>;

/// Baked operators of a set of shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct Dictionary<M = Matrix<f32>> {
    /// Name of the preset of the bake.
    pub preset: String,
    /// Settings of the bake, as text for people.
    pub settings: String,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Probes along an edge of a block; 0 without probes.
    pub probes: usize,
    /// One entry for each shape; no shape is there twice.
    pub shapes: Vec<ShapeOperators<M>>,
    /// Operators that pass lightfields from opening to opening.
    pub lightfields: LightfieldOperators<M>,
    /// Operators of whole paths of openings.
    pub paths: PathTable<M>,
    /// Operators for blocks that are warped too far for canonical operators; made for a level.
    pub variants: Vec<Variant<M>>,
    /// Bases for making variants; `None` in packed dictionaries.
    pub sources: Option<Sources<M>>,
}

/// Operators of a shape for one warp of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant<M = Matrix<f32>> {
    /// How the operators were made.
    pub transport: WarpTransport,
    /// The form that the operators were made for ([`form_of`](crate::level::warp_form::form_of)). Blocks of the same
    /// form share a variant at every place, in every size and in every orientation. Probes have the axes of the
    /// canonical cube, whatever the warp.
    pub corners: WarpForm,
    /// The operators. Emission and response modes are those of the dictionary.
    pub operators: ShapeOperators<M>,
}

/// Operators of one shape. In sizes, "texels" means the number of texels of the shape's walls ([`Shape::texels`]).
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeOperators<M = Matrix<f32>> {
    /// The shape.
    pub shape: &'static Shape,
    /// `T_d->b`, modes x texels: coefficients b from outgoing radiosity.
    pub coefficients_from_direct: M,
    /// The joint basis, texels x joint modes: indirect irradiance from joint coefficients. Its first columns are `U_b`,
    /// one for each coefficient b; the other columns are further modes for light from other blocks.
    pub joint_basis: M,
    /// The joint basis of probes, 9 probes³ x joint modes: for each probe, nine SH coefficients of incident radiance;
    /// probes with x fastest, then y, then z.
    pub probe_basis: M,
    /// The joint basis of vector irradiance, 4 texels x joint modes: for each texel, four OHLSH coefficients. No rows
    /// in dictionaries without vector irradiance.
    pub vector_basis: M,
    /// Operators of each opening, in the order of [`Shape::openings`].
    pub openings: Vec<OpeningOperators<M>>,
    /// `L_imp`, texels x modes: for each mode, the radiosity whose indirect light is the column of `U_b`. No rows in
    /// packed dictionaries.
    pub implicit_lighting: M,
    /// Singular values of the modes, largest first.
    pub singular_values: Vec<f32>,
    /// Fraction of the energy of M that the modes drop. The first mode does not count: it is uniform light, and
    /// enrichment sets its size.
    pub dropped_energy: f32,
    /// Fraction of the energy of light from other blocks that the joint basis drops.
    pub joint_dropped_energy: f32,
}

/// Operators of one opening of a shape, in the frame of [`frame_of_heading`](crate::modular::path::frame_of_heading). A
/// second element is the same operator in the frame with x and y exchanged; sets without vertical openings have only
/// the first.
#[derive(Clone, Debug, PartialEq)]
pub struct OpeningOperators<M = Matrix<f32>> {
    /// Emission modes x modes: light that leaves through the opening.
    pub emission_from_coefficients: Vec<M>,
    /// Joint modes x response modes: light in the block from light that enters by the opening.
    pub joint_from_response: Vec<M>,
}

/// Operators in the reduced lightfield basis of the canonical interface: the face z = 0, crossed towards +z.
#[derive(Clone, Debug, PartialEq)]
pub struct LightfieldOperators<M = Matrix<f32>> {
    /// Parity of each mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub parity: Vec<u8>,
    /// Lightfield modes x emission modes: the lightfield of light that leaves a shape. Its product with
    /// [`OpeningOperators::emission_from_coefficients`] is the paper's `R_b->rlf`.
    pub from_emission: M,
    /// Modes x modes: the lightfield at the opening straight ahead.
    pub straight: M,
    /// Modes x modes: the lightfield at the opening on the left (towards +x). The one on the right follows by a mirror.
    pub left: M,
    /// Modes x modes: the same lightfield with x and y exchanged. No rows in sets without vertical openings.
    pub exchange: M,
    /// Modes x modes for each of [`Hole::ALL`](crate::level::shape::Hole::ALL): the lightfield that passes the hole.
    /// Empty in sets without holes.
    pub holes: Vec<M>,
    /// `T_rlf->r`, response modes x lightfield modes.
    pub response_from_lightfield: M,
    /// Fraction of the energy of emitted and propagated lightfields that the modes drop. The first mode does not count.
    pub dropped_energy: f32,
}

/// One operator for each canonical path of openings.
#[derive(Clone, Debug, PartialEq)]
pub struct PathTable<M = Matrix<f32>> {
    /// Parity of each emission mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub emission_parity: Vec<u8>,
    /// Parity of each response mode, with the same bits.
    pub response_parity: Vec<u8>,
    /// Number of crossings of the longest words without a hole in the baked table.
    pub depth: usize,
    /// Number of crossings of the longest words with a hole in the baked table.
    pub hole_depth: usize,
    /// Entries in ascending order of words, each word once. Packed dictionaries lack the words that their level does
    /// not use.
    pub entries: Vec<PathEntry<M>>,
    /// Fraction of the energy of light that shapes send through their openings that the emission modes drop.
    pub emission_dropped_energy: f32,
    /// Fraction of the energy of light that arrives that the response modes drop.
    pub response_dropped_energy: f32,
}

/// The operator of one path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathEntry<M = Matrix<f32>> {
    /// The path.
    pub word: Word,
    /// Response modes x emission modes.
    pub response_from_emission: M,
}

/// Bases in texel space, for tools that make variants.
#[derive(Clone, Debug, PartialEq)]
pub struct Sources<M = Matrix<f32>> {
    /// Emission modes x texels of the canonical emitter (the cube that is open at +z): emission coefficients from
    /// radiosity.
    pub emission_from_radiosity: M,
    /// Response modes in columns. Rows are the texels of the canonical receiver (the cube that is open at -z), then
    /// nine SH coefficients for each of its probes.
    pub response_basis: M,
}
