//! The modes of one shape, chosen for all that its light does: on its own walls, at its probes, and on the walls
//! of the blocks beyond its openings.
//!
//! The paper chooses them for the own walls alone (section 4.1). The light of a spot on a wall is spread wide in its
//! own block and still a spot for the next one: with the standard preset, modes for the own walls alone err by 2.08 %
//! one opening away, and these by 1.92.

use crate::config::BakeConfig;
use crate::modular::light_prior::cube::{ScaledBasis, direct_samples, enriched_prior, light_prior};
use crate::modular::one_bounce::cube::{restrict_to_shape, wall_fraction};
use crate::modular::outputs::cube::{OWN_PROBE_WEIGHT, ProbeSamples, probe_operator};
use crate::modular::paths::emission::opening_frame;
use crate::modular::paths::response::stacked;
use crate::modular::paths::transport::{EMITTER, Gather, Signals, gather, texel_at};
use crate::modular::surface::mirrors::{output_parity_classes, texel_parity_classes};
use crate::modular::transport::modes::{
    BlockTransport, block_transport, fold_bounce, fold_operator,
};
use crate::progress::Cancelled;
use mrt_core::geometry::cube::Face;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::svd::symmetric_eigen;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::Outline;
use mrt_runtime::low_level::modular::path::{Crossing, Word, hole_of};

/// A shape's operators: as [`BlockTransport`], with modes chosen for all outputs.
pub type ShapeTransport = BlockTransport;

/// The light that goes straight on through an opening of some outline into the next block.
#[derive(Clone, Debug)]
pub struct Neighbour {
    outline: Outline,
    /// Rows x texels of the emitter; products of its columns are those of the light on the walls beyond.
    operator: Matrix<f64>,
}

/// Rows of [`Neighbour::operator`] whose singular values are below this fraction of the largest are left out.
const NEIGHBOUR_FLOOR: f64 = 1e-3;

/// The operators through openings of all the given outlines, compressed to few rows.
///
/// # Errors
/// [`Cancelled`].
pub fn neighbours(config: &BakeConfig, outlines: &[Outline]) -> Result<Vec<Neighbour>, Cancelled> {
    let setup = Gather {
        resolution: config.resolution,
        probes: config.outputs.probes,
        vector: false,
    };
    let classes = texel_parity_classes(&EMITTER, config.resolution);
    Ok(outlines
        .iter()
        .map(|&outline| {
            let word = Word::default().then(Crossing {
                heading: Face::PosZ,
                hole: hole_of(outline),
            });
            let light = stacked(
                &gather(&word, Signals::EachTexel, &setup),
                &ProbeSamples::default(),
            );
            Neighbour {
                outline,
                operator: compressed(&light, &classes),
            }
        })
        .collect())
}

/// Few rows with nearly the same scalar products between columns; each row has a parity.
fn compressed(operator: &Matrix<f64>, classes: &ParityClasses) -> Matrix<f64> {
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for class in 0..classes.class_count() {
        // Columns of the class: the operator applied to the class's unit signals.
        let columns: Vec<Vec<f64>> = (0..classes.dimension(class))
            .map(|k| {
                let mut unit = vec![0.0; classes.dimension(class)];
                unit[k] = 1.0;
                crate::modular::transport::modes::multiply_sparse(
                    operator,
                    &classes.unfold(class, &unit),
                )
            })
            .collect();
        let columns = Matrix::from_columns(operator.rows(), &columns);
        let gram = mrt_core::linalg::matrix::transpose_multiply(columns.view(), columns.view());
        let (values, vectors) = symmetric_eigen(gram.view());
        let floor = NEIGHBOUR_FLOOR * NEIGHBOUR_FLOOR * values.first().copied().unwrap_or(0.0);
        for (k, &value) in values.iter().enumerate().take_while(|(_, v)| **v > floor) {
            let row: Vec<f64> = vectors.column(k).iter().map(|x| x * value.sqrt()).collect();
            kept.push(classes.unfold(class, &row));
        }
    }
    Matrix::from_columns(classes.point_count(), &kept).transposed()
}

