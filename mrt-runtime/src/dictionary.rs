//! The dictionary as a running game holds it: the operators of the canonical shapes, in `f32`.

use crate::shape::Shape;
use mrt_core::matrix::Matrix;

/// Baked operators of a set of shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct Dictionary {
    /// Name of the preset that it was baked with.
    pub preset: String,
    /// Settings of the bake, as text for people.
    pub settings: String,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// One entry a shape; no shape twice.
    pub shapes: Vec<ShapeOperators>,
    /// Operators of the interface that all shapes share.
    pub interface: InterfaceOperators,
}

/// Operators of one shape; "texels" counts those of the shape's walls ([`Shape::texels`]).
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeOperators {
    /// The shape.
    pub shape: &'static Shape,
    /// `T_d->b`, modes x texels: coefficients from outgoing radiosity.
    pub coefficients_from_direct: Matrix<f32>,
    /// `U_b`, texels x modes: indirect irradiance from coefficients.
    pub indirect_basis: Matrix<f32>,
    /// `L_imp`, texels x modes: radiosity whose indirect light the basis is.
    pub implicit_lighting: Matrix<f32>,
    /// `R_b->rlf`, lightfield modes x modes, for each opening in the order of [`Shape::openings`].
    pub lightfield_from_coefficients: Vec<Matrix<f32>>,
    /// Singular values of the modes, largest first.
    pub singular_values: Vec<f32>,
    /// Fraction that the modes left out hold of M's energy beyond its first mode (uniform light, whose size
    /// the enrichment sets).
    pub dropped_energy: f32,
}

/// Operators of the canonical interface: the face z = 0 crossed towards +z.
#[derive(Clone, Debug, PartialEq)]
pub struct InterfaceOperators {
    /// Lightfield at the opening straight ahead from the one entered: modes x modes.
    pub straight: Matrix<f32>,
    /// At the opening on the left (towards +x).
    pub left: Matrix<f32>,
    /// At the opening on the right (towards -x).
    pub right: Matrix<f32>,
    /// `T_rlf->r`, response modes x lightfield modes.
    pub response_from_lightfield: Matrix<f32>,
    /// `U_r`, texels x response modes, on the five walls of the cube open at -z.
    pub response_basis: Matrix<f32>,
    /// Fraction that the modes left out hold of the emitted and propagated lightfields' energy beyond their
    /// first mode.
    pub lightfield_dropped_energy: f32,
    /// Fraction that the modes left out hold of the response's energy beyond its first mode.
    pub response_dropped_energy: f32,
}

impl Dictionary {
    /// Position in [`Dictionary::shapes`] of a shape, if it is there.
    pub fn shape_index(&self, shape: &Shape) -> Option<usize> {
        self.shapes.iter().position(|entry| entry.shape == shape)
    }

    /// Bytes of all matrices.
    pub fn bytes(&self) -> usize {
        let interface = &self.interface;
        let shared = [
            &interface.straight,
            &interface.left,
            &interface.right,
            &interface.response_from_lightfield,
            &interface.response_basis,
        ];
        let shared: usize = shared.into_iter().map(matrix_bytes).sum();
        shared + self.shapes.iter().map(ShapeOperators::bytes).sum::<usize>()
    }
}

fn matrix_bytes(matrix: &Matrix<f32>) -> usize {
    std::mem::size_of_val(matrix.data())
}

impl ShapeOperators {
    /// Number of modes `k_b`.
    pub fn modes(&self) -> usize {
        self.indirect_basis.columns()
    }

    /// Bytes of this shape's matrices.
    pub fn bytes(&self) -> usize {
        [
            &self.coefficients_from_direct,
            &self.indirect_basis,
            &self.implicit_lighting,
        ]
        .into_iter()
        .chain(&self.lightfield_from_coefficients)
        .map(matrix_bytes)
        .sum()
    }
}
