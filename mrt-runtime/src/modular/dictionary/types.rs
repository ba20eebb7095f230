//! The parts of a dictionary, plain data.

use crate::level::shape::Shape;
use crate::level::warp_form::WarpForm;
use crate::level::warp_transport::WarpTransport;
use crate::modular::path::Word;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::storage::StoredMatrix;

/// A dictionary whose matrices are as a file stores them, borrowed from its bytes where those allow.
pub type StoredDictionary<'a> = Dictionary<StoredMatrix<'a>>;

/// Baked operators of a set of shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct Dictionary<M = Matrix<f32>> {
    /// Name of the preset that it was baked with.
    pub preset: String,
    /// Settings of the bake, as text for people.
    pub settings: String,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Probes along an edge of a block; 0 if it was baked without.
    pub probes: usize,
    /// One entry a shape; no shape twice.
    pub shapes: Vec<ShapeOperators<M>>,
    /// How lightfields pass from opening to opening.
    pub lightfields: LightfieldOperators<M>,
    /// How light passes along whole paths of openings.
    pub paths: PathTable<M>,
    /// Operators for blocks that are warped too far for the canonical ones; made for a level.
    pub variants: Vec<Variant<M>>,
    /// What re-gathering and rebuilding warped shapes needs; `None` in packed dictionaries.
    pub sources: Option<Sources<M>>,
}

/// Operators of a shape for one warp of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant<M = Matrix<f32>> {
    /// How they were made.
    pub transport: WarpTransport,
    /// Corners of the warp from the canonical cube, turned back by the block's orientation, less the first corner,
    /// over the length of the diagonal of their bounds ([`form_of`](crate::level::warp_form::form_of)): blocks of the same form
    /// share a variant wherever they stand, however large they are and whichever way they are turned. Probes have
    /// their axes: those of the canonical cube, whatever the warp does.
    pub corners: WarpForm,
    /// The operators; emission and response modes are those of the dictionary.
    pub operators: ShapeOperators<M>,
}

/// Operators of one shape; "texels" counts those of the shape's walls ([`Shape::texels`]).
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeOperators<M = Matrix<f32>> {
    /// The shape.
    pub shape: &'static Shape,
    /// `T_d->b`, modes x texels: coefficients from outgoing radiosity.
    pub coefficients_from_direct: M,
    /// The joint basis, texels x joint modes: indirect irradiance from joint coefficients. Its first columns
    /// are `U_b`, one a coefficient b; the others hold what light from other blocks adds.
    pub joint_basis: M,
    /// The same for probes, 9 probes³ x joint modes: nine SH coefficients of incident radiance a probe,
    /// probes with x fastest, then y, then z.
    pub probe_basis: M,
    /// The same for vector irradiance, 4 texels x joint modes (four OHLSH coefficients, texel by texel), or no
    /// rows if it was baked without.
    pub vector_basis: M,
    /// In the order of [`Shape::openings`].
    pub openings: Vec<OpeningOperators<M>>,
    /// `L_imp`, texels x modes: radiosity whose indirect light `U_b` is; no rows in packed dictionaries.
    pub implicit_lighting: M,
    /// Singular values of the modes, largest first.
    pub singular_values: Vec<f32>,
    /// Fraction that the modes left out hold of M's energy beyond its first mode (uniform light, whose size
    /// the enrichment sets).
    pub dropped_energy: f32,
    /// Fraction that the joint basis leaves out of the light that comes from other blocks.
    pub joint_dropped_energy: f32,
}

/// Operators of one opening of a shape, in the frame of
/// [`frame_of_heading`](crate::modular::path::frame_of_heading). Lists of two hold the same in the frame with x and y
/// exchanged; sets without vertical openings need one.
#[derive(Clone, Debug, PartialEq)]
pub struct OpeningOperators<M = Matrix<f32>> {
    /// Emission modes x modes: what leaves.
    pub emission_from_coefficients: Vec<M>,
    /// Joint modes x response modes: what light that enters becomes.
    pub joint_from_response: Vec<M>,
}

/// Operators of the canonical interface, the face z = 0 crossed towards +z, in the reduced lightfield basis.
#[derive(Clone, Debug, PartialEq)]
pub struct LightfieldOperators<M = Matrix<f32>> {
    /// Parity of each mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub parity: Vec<u8>,
    /// Lightfield modes x emission modes: the lightfield of what leaves a shape. With
    /// [`OpeningOperators::emission_from_coefficients`] it makes the paper's `R_b->rlf`.
    pub from_emission: M,
    /// At the opening straight ahead from the one entered: modes x modes.
    pub straight: M,
    /// At the opening on the left (towards +x); the one on the right follows by the mirror.
    pub left: M,
    /// The same lightfield with x and y exchanged, modes x modes; no rows in sets without vertical openings.
    pub exchange: M,
    /// What passes each of [`Hole::ALL`](crate::level::shape::Hole::ALL), modes x modes; empty in sets without holes.
    pub holes: Vec<M>,
    /// `T_rlf->r`, response modes x lightfield modes.
    pub response_from_lightfield: M,
    /// Fraction that the modes left out hold of the emitted and propagated lightfields' energy beyond their
    /// first mode.
    pub dropped_energy: f32,
}

/// One operator for each canonical path of openings.
#[derive(Clone, Debug, PartialEq)]
pub struct PathTable<M = Matrix<f32>> {
    /// Parity of each emission mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub emission_parity: Vec<u8>,
    /// The same of each response mode.
    pub response_parity: Vec<u8>,
    /// Crossings of the longest words of the whole table.
    pub depth: usize,
    /// The same of words with a hole.
    pub hole_depth: usize,
    /// In ascending order of words, each once. Packed dictionaries lack words of up to those lengths that no level
    /// of theirs has.
    pub entries: Vec<PathEntry<M>>,
    /// Fraction that the emission modes leave out of what shapes send through their openings.
    pub emission_dropped_energy: f32,
    /// Fraction that the response modes leave out of what arrives.
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

/// Bases in texel space that only tools need.
#[derive(Clone, Debug, PartialEq)]
pub struct Sources<M = Matrix<f32>> {
    /// Emission modes x texels of the canonical emitter (the cube open at +z): emission coefficients from
    /// radiosity.
    pub emission_from_radiosity: M,
    /// Texels of the canonical receiver (the cube open at -z), then nine SH coefficients for each of its probes,
    /// x response modes.
    pub response_basis: M,
}