/// Everything about one shape alone.
pub fn shape_transport(
    shape: &Shape,
    closed: &Matrix<f64>,
    neighbours: &[Neighbour],
    config: &BakeConfig,
) -> ShapeTransport {
    if shape.wall_count() == 0 {
        return BlockTransport {
            indirect_basis: Matrix::zeros(0, 0),
            coefficients_from_direct: Matrix::zeros(0, 0),
            implicit_lighting: Matrix::zeros(0, 0),
            singular_values: Vec::new(),
            dropped_energy: 0.0,
        };
    }
    let classes = texel_parity_classes(shape, config.resolution);
    let bounce = restrict_to_shape(closed, shape, config.resolution);
    let folded = fold_bounce(&bounce, &classes);
    let outputs = folded_outputs(shape, &folded, neighbours, &classes, config);
    let samples = direct_samples(shape, config.resolution, &config.prior);
    let prior = light_prior(&samples, &classes, config.prior.k_d);
    let transport =
        |basis: &ScaledBasis| block_transport(&outputs, &folded, basis, &classes, config.modes);
    let plain = transport(&prior.basis);
    match &config.enrichment {
        None => plain,
        Some(enrichment) => {
            let enriched =
                enriched_prior(&prior, &plain.indirect_basis, shape, &classes, enrichment);
            transport(&enriched.basis)
        }
    }
}

/// The bounce, the probes and the light beyond openings, stacked, by parity class of the radiosity.
fn folded_outputs(
    shape: &Shape,
    folded_bounce: &[Matrix<f64>],
    neighbours: &[Neighbour],
    classes: &ParityClasses,
    config: &BakeConfig,
) -> Vec<Matrix<f64>> {
    let (resolution, probes) = (config.resolution, config.outputs.probes);
    let samples = ProbeSamples::default();
    let at_probes = samples.from_sh(&probe_operator(shape, resolution, probes), OWN_PROBE_WEIGHT);
    let volume = output_parity_classes(shape, resolution, probes);
    let texels = classes.point_count();
    let padded = Matrix::from_fn(texels + at_probes.rows(), texels, |i, j| {
        i.checked_sub(texels).map_or(0.0, |i| at_probes[(i, j)])
    });
    let folded_probes = fold_operator(&padded, &volume, classes);
    let beyond: Vec<Matrix<f64>> = shape
        .openings
        .iter()
        .filter_map(|opening| {
            let neighbour = neighbours.iter().find(|n| n.outline == opening.outline)?;
            Some(beyond_opening(shape, opening.face, neighbour, resolution))
        })
        .collect();
    let weight = config.coupling.beyond_weight;
    (0..classes.class_count())
        .map(|class| {
            let mut rows: Vec<Matrix<f64>> =
                vec![folded_bounce[class].clone(), folded_probes[class].clone()];
            for operator in &beyond {
                // Its rows have no parity of the shape's, and need none: radiosity of the class does.
                let columns: Vec<Vec<f64>> = (0..classes.dimension(class))
                    .map(|k| {
                        let mut unit = vec![0.0; classes.dimension(class)];
                        unit[k] = weight;
                        crate::modular::transport::modes::multiply_sparse(
                            operator,
                            &classes.unfold(class, &unit),
                        )
                    })
                    .collect();
                rows.push(Matrix::from_columns(operator.rows(), &columns));
            }
            stack_all(&rows)
        })
        .collect()
}

/// The neighbour's operator on the texels of a shape.
fn beyond_opening(
    shape: &Shape,
    opening: Face,
    neighbour: &Neighbour,
    resolution: usize,
) -> Matrix<f64> {
    let back = opening_frame(opening, false).inverse();
    let sources: Vec<Option<(usize, f64)>> = shape
        .texels(resolution)
        .map(|(face, center)| {
            let texel = texel_at(&EMITTER, back.face(face), back.point(center), resolution)?;
            Some((texel, wall_fraction(shape, face, center, resolution)))
        })
        .collect();
    Matrix::from_fn(neighbour.operator.rows(), sources.len(), |i, j| {
        sources[j].map_or(0.0, |(texel, fraction)| {
            fraction * neighbour.operator[(i, texel)]
        })
    })
}

fn stack_all(parts: &[Matrix<f64>]) -> Matrix<f64> {
    let columns = parts.first().map_or(0, Matrix::columns);
    let all: Vec<Vec<f64>> = (0..columns)
        .map(|j| {
            parts
                .iter()
                .flat_map(|part| part.column(j))
                .copied()
                .collect()
        })
        .collect();
    Matrix::from_columns(parts.iter().map(Matrix::rows).sum(), &all)
}
