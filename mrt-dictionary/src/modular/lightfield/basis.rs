//! The basis of the lightfields at openings (Loos et al. 2011, section 5.1).

use crate::modular::lightfield::grid::LightfieldGrid;
use crate::parallel_products::parallel_transpose_multiply;
use crate::progress::{Cancelled, Progress};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity_modes::{
    GramModes, ModeChoice, ParityBasis, ParityMode, combined_columns, gram_of_columns,
};
use rayon::prelude::*;

/// The reduced lightfield basis `H_rlf`: flux-weighted lightfields (samples x columns each) decomposed class by class,
/// keeping the largest `modes`. The parity of a mode has bit 0 set if it is odd in u, and bit 1 if it is odd in v.
///
/// Coefficients are of this orthonormal basis, where the paper scales it by singular values: a norm of a propagation
/// operator is then a gain of flux, and must not exceed one.
///
/// The columns are few and long, so they are decomposed through their scalar products ([`GramModes`]).
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn lightfield_basis(
    grid: &LightfieldGrid,
    columns: &[Matrix<f64>],
    modes: usize,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let classes = grid.parity_classes();
    let mut parts: Vec<(Matrix<f64>, GramModes)> = Vec::with_capacity(classes.class_count());
    for class in 0..classes.class_count() {
        progress.check()?;
        let folded: Vec<Vec<f64>> = columns
            .par_iter()
            .flat_map(|part| (0..part.columns()).into_par_iter().map(move |j| (part, j)))
            .map(|(part, j)| classes.fold(class, part.column(j)))
            .collect();
        let folded = Matrix::from_columns(classes.dimension(class), &folded);
        let modes = GramModes::of(&gram_of_columns(&folded));
        parts.push((folded, modes));
    }
    let values = parts.iter().map(|(_, part)| &part.singular_values[..]);
    let choice = ModeChoice::largest(values, modes);
    Ok(choice.basis(&classes, |ParityMode { class, position }| {
        let (folded, part) = &parts[class];
        let scale = part.singular_values[position];
        let weights = part.vectors.column(position).iter().map(|w| w / scale);
        combined_columns(folded, &weights.collect::<Vec<f64>>())
    }))
}

/// Coefficients, modes x signals, of lightfields (flux-weighted, samples x signals) in the basis.
pub fn lightfield_coefficients(basis: &ParityBasis, fields: &Matrix<f64>) -> Matrix<f64> {
    parallel_transpose_multiply(&basis.vectors, fields)
}
