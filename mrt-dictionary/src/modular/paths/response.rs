//! What light from other blocks does to a block, reduced: one basis for all paths (the paper's `U_r`,
//! section 5.1), and the operator of each path in it.

use crate::modular::outputs::cube::{PROBE_WEIGHT, ProbeSamples, texel_axes};
use crate::modular::paths::emission::EmissionBasis;
use crate::modular::paths::transport::{Gather, Gathered, RECEIVER, Signals, gather};
use crate::modular::surface::mirrors::{output_parity_classes, output_permutation};
use crate::progress::{Cancelled, Progress};
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::least_squares::pseudo_inverse;
use mrt_core::linalg::matrix::{Matrix, multiply, transpose_multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{GramModes, ModeChoice, add_gram_of_rows};
use mrt_runtime::low_level::modular::path::Word;
use rayon::prelude::*;

/// The response basis and the paths' operators.
#[derive(Clone, Debug)]
pub struct ResponseBasis {
    /// Orthonormal; rows are the receiver's texels, then the samples of its probes times [`PROBE_WEIGHT`].
    pub basis: Matrix<f64>,
    /// Vector irradiance of each mode, 4 texels x modes, or no rows.
    pub vector: Matrix<f64>,
    /// Singular value of each mode.
    pub scales: Vec<f64>,
    /// Parity of each mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub parity: Vec<u8>,
    /// Fraction that the modes left out hold of what arrives, beyond the first mode.
    pub dropped_energy: f64,
    /// Response modes x emission modes for each word.
    pub paths: Vec<Matrix<f64>>,
}

/// Emission modes that take part in choosing the basis; they hold all but 1e-5 of the energy.
const DECIDING_MODES: usize = 48;

/// Gathers all paths' light and reduces it.
///
/// # Errors
/// [`Cancelled`].
pub fn response_basis(
    words: &[Word],
    emission: &EmissionBasis,
    setup: &Gather,
    modes: usize,
    has_exchanges: bool,
    progress: &Progress,
) -> Result<ResponseBasis, Cancelled> {
    let by_texel = emission.radiosity.transposed();
    let samples = ProbeSamples::default();
    let mut gathered: Vec<(Matrix<f64>, Matrix<f64>)> = Vec::with_capacity(words.len());
    for word in words {
        progress.check()?;
        let light = gather(word, Signals::Given(&by_texel), setup);
        gathered.push((stacked(&light, &samples), light.vector));
    }
    let classes = output_parity_classes(&RECEIVER, setup.resolution, setup.probes);
    let exchange = has_exchanges.then(|| {
        let map = CubeSymmetry::exchange(0, 1);
        output_permutation(&RECEIVER, setup.resolution, setup.probes, map)
    });
    let deciding = emission.scales.len().min(DECIDING_MODES);
    let scaled: Vec<Matrix<f64>> = gathered
        .par_iter()
        .map(|(light, _)| {
            let light = light
                .leading_columns(deciding)
                .scaled_columns(&emission.scales[..deciding]);
            let weight = path_weight(light.frobenius_norm());
            light.scaled_columns(&vec![weight; deciding])
        })
        .collect();
    let parts = (0..classes.class_count())
        .into_par_iter()
        .map(|class| {
            progress.check()?;
            let gram = gram_of_class(&classes, class, &scaled, exchange.as_deref());
            Ok(GramModes::of(&gram))
        })
        .collect::<Result<Vec<GramModes>, Cancelled>>()?;
    let values = parts.iter().map(|part| &part.singular_values[..]);
    let found = ModeChoice::largest(values, modes).basis(&classes, |mode| {
        parts[mode.class].vectors.column(mode.position).to_vec()
    });
    let (basis, parity) = (found.vectors, found.parity);
    let paths: Vec<Matrix<f64>> = gathered
        .par_iter()
        .map(|(light, _)| transpose_multiply(basis.view(), light.view()))
        .collect();
    let vector = vector_of_modes(&gathered, &paths, emission, &parity, setup);
    Ok(ResponseBasis {
        basis,
        vector,
        parity,
        dropped_energy: found.dropped_energy,
        scales: found.scales,
        paths,
    })
}

/// Texels, then weighted samples of probes.
pub fn stacked(light: &Gathered, samples: &ProbeSamples) -> Matrix<f64> {
    stack(
        &light.irradiance,
        &samples.from_sh(&light.probes, PROBE_WEIGHT),
    )
}

/// One matrix above another.
pub fn stack(above: &Matrix<f64>, below: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(above.rows() + below.rows(), above.columns(), |i, j| match i
        .checked_sub(above.rows())
    {
        None => above[(i, j)],
        Some(i) => below[(i, j)],
    })
}

/// Rows of a matrix.
pub fn rows(matrix: &Matrix<f64>, range: std::ops::Range<usize>) -> Matrix<f64> {
    Matrix::from_fn(range.len(), matrix.columns(), |i, j| {
        matrix[(range.start + i, j)]
    })
}

/// Brings a path's light to the root of its norm: by their norms the nearest block would decide on the basis
/// alone, and with equal norms the darkest path would count as much.
fn path_weight(norm: f64) -> f64 {
    if norm > 0.0 { 1.0 / norm.sqrt() } else { 0.0 }
}

/// Scalar products of the rows of all paths' light, the part of one parity.
fn gram_of_class(
    classes: &ParityClasses,
    class: usize,
    scaled: &[Matrix<f64>],
    exchange: Option<&[u32]>,
) -> Matrix<f64> {
    let mut gram = Matrix::zeros(classes.dimension(class), classes.dimension(class));
    for light in scaled {
        add_gram_of_rows(&mut gram, &classes.fold_columns(class, light));
        if let Some(exchange) = exchange {
            let exchanged = Matrix::from_fn(light.rows(), light.columns(), |i, j| {
                light[(exchange[i] as usize, j)]
            });
            add_gram_of_rows(&mut gram, &classes.fold_columns(class, &exchanged));
        }
    }
    gram
}

/// Vector irradiance of each mode: the linear function of the coefficients that fits that of all paths best.
fn vector_of_modes(
    gathered: &[(Matrix<f64>, Matrix<f64>)],
    paths: &[Matrix<f64>],
    emission: &EmissionBasis,
    parity: &[u8],
    setup: &Gather,
) -> Matrix<f64> {
    if !setup.vector {
        return Matrix::zeros(0, parity.len());
    }
    let squares: Vec<f64> = emission.scales.iter().map(|s| s * s).collect();
    let mut cross = Matrix::zeros(gathered[0].1.rows(), parity.len());
    let mut own = Matrix::<f64>::zeros(parity.len(), parity.len());
    for ((_, vector), path) in gathered.iter().zip(paths) {
        let norm = path.scaled_columns(&emission.scales).frobenius_norm();
        let weight = path_weight(norm);
        let weights: Vec<f64> = squares.iter().map(|s| s * weight * weight).collect();
        let source = path.scaled_columns(&weights).transposed();
        let product = multiply(vector.view(), source.view());
        for (sum, &x) in cross.data_mut().iter_mut().zip(product.data()) {
            *sum += x;
        }
        let product = multiply(path.view(), source.view());
        for (sum, &x) in own.data_mut().iter_mut().zip(product.data()) {
            *sum += x;
        }
    }
    // Mirrored paths occur too: only what has the mode's own parity is left, and modes of different parity do
    // not correlate.
    let own = Matrix::from_fn(parity.len(), parity.len(), |i, j| {
        if parity[i] == parity[j] {
            own[(i, j)]
        } else {
            0.0
        }
    });
    let cross = of_own_parity(&cross, parity, setup.resolution);
    multiply(cross.view(), pseudo_inverse(&own).view())
}

/// The part of each column of vector irradiance that has the given parity.
fn of_own_parity(vector: &Matrix<f64>, parity: &[u8], resolution: usize) -> Matrix<f64> {
    let mut part = vector.clone();
    for axis in 0..2 {
        let map = CubeSymmetry::mirror(axis);
        let image = output_permutation(&RECEIVER, resolution, 0, map);
        let flips: Vec<[f64; 4]> = RECEIVER
            .texels(resolution)
            .map(|(face, _)| {
                let [u, v, _] = texel_axes(face);
                let sign = |d: glam::DVec3| if map.direction(d) == d { 1.0 } else { -1.0 };
                [1.0, sign(v), 1.0, sign(u)]
            })
            .collect();
        part = Matrix::from_fn(part.rows(), part.columns(), |i, j| {
            let odd = parity[j] >> axis & 1 == 1;
            let sign = if odd {
                -flips[i / 4][i % 4]
            } else {
                flips[i / 4][i % 4]
            };
            let mirrored = 4 * image[i / 4] as usize + i % 4;
            0.5 * (part[(i, j)] + sign * part[(mirrored, j)])
        });
    }
    part
}
