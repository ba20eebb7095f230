//! What shapes send through their openings, reduced: one basis for all of them.
//!
//! Light that leaves through an opening is the radiosity of the walls behind it, so the paths of a table start
//! from a basis for radiosity on the walls of [`EMITTER`]. A texel counts with its form factor to the opening. In
//! that norm two signals have the scalar product of the lightfields that they send. (The paper reduces the
//! lightfields themselves, section 5.1.)

use crate::matrix_parts::scaled_rows;
use crate::modular::paths::ends::{EMITTER, PathFrame};
use crate::modular::surface::mirrors::cube::texel_parity_classes;
use crate::modular::surface::walls::cube::{texel_at, wall_fraction};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity_modes::{GramModes, ModeChoice, add_gram_of_rows};
use mrt_runtime::blocks::Shape;

/// The emission basis.
#[derive(Clone, Debug)]
pub struct EmissionBasis {
    /// Modes x texels of the emitter: coefficients from radiosity.
    pub from_radiosity: Matrix<f64>,
    /// Texels of the emitter x modes: the radiosity of each mode.
    pub radiosity: Matrix<f64>,
    /// Singular value of each mode.
    pub scales: Vec<f64>,
    /// Parity of each mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub parity: Vec<u8>,
    /// Fraction that the modes left out hold of what shapes send, beyond the first mode.
    pub dropped_energy: f64,
}

/// Radiosity of a shape's walls (texels x signals) carried over to the texels of [`EMITTER`], which takes the place of the
/// shape behind one of its openings, in one of the frames there. Holes take away their part of a texel.
pub fn emitter_radiosity(
    shape: &Shape,
    opening: Face,
    frame: PathFrame,
    radiosity: &Matrix<f64>,
    resolution: usize,
) -> Matrix<f64> {
    let frame = frame.of_heading(opening);
    let rows: Vec<Option<(usize, f64)>> = EMITTER
        .texels(resolution)
        .map(|(face, center)| {
            let (face, center) = (frame.face(face), frame.point(center));
            let texel = texel_at(shape, face, center, resolution)?;
            Some((texel, wall_fraction(shape, face, center, resolution)))
        })
        .collect();
    Matrix::from_fn(rows.len(), radiosity.columns(), |i, j| {
        rows[i].map_or(0.0, |(texel, fraction)| fraction * radiosity[(texel, j)])
    })
}

/// Reduces what shapes send: radiosities of the emitter, texels x signals, which all count alike.
pub fn emission_basis(sent: &[Matrix<f64>], resolution: usize, modes: usize) -> EmissionBasis {
    let classes = texel_parity_classes(&EMITTER, resolution);
    let root_weights: Vec<f64> = EMITTER
        .texels(resolution)
        .map(|(face, center)| opening_factor(face, center).sqrt())
        .collect();
    let parts: Vec<GramModes> = (0..classes.class_count())
        .map(|class| {
            let mut gram = Matrix::zeros(classes.dimension(class), classes.dimension(class));
            for signals in sent {
                let weighted = scaled_rows(signals, &root_weights);
                add_gram_of_rows(&mut gram, &classes.fold_columns(class, &weighted));
            }
            GramModes::of(&gram)
        })
        .collect();
    let values = parts.iter().map(|part| &part.singular_values[..]);
    let basis = ModeChoice::largest(values, modes).basis(&classes, |mode| {
        parts[mode.class].vectors.column(mode.position).to_vec()
    });
    let inverse: Vec<f64> = root_weights.iter().map(|w| 1.0 / w).collect();
    EmissionBasis {
        from_radiosity: scaled_rows(&basis.vectors, &root_weights).transposed(),
        radiosity: scaled_rows(&basis.vectors, &inverse),
        parity: basis.parity,
        dropped_energy: basis.dropped_energy,
        scales: basis.scales,
    }
}

/// Form factor from a texel of the emitter to its opening.
fn opening_factor(face: Face, center: DVec3) -> f64 {
    let opening = Face::PosZ.rectangle([0.0, 1.0], [0.0, 1.0]);
    point_to_polygon(center, -face.outward(), &opening)
}
