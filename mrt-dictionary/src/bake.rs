//! The bake: from canonical shapes to a dictionary, a list of calls.

use crate::bounce::{Reconstruction, closed_cube_bounce, restrict_to_shape};
use crate::config::BakeConfig;
use crate::interface::{
    InterfaceOperators, LightfieldBasis, emitted_lightfield, enriched_basis, interface_operators,
    lightfield_basis, lightfield_from_coefficients,
};
use crate::lightfield::LightfieldGrid;
use crate::prior::{direct_samples, enriched_prior, light_prior};
use crate::progress::{Cancelled, Progress};
use crate::symmetry::texel_parity_classes;
use crate::transport::{BlockTransport, block_transport, fold_bounce};
use mrt_core::matrix::Matrix;
use mrt_runtime::dictionary::{self, Dictionary, ShapeOperators};
use mrt_runtime::shape::{SHAPES, Shape};

/// Bakes all [`SHAPES`] with settings that pass [`BakeConfig::check`]. The same settings give the same bits
/// on every machine and thread count.
///
/// # Errors
/// [`Cancelled`].
pub fn bake(config: &BakeConfig, progress: &Progress) -> Result<Dictionary, Cancelled> {
    let steps = SHAPES.len() + 4 + config.lightfield.enrichment_rounds;
    progress.step("one-bounce operator", 0, steps)?;
    let closed = closed_cube_bounce(config.resolution, Reconstruction::Constant, progress)?;
    let mut transports = Vec::with_capacity(SHAPES.len());
    for (index, shape) in SHAPES.iter().enumerate() {
        progress.step(shape.name, 1 + index, steps)?;
        transports.push(bake_shape(shape, &closed, config));
    }
    let mut step = 1 + SHAPES.len();
    progress.step("lightfields at the openings", step, steps)?;
    let grid = LightfieldGrid::new(&config.lightfield);
    let classes = grid.parity_classes();
    let emitted = emitted_lightfields(&grid, &transports, config.resolution, progress)?;
    let all: Vec<Matrix<f64>> = emitted.iter().flatten().cloned().collect();
    let modes = config.lightfield.lightfield_modes;
    let mut basis = lightfield_basis(&classes, &all, modes, progress)?;
    for _ in 0..config.lightfield.enrichment_rounds {
        step += 1;
        progress.step("lightfield enrichment", step, steps)?;
        basis = enriched_basis(&grid, &classes, &basis, &config.lightfield, progress)?;
    }
    progress.step("lightfield operators", step + 1, steps)?;
    let interface = interface_operators(
        &grid,
        &basis,
        &config.lightfield,
        config.resolution,
        progress,
    )?;
    progress.step("projections", step + 2, steps)?;
    Ok(pack(config, transports, &emitted, &basis, &interface))
}

/// Everything about one shape alone.
fn bake_shape(shape: &Shape, closed: &Matrix<f64>, config: &BakeConfig) -> BlockTransport {
    let classes = texel_parity_classes(shape, config.resolution);
    let bounce = restrict_to_shape(closed, shape, config.resolution);
    let folded = fold_bounce(&bounce, &classes);
    let samples = direct_samples(shape, config.resolution, &config.prior);
    let prior = light_prior(&samples, &classes, config.prior.k_d);
    let plain = block_transport(&folded, &prior.basis, &classes, config.modes);
    match &config.enrichment {
        None => plain,
        Some(enrichment) => {
            let enriched =
                enriched_prior(&prior, &plain.indirect_basis, shape, &classes, enrichment);
            block_transport(&folded, &enriched.basis, &classes, config.modes)
        }
    }
}

/// `H_lf` by shape and opening.
fn emitted_lightfields(
    grid: &LightfieldGrid,
    transports: &[BlockTransport],
    resolution: usize,
    progress: &Progress,
) -> Result<Vec<Vec<Matrix<f64>>>, Cancelled> {
    SHAPES
        .iter()
        .zip(transports)
        .map(|(shape, transport)| {
            shape
                .openings
                .iter()
                .map(|&opening| {
                    progress.check()?;
                    let radiosity = &transport.implicit_lighting;
                    Ok(emitted_lightfield(
                        grid, shape, opening, radiosity, resolution,
                    ))
                })
                .collect()
        })
        .collect()
}

fn pack(
    config: &BakeConfig,
    transports: Vec<BlockTransport>,
    emitted: &[Vec<Matrix<f64>>],
    basis: &LightfieldBasis,
    interface: &InterfaceOperators,
) -> Dictionary {
    let shapes = transports
        .into_iter()
        .zip(&SHAPES)
        .zip(emitted)
        .map(|((transport, shape), emitted)| {
            let modes = transport.indirect_basis.columns();
            ShapeOperators {
                shape,
                coefficients_from_direct: transport.coefficients_from_direct.cast(),
                indirect_basis: transport.indirect_basis.cast(),
                implicit_lighting: transport.implicit_lighting.cast(),
                lightfield_from_coefficients: emitted
                    .iter()
                    .map(|field| lightfield_from_coefficients(basis, field).cast())
                    .collect(),
                singular_values: transport.singular_values[..modes]
                    .iter()
                    .map(|&s| s as f32)
                    .collect(),
                dropped_energy: transport.dropped_energy as f32,
            }
        })
        .collect();
    Dictionary {
        preset: config.preset.clone(),
        settings: config.describe(),
        resolution: config.resolution,
        shapes,
        interface: dictionary::InterfaceOperators {
            straight: interface.straight.cast(),
            left: interface.left.cast(),
            right: interface.right.cast(),
            response_from_lightfield: interface.response_from_lightfield.cast(),
            response_basis: interface.response_basis.cast(),
            lightfield_dropped_energy: basis.dropped_energy as f32,
            response_dropped_energy: interface.dropped_energy as f32,
        },
    }
}
