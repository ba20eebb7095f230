//! What shapes send through their openings, reduced: one basis for all of them.
//!
//! Light that leaves through an opening is the radiosity of the walls behind it, so the paths of a table start
//! from a basis for radiosity on the walls of [`EMITTER`]. A texel counts with its form factor to the opening: in
//! that norm the scalar product of two signals is that of the lightfields that they send (the paper reduces the
//! lightfields themselves, section 5.1).

use crate::modular::one_bounce::cube::wall_fraction;
use crate::modular::paths::transport::{EMITTER, texel_at};
use crate::modular::surface::mirrors::texel_parity_classes;
use crate::modular::transport::modes::whole_multiplets;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::linalg::svd::{dropped_energy_beyond_first, largest_entry_sign, symmetric_eigen};
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::modular::path::frame_of_heading;

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

/// Radiosity of a shape's walls (texels x signals) as that of the emitter behind one of its openings, in the frame
/// of its heading or in that with x and y exchanged.
pub fn emitter_radiosity(
    shape: &Shape,
    opening: Face,
    is_exchanged: bool,
    radiosity: &Matrix<f64>,
    resolution: usize,
) -> Matrix<f64> {
    let frame = opening_frame(opening, is_exchanged);
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

/// From the canonical frame of a path to a shape's, through an opening that light leaves by.
pub fn opening_frame(opening: Face, is_exchanged: bool) -> CubeSymmetry {
    let frame = frame_of_heading(opening);
    if is_exchanged {
        frame.after(CubeSymmetry::exchange(0, 1))
    } else {
        frame
    }
}

/// Reduces what shapes send: radiosities of the emitter, texels x signals, of equal importance.
pub fn emission_basis(sent: &[Matrix<f64>], resolution: usize, modes: usize) -> EmissionBasis {
    let classes = texel_parity_classes(&EMITTER, resolution);
    let root_weights: Vec<f64> = EMITTER
        .texels(resolution)
        .map(|(face, center)| opening_factor(face, center).sqrt())
        .collect();
    let mut found: Vec<(f64, usize, Vec<f64>)> = Vec::new();
    for class in 0..classes.class_count() {
        let mut gram = Matrix::zeros(classes.dimension(class), classes.dimension(class));
        for signals in sent {
            let weighted = scaled_rows(signals, &root_weights);
            let folded = classes.fold_columns(class, &weighted);
            add_gram(&mut gram, &folded);
        }
        let (values, vectors) = symmetric_eigen(gram.view());
        let largest = values.first().copied().unwrap_or(0.0);
        for (k, &value) in values.iter().enumerate() {
            if value > GRAM_FLOOR * largest && value > 0.0 {
                found.push((value.sqrt(), class, vectors.column(k).to_vec()));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let scales: Vec<f64> = found.iter().map(|mode| mode.0).collect();
    let kept = whole_multiplets(&scales, modes);
    let columns: Vec<Vec<f64>> = found[..kept]
        .iter()
        .map(|(_, class, vector)| {
            let sign = largest_entry_sign(vector);
            let vector: Vec<f64> = vector.iter().map(|x| sign * x).collect();
            classes.unfold(*class, &vector)
        })
        .collect();
    let basis = Matrix::from_columns(root_weights.len(), &columns);
    let inverse: Vec<f64> = root_weights.iter().map(|w| 1.0 / w).collect();
    EmissionBasis {
        from_radiosity: scaled_rows(&basis, &root_weights).transposed(),
        radiosity: scaled_rows(&basis, &inverse),
        parity: found[..kept].iter().map(|mode| mode.1 as u8).collect(),
        dropped_energy: dropped_energy_beyond_first(&scales, kept),
        scales: scales[..kept].to_vec(),
    }
}

/// Eigenvalues of scalar products below this fraction of the largest are rounding: modes below 1e-6.
pub(crate) const GRAM_FLOOR: f64 = 1e-12;

/// `gram += columns columnsᵀ`
pub(crate) fn add_gram(gram: &mut Matrix<f64>, columns: &Matrix<f64>) {
    let product = multiply(columns.view(), columns.transposed().view());
    for (sum, &x) in gram.data_mut().iter_mut().zip(product.data()) {
        *sum += x;
    }
}

/// Every row times its scale.
pub(crate) fn scaled_rows(matrix: &Matrix<f64>, scales: &[f64]) -> Matrix<f64> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| {
        scales[i] * matrix[(i, j)]
    })
}

/// Form factor from a texel of the emitter to its opening.
fn opening_factor(face: Face, center: DVec3) -> f64 {
    let opening = Face::PosZ.rectangle([0.0, 1.0], [0.0, 1.0]);
    point_to_polygon(center, -face.outward(), &opening)
}
