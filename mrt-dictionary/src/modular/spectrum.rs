//! How fast singular values fall: the paper's table 2, on the closed cube.

use crate::config::PriorConfig;
use crate::modular::light_prior::basis::light_prior;
use crate::modular::light_prior::cube::direct_samples;
use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
use crate::modular::surface::mirrors::cube::texel_parity_classes;
use crate::modular::transport::modes::{block_transport, fold_bounce};
use crate::progress::{Cancelled, Progress};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity_modes::ModeChoice;
use mrt_core::linalg::svd::{Svd, energy_rank, svd};
use mrt_runtime::blocks::SHAPES;

/// `k_d` of the paper's table.
const TABLE_PRIOR_VECTORS: usize = 64;

/// Singular values of one matrix.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Name of the matrix.
    pub matrix: &'static str,
    /// Rows and columns.
    pub size: [usize; 2],
    /// Singular values, largest first.
    pub singular_values: Vec<f64>,
}

impl Spectrum {
    /// Number of singular values whose squares hold at least `fraction` of the sum of squares.
    pub fn energy_rank(&self, fraction: f64) -> usize {
        energy_rank(&self.singular_values, fraction)
    }
}

/// Spectra of F with constant and with bilinear texels, of the prior's samples L_d (6³ lights), and of
/// M = F P S with 64 prior vectors, without enrichment.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn closed_cube_spectra(
    resolution: usize,
    progress: &Progress,
) -> Result<Vec<Spectrum>, Cancelled> {
    let shape = &SHAPES[0];
    let classes = texel_parity_classes(shape, resolution);
    let texels = classes.point_count();
    let fold = |reconstruction| {
        let bounce = closed_cube_bounce(resolution, reconstruction, progress)?;
        Ok::<_, Cancelled>(fold_bounce(&bounce, &classes))
    };
    let constant = fold(Reconstruction::Constant)?;
    let bilinear = fold(Reconstruction::Bilinear)?;
    let config = PriorConfig {
        k_d: TABLE_PRIOR_VECTORS,
        ..PriorConfig::default()
    };
    let samples = direct_samples(shape, resolution, &config);
    let prior = light_prior(&samples, &classes, config.k_d);
    let transport = block_transport(
        &constant,
        &constant,
        &prior.basis,
        &classes,
        TABLE_PRIOR_VECTORS,
    );
    let all_values = |folded: &[Matrix<f64>]| {
        let parts: Vec<Svd> = folded.iter().map(|part| svd(part.view())).collect();
        let values = parts.iter().map(|part| &part.singular_values[..]);
        ModeChoice::largest(values, usize::MAX).singular_values
    };
    Ok(vec![
        Spectrum {
            matrix: "F (constant texels)",
            size: [texels, texels],
            singular_values: all_values(&constant),
        },
        Spectrum {
            matrix: "F (bilinear texels)",
            size: [texels, texels],
            singular_values: all_values(&bilinear),
        },
        Spectrum {
            matrix: "L_d",
            size: [texels, samples.columns()],
            singular_values: prior.singular_values,
        },
        Spectrum {
            matrix: "M",
            size: [texels, TABLE_PRIOR_VECTORS],
            singular_values: transport.singular_values,
        },
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts for 80, 90 and 95 % from an independent `f64` computation, and the largest accepted difference:
    /// implementations of the texel quadrature differ by that much.
    const EXPECTED: [([usize; 3], usize); 4] = [
        ([205, 288, 346], 2),
        ([160, 234, 306], 3),
        ([22, 41, 64], 2),
        ([1, 4, 7], 2),
    ];

    #[test]
    fn counts_are_those_of_the_papers_table_2() {
        let spectra = closed_cube_spectra(16, &Progress::silent()).expect("nobody cancels");
        for (spectrum, (expected, slack)) in spectra.iter().zip(EXPECTED) {
            for (fraction, count) in [0.80, 0.90, 0.95].into_iter().zip(expected) {
                let found = spectrum.energy_rank(fraction);
                assert!(
                    found.abs_diff(count) <= slack,
                    "{} at {fraction}: {found}, expected {count}",
                    spectrum.matrix
                );
            }
        }
    }
}
