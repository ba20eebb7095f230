//! The light prior as a basis: decomposed samples of direct light (Loos et al. 2011, section 4) and their enrichment
//! (appendix A).

use crate::config::Enrichment;
use crate::matrix_parts::{root_sum_of_squares, scaled, side_by_side};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::ModeChoice;
use mrt_core::linalg::svd::{Svd, svd};

/// Columns `P S` (basis vectors of direct irradiance times their singular values), in the coordinates
/// of each parity class of the texels.
#[derive(Clone, Debug)]
pub struct ScaledBasis {
    /// One matrix a class: class dimension x vectors.
    pub classes: Vec<Matrix<f64>>,
}

/// A light prior with all its singular values.
#[derive(Clone, Debug)]
pub struct LightPrior {
    /// `P S`, cut to the configured number of vectors over all classes.
    pub basis: ScaledBasis,
    /// Singular values of the samples `L_d`, largest first.
    pub singular_values: Vec<f64>,
}

/// Texels of equally large walls, weighted by area.
#[derive(Clone, Copy, Debug)]
pub struct WeightedTexels<'a> {
    /// Their parity classes.
    pub classes: &'a ParityClasses,
    /// Root of each texel's area over the mean area.
    pub roots: &'a [f64],
    /// Number of walls, or of charts of a tube; all have equally many texels.
    pub wall_count: usize,
}

/// Decomposes samples of direct light (texels x lights) and keeps the `k_d` largest vectors, without cutting a multiplet.
pub fn light_prior(samples: &Matrix<f64>, classes: &ParityClasses, k_d: usize) -> LightPrior {
    decompose(&fold_all(classes, samples), k_d)
}

/// Appendix A: the prior, functions that are constant on one wall, and the indirect light basis `U_b` (texels x modes),
/// each scaled to its weight in Frobenius norm, put side by side and decomposed again.
///
/// The first keeps what the prior had. The second follows shadows and differing albedos. The third is what
/// indirect light looks like when it becomes the direct light of the next bounce. To the paper's three we
/// add uniform light with a large weight, so that the bases hold it exactly: many bounces tend to it, and an error in it
/// is an error in the level's energy.
///
/// Prior and indirect basis are weighted by the roots of `texels`.
pub fn enriched_prior(
    prior: &LightPrior,
    indirect_basis: &Matrix<f64>,
    texels: &WeightedTexels,
    config: &Enrichment,
) -> LightPrior {
    let WeightedTexels {
        classes,
        roots,
        wall_count,
    } = *texels;
    let per_wall = classes.point_count() / wall_count.max(1);
    let constants = Matrix::from_fn(classes.point_count(), wall_count, |texel, wall| {
        if texel / per_wall == wall {
            roots[texel]
        } else {
            0.0
        }
    });
    let uniform = Matrix::from_fn(classes.point_count(), 1, |texel, _| roots[texel]);
    let parts: Vec<Vec<Matrix<f64>>> = [
        (1.0, prior.basis.classes.clone()),
        (config.uniform_weight, fold_all(classes, &uniform)),
        (config.constant_weight, fold_all(classes, &constants)),
        (config.indirect_weight, fold_all(classes, indirect_basis)),
    ]
    .into_iter()
    .map(|(weight, part)| {
        let norm = root_sum_of_squares(part.iter().map(Matrix::frobenius_norm));
        part.iter().map(|m| scaled(m, weight / norm)).collect()
    })
    .collect();
    let joined: Vec<Matrix<f64>> = (0..classes.class_count())
        .map(|class| {
            let of_class: Vec<&Matrix<f64>> = parts.iter().map(|part| &part[class]).collect();
            side_by_side(&of_class)
        })
        .collect();
    decompose(&joined, usize::MAX)
}

/// Signals in the coordinates of each parity class.
pub(crate) fn fold_all(classes: &ParityClasses, signals: &Matrix<f64>) -> Vec<Matrix<f64>> {
    (0..classes.class_count())
        .map(|class| classes.fold_columns(class, signals))
        .collect()
}

/// Left singular vectors times singular values, class by class, keeping the `keep` largest over all classes.
fn decompose(folded: &[Matrix<f64>], keep: usize) -> LightPrior {
    let parts: Vec<Svd> = folded.iter().map(|m| svd(m.view())).collect();
    let values = parts.iter().map(|part| &part.singular_values[..]);
    let choice = ModeChoice::largest(values, keep);
    let classes = parts
        .iter()
        .enumerate()
        .map(|(class, part)| {
            let count = choice.count_of_class(class);
            let scales = &part.singular_values[..count];
            part.u.leading_columns(count).scaled_columns(scales)
        })
        .collect();
    LightPrior {
        basis: ScaledBasis { classes },
        singular_values: choice.singular_values,
    }
}
