//! What light from other blocks does to a block, reduced: one basis for all paths (the paper's `U_r`,
//! section 5.1), and the operator of each path in it.

use crate::matrix_parts::{add_to, scaled};
use crate::modular::outputs::probe_samples::ProbeSamples;
use crate::modular::paths::emission::EmissionBasis;
use crate::modular::paths::ends::RECEIVER;
use crate::modular::paths::gather::{Signals, gather};
use crate::modular::surface::mirrors::cube::{output_parity_classes, output_permutation};
use crate::modular::surface::output_grid::OutputGrid;
use crate::modular::surface::walls::cube::texel_axes;
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::least_squares::pseudo_inverse;
use mrt_core::linalg::matrix::{Matrix, multiply, transpose_multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{GramModes, ModeChoice, ParityBasis, add_gram_of_rows};
use mrt_runtime::low_level::modular::path::Word;
use rayon::prelude::*;

/// The response basis and the paths' operators.
#[derive(Clone, Debug)]
pub struct ResponseBasis {
    /// Orthonormal; rows are the receiver's texels, then the samples of its probes times
    /// [`crate::modular::outputs::probe_samples::PROBE_WEIGHT`].
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

/// Settings of the response basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResponseConfig {
    /// Where light is gathered.
    pub grid: OutputGrid,
    /// Largest number of modes; fewer are kept where a multiplet would be cut.
    pub modes: usize,
    /// True if the basis must hold all light with x and y exchanged too, as sets with openings up and down need.
    pub has_exchanges: bool,
}

/// Emission modes that take part in choosing the basis; they hold all but 1e-5 of the energy.
const DECIDING_MODES: usize = 48;

/// Light at the end of one path, from each emission mode.
struct PathLight {
    /// Texels and weighted samples of probes x emission modes.
    outputs: Matrix<f64>,
    /// 4 texels x emission modes, or no rows.
    vector: Matrix<f64>,
}

/// Gathers all paths' light and reduces it.
///
/// Cost: that of [`gather`] for each word, and an eigenvalue problem for each parity class of the receiver's outputs.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn response_basis(
    words: &[Word],
    emission: &EmissionBasis,
    config: &ResponseConfig,
    progress: &Progress,
) -> Result<ResponseBasis, Cancelled> {
    let by_texel = emission.radiosity.transposed();
    let samples = ProbeSamples::default();
    let mut gathered: Vec<PathLight> = Vec::with_capacity(words.len());
    for word in words {
        progress.check()?;
        let light = gather(word, Signals::Given(&by_texel), &config.grid);
        gathered.push(PathLight {
            outputs: light.texels_and_samples(&samples),
            vector: light.vector,
        });
    }
    let found = basis_of_light(&gathered, emission, config, progress)?;
    let paths: Vec<Matrix<f64>> = gathered
        .par_iter()
        .map(|light| transpose_multiply(found.vectors.view(), light.outputs.view()))
        .collect();
    let vector = if config.grid.vector {
        let resolution = config.grid.resolution;
        vector_of_modes(&gathered, &paths, emission, &found.parity, resolution)
    } else {
        Matrix::zeros(0, found.parity.len())
    };
    Ok(ResponseBasis {
        basis: found.vectors,
        vector,
        scales: found.scales,
        parity: found.parity,
        dropped_energy: found.dropped_energy,
        paths,
    })
}

/// The basis that holds the outputs of all paths best.
fn basis_of_light(
    gathered: &[PathLight],
    emission: &EmissionBasis,
    config: &ResponseConfig,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let OutputGrid {
        resolution, probes, ..
    } = config.grid;
    let classes = output_parity_classes(&RECEIVER, resolution, probes);
    let exchange = config.has_exchanges.then(|| {
        let map = CubeSymmetry::exchange(0, 1);
        output_permutation(&RECEIVER, resolution, probes, map)
    });
    let deciding = emission.scales.len().min(DECIDING_MODES);
    let weighted: Vec<Matrix<f64>> = gathered
        .par_iter()
        .map(|light| {
            let outputs = light
                .outputs
                .leading_columns(deciding)
                .scaled_columns(&emission.scales[..deciding]);
            scaled(&outputs, path_weight(outputs.frobenius_norm()))
        })
        .collect();
    let parts = (0..classes.class_count())
        .into_par_iter()
        .map(|class| {
            progress.check()?;
            let gram = gram_of_class(&classes, class, &weighted, exchange.as_deref());
            Ok(GramModes::of(&gram))
        })
        .collect::<Result<Vec<GramModes>, Cancelled>>()?;
    let values = parts.iter().map(|part| &part.singular_values[..]);
    let choice = ModeChoice::largest(values, config.modes);
    Ok(choice.basis(&classes, |mode| {
        parts[mode.class].vectors.column(mode.position).to_vec()
    }))
}

/// The factor that brings a path's light to the root of its norm. By their norms alone the nearest block would decide on
/// the basis, and with equal norms the darkest path would count as much as the brightest.
fn path_weight(norm: f64) -> f64 {
    if norm > 0.0 { 1.0 / norm.sqrt() } else { 0.0 }
}

/// Scalar products of the rows of all paths' light in one parity class.
fn gram_of_class(
    classes: &ParityClasses,
    class: usize,
    weighted: &[Matrix<f64>],
    exchange: Option<&[u32]>,
) -> Matrix<f64> {
    let mut gram = Matrix::zeros(classes.dimension(class), classes.dimension(class));
    for light in weighted {
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

/// Vector irradiance of each mode: the linear function of the coefficients that fits the vector irradiance of all paths
/// best.
fn vector_of_modes(
    gathered: &[PathLight],
    paths: &[Matrix<f64>],
    emission: &EmissionBasis,
    parity: &[u8],
    resolution: usize,
) -> Matrix<f64> {
    let squares: Vec<f64> = emission.scales.iter().map(|s| s * s).collect();
    let mut cross = Matrix::zeros(gathered[0].vector.rows(), parity.len());
    let mut own = Matrix::<f64>::zeros(parity.len(), parity.len());
    for (light, path) in gathered.iter().zip(paths) {
        let norm = path.scaled_columns(&emission.scales).frobenius_norm();
        let weight = path_weight(norm);
        let weights: Vec<f64> = squares.iter().map(|s| s * weight * weight).collect();
        let source = path.scaled_columns(&weights).transposed();
        add_to(&mut cross, &multiply(light.vector.view(), source.view()));
        add_to(&mut own, &multiply(path.view(), source.view()));
    }
    // Mirrored paths occur as well as these. With them, only what has a mode's own parity is left of `cross`, and modes
    // of different parity do not correlate.
    let own = Matrix::from_fn(parity.len(), parity.len(), |i, j| {
        if parity[i] == parity[j] {
            own[(i, j)]
        } else {
            0.0
        }
    });
    let cross = of_own_parity(&cross, parity, resolution);
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
                let sign = |d: DVec3| if map.direction(d) == d { 1.0 } else { -1.0 };
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
