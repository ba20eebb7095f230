//! The modes of one canonical cube, chosen for all that its light does: on its own walls, at its probes, and on the walls
//! of the blocks beyond its openings.
//!
//! The paper chooses them for the own walls alone (section 4.1). The light of a spot on a wall is spread wide in its
//! own block and still a spot for the next one: with the standard preset, modes for the own walls alone err by 2.08 %
//! one opening away, and these by 1.92.

use crate::config::BakeConfig;
use crate::matrix_parts::stack;
use crate::modular::light_prior::basis::{ScaledBasis, light_prior};
use crate::modular::light_prior::cube::{direct_samples, enriched_prior};
use crate::modular::one_bounce::cube::restrict_to_shape;
use crate::modular::outputs::cube::probe_operator;
use crate::modular::outputs::probe_samples::{OWN_PROBE_WEIGHT, ProbeSamples};
use crate::modular::paths::ends::{EMITTER, PathFrame};
use crate::modular::paths::gather::{Signals, gather};
use crate::modular::surface::mirrors::cube::{output_parity_classes, texel_parity_classes};
use crate::modular::surface::output_grid::OutputGrid;
use crate::modular::surface::walls::cube::{texel_at, wall_fraction};
use crate::modular::transport::modes::{
    BlockTransport, applied_to_class, block_transport, fold_bounce, fold_operator,
};
use mrt_core::geometry::cube::Face;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{GramModes, gram_of_columns};
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::Outline;
use mrt_runtime::low_level::modular::path::{Crossing, Word, hole_of};

/// The light that goes straight on through an opening of some outline into the next block.
#[derive(Clone, Debug)]
pub struct Neighbour {
    outline: Outline,
    /// Rows x texels of the emitter. Two of its columns have the scalar product of the light that the two texels send to the
    /// walls and the probes beyond.
    operator: Matrix<f64>,
}

/// Rows of a neighbour's operator whose singular values are below this fraction of the largest are left out.
const NEIGHBOUR_FLOOR: f64 = 1e-3;

/// The light beyond openings of all the given outlines.
pub fn neighbours(config: &BakeConfig, outlines: &[Outline]) -> Vec<Neighbour> {
    let grid = OutputGrid {
        vector: false,
        ..OutputGrid::of(config)
    };
    let classes = texel_parity_classes(&EMITTER, config.resolution);
    outlines
        .iter()
        .map(|&outline| {
            let word = Word::default().then(Crossing {
                heading: Face::PosZ,
                hole: hole_of(outline),
            });
            let light = gather(&word, Signals::EachTexel, &grid);
            let light = light.texels_and_samples(&ProbeSamples::default());
            Neighbour {
                outline,
                operator: compressed(&light, &classes),
            }
        })
        .collect()
}

/// Few rows whose columns have nearly the same scalar products; each row has a parity.
fn compressed(operator: &Matrix<f64>, classes: &ParityClasses) -> Matrix<f64> {
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for class in 0..classes.class_count() {
        let columns = applied_to_class(operator, classes, class, 1.0);
        let modes = GramModes::of(&gram_of_columns(&columns));
        let largest = modes.singular_values.first().copied().unwrap_or(0.0);
        for (k, &value) in modes.singular_values.iter().enumerate() {
            if value > NEIGHBOUR_FLOOR * largest {
                let row: Vec<f64> = modes.vectors.column(k).iter().map(|x| x * value).collect();
                kept.push(classes.unfold(class, &row));
            }
        }
    }
    Matrix::from_columns(classes.point_count(), &kept).transposed()
}

/// The reduced transport of one shape, from F of the closed cube.
pub fn shape_transport(
    shape: &Shape,
    closed: &Matrix<f64>,
    neighbours: &[Neighbour],
    config: &BakeConfig,
) -> BlockTransport {
    if shape.wall_count() == 0 {
        return BlockTransport::empty();
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
    let folded_probes = folded_probes(shape, classes, config);
    let beyond: Vec<Matrix<f64>> = shape
        .openings
        .iter()
        .filter_map(|opening| {
            let neighbour = neighbours.iter().find(|n| n.outline == opening.outline)?;
            let face = opening.face;
            Some(beyond_opening(shape, face, neighbour, config.resolution))
        })
        .collect();
    let weight = config.coupling.beyond_weight;
    (0..classes.class_count())
        .map(|class| {
            let beyond: Vec<Matrix<f64>> = beyond
                .iter()
                .map(|operator| applied_to_class(operator, classes, class, weight))
                .collect();
            let own = [&folded_bounce[class], &folded_probes[class]];
            let all: Vec<&Matrix<f64>> = own.into_iter().chain(&beyond).collect();
            stack(&all)
        })
        .collect()
}

/// The weighted samples of the shape's probes from radiosity, by parity class.
fn folded_probes(shape: &Shape, classes: &ParityClasses, config: &BakeConfig) -> Vec<Matrix<f64>> {
    let (resolution, probes) = (config.resolution, config.outputs.probes);
    let operator = probe_operator(shape, resolution, probes);
    let at_probes = ProbeSamples::default().from_sh(&operator, OWN_PROBE_WEIGHT);
    let outputs = output_parity_classes(shape, resolution, probes);
    let texels = classes.point_count();
    // The classes of the outputs begin with the texels, which get nothing here.
    let padded = stack(&[&Matrix::zeros(texels, texels), &at_probes]);
    fold_operator(&padded, &outputs, classes)
}

/// The neighbour's operator behind an opening of a shape: rows x texels of the shape.
fn beyond_opening(
    shape: &Shape,
    opening: Face,
    neighbour: &Neighbour,
    resolution: usize,
) -> Matrix<f64> {
    let back = PathFrame::Upright.of_heading(opening).inverse();
    let columns: Vec<Vec<f64>> = shape
        .texels(resolution)
        .map(|(face, center)| {
            let texel = texel_at(&EMITTER, back.face(face), back.point(center), resolution);
            let fraction = wall_fraction(shape, face, center, resolution);
            match texel {
                None => vec![0.0; neighbour.operator.rows()],
                Some(texel) => {
                    let column = neighbour.operator.column(texel);
                    column.iter().map(|x| fraction * x).collect()
                }
            }
        })
        .collect();
    Matrix::from_columns(neighbour.operator.rows(), &columns)
}
