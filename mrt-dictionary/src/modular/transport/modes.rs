//! Reduced direct-to-indirect transfer inside one shape (Loos et al. 2011, section 4.1).
//!
//! With `M = F P S = U_m S_m V_mᵀ` there are the indirect basis `U_b = U_m S_m`, the implicit lighting
//! `L_imp = P S V_m` whose indirect light it is (`U_b = F L_imp`), and the operator that gives the
//! coefficients. For the last we depart from the paper's `V_mᵀ S⁻¹ Pᵀ` and take `S_m⁻¹ U_mᵀ F`. It has
//! the same size, it is the orthogonal projection of the true indirect light on the basis for any direct
//! light, and it needs no inverse of S, whose condition reaches 1e11.
//!
//! Other outputs that a level wants are stacked below F: light at probes, and light on the walls beyond the
//! openings. Coefficients are then chosen for those too ([`crate::modular::transport::cube`]).

use crate::modular::light_prior::basis::ScaledBasis;
use mrt_core::linalg::matrix::{Matrix, multiply, transpose_multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{ModeChoice, ParityMode};
use mrt_core::linalg::svd::{Svd, svd};

/// The reduced operators of one shape, in texel space.
#[derive(Clone, Debug)]
pub struct BlockTransport {
    /// `U_b`, texels x modes: indirect irradiance of each mode.
    pub indirect_basis: Matrix<f64>,
    /// `T_d->b`, modes x texels.
    pub coefficients_from_direct: Matrix<f64>,
    /// `L_imp`, texels x modes: radiosity that produces the columns of the basis.
    pub implicit_lighting: Matrix<f64>,
    /// All singular values of M, largest first; the first `modes` belong to the columns.
    pub singular_values: Vec<f64>,
    /// Fraction that the modes left out hold of M's energy beyond its first mode, which is uniform light.
    pub dropped_energy: f64,
}

impl BlockTransport {
    /// The operators of a shape without walls.
    pub fn empty() -> Self {
        Self {
            indirect_basis: Matrix::zeros(0, 0),
            coefficients_from_direct: Matrix::zeros(0, 0),
            implicit_lighting: Matrix::zeros(0, 0),
            singular_values: Vec::new(),
            dropped_energy: 0.0,
        }
    }
}

/// F in the coordinates of each parity class. F respects the mirrors, so nothing is lost.
pub fn fold_bounce(bounce: &Matrix<f64>, classes: &ParityClasses) -> Vec<Matrix<f64>> {
    fold_operator(bounce, classes, classes)
}

/// An operator that respects the mirrors, from signals on one point set to signals on another, in the coordinates
/// of each parity class.
pub fn fold_operator(
    operator: &Matrix<f64>,
    outputs: &ParityClasses,
    inputs: &ParityClasses,
) -> Vec<Matrix<f64>> {
    (0..inputs.class_count())
        .map(|class| outputs.fold_columns(class, &applied_to_class(operator, inputs, class, 1.0)))
        .collect()
}

/// What an operator (rows x points) makes of the unit signals of a parity class, times `scale`: rows x class dimension.
///
/// Its rows need no parity: the signals of the class have one.
pub(crate) fn applied_to_class(
    operator: &Matrix<f64>,
    classes: &ParityClasses,
    class: usize,
    scale: f64,
) -> Matrix<f64> {
    let dimension = classes.dimension(class);
    let columns: Vec<Vec<f64>> = (0..dimension)
        .map(|k| {
            let mut unit = vec![0.0; dimension];
            unit[k] = scale;
            multiply_sparse(operator, &classes.unfold(class, &unit))
        })
        .collect();
    Matrix::from_columns(operator.rows(), &columns)
}

/// Product with a vector that is zero nearly everywhere.
fn multiply_sparse(a: &Matrix<f64>, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.rows()];
    for (j, &weight) in x.iter().enumerate().filter(|&(_, &weight)| weight != 0.0) {
        for (o, &value) in out.iter_mut().zip(a.column(j)) {
            *o += value * weight;
        }
    }
    out
}

/// Computes the operators from a prior, keeping at most `modes` modes (fewer where a multiplet would be
/// cut).
///
/// `folded_outputs` has, by class, everything that radiosity does and that coefficients must be good for: the
/// bounce itself and, where a level asks for more, the light at probes and beyond openings stacked below it.
/// Coefficients are the orthogonal projection of all of them.
pub fn block_transport(
    folded_outputs: &[Matrix<f64>],
    folded_bounce: &[Matrix<f64>],
    prior: &ScaledBasis,
    classes: &ParityClasses,
    modes: usize,
) -> BlockTransport {
    let parts: Vec<Svd> = folded_outputs
        .iter()
        .zip(&prior.classes)
        .map(|(outputs, basis)| svd(multiply(outputs.view(), basis.view()).view()))
        .collect();
    let values = parts.iter().map(|part| &part.singular_values[..]);
    let choice = ModeChoice::largest(values, modes);
    let kept = choice.kept.len();
    let mut indirect_columns = Vec::with_capacity(kept);
    let mut implicit_columns = Vec::with_capacity(kept);
    let mut coefficient_rows = Vec::with_capacity(kept);
    for &ParityMode { class, position } in &choice.kept {
        let part = &parts[class];
        let sigma = part.singular_values[position];
        let u = part.u.columns_view(position..position + 1);
        let v = part.v.columns_view(position..position + 1);
        let implicit = multiply(prior.classes[class].view(), v);
        implicit_columns.push(classes.unfold(class, implicit.data()));
        let indirect = multiply(folded_bounce[class].view(), implicit.view());
        indirect_columns.push(classes.unfold(class, indirect.data()));
        let row = transpose_multiply(folded_outputs[class].view(), u);
        let row: Vec<f64> = row.data().iter().map(|x| x / sigma).collect();
        coefficient_rows.push(classes.unfold(class, &row));
    }
    let texels = classes.point_count();
    BlockTransport {
        indirect_basis: Matrix::from_columns(texels, &indirect_columns),
        coefficients_from_direct: Matrix::from_columns(texels, &coefficient_rows).transposed(),
        implicit_lighting: Matrix::from_columns(texels, &implicit_columns),
        dropped_energy: choice.dropped_energy(),
        singular_values: choice.singular_values,
    }
}
