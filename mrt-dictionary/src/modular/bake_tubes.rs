//! The bake of tubes: the stages of [`crate::modular::bake`] in the geometry of round walls and openings, as a dictionary of
//! the same form.
//!
//! Light goes from tube to tube by lightfields alone, since there are as many tunnels as words. So the modes that
//! tubes send are the lightfield modes themselves, and so are those that they answer to: what each texel
//! does with a lightfield goes into the joint basis of its shape directly.

use crate::config::BakeConfig;
use crate::modular::joint::{ForeignLight, JointBasis, OwnLight, joint_basis_of};
use crate::modular::light_prior::tube::AreaWeights;
use crate::modular::lightfield::grid::LightfieldGrid;
use crate::modular::lightfield::interface::{exchanged, lightfield_basis, lightfield_coefficients};
use crate::modular::lightfield::tube::{
    tube_emitted_lightfield, tube_enriched_basis, tube_interface,
};
use crate::modular::lightfield::tube_response::tube_wall_response;
use crate::modular::one_bounce::tube::tube_parity_classes;
use crate::modular::transport::modes::BlockTransport;
use crate::modular::transport::tube::tube_transport;
use crate::progress::{Cancelled, Progress};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::TubeForm;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity_modes::ParityBasis;
use mrt_runtime::Dictionary;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::modular::dictionary::{
    LightfieldOperators, OpeningOperators, PathTable, ShapeOperators,
};

/// A tube of the set with its modes.
struct Tube {
    shape: &'static Shape,
    form: TubeForm,
    transport: BlockTransport,
}

/// Bakes tubes with settings that pass [`BakeConfig::check`]; shapes that are none are left out. The same settings
/// give the same bits on every machine and thread count.
///
/// # Errors
/// [`Cancelled`].
pub fn bake_tubes(
    config: &BakeConfig,
    shapes: &[&'static Shape],
    progress: &Progress,
) -> Result<Dictionary, Cancelled> {
    let steps = 2 * shapes.len() + 2 + config.lightfield.enrichment_rounds;
    let mut done = 0;
    let mut step = |what: &str| {
        done += 1;
        progress.step(what, done - 1, steps)
    };
    let mut tubes = Vec::with_capacity(shapes.len());
    for &shape in shapes {
        let Some(form) = shape.tube() else { continue };
        step(shape.name)?;
        let transport = tube_transport(form, config, progress)?;
        tubes.push(Tube {
            shape,
            form,
            transport,
        });
    }
    step("lightfields at the openings")?;
    let grid = LightfieldGrid::new(&config.lightfield);
    let basis = basis(&grid, &tubes, config, &mut step, progress)?;
    step("lightfield operators")?;
    let interface = tube_interface(&grid, &basis, progress)?;
    let turned = exchanged(&grid, &basis.vectors);
    let exchange = lightfield_coefficients(&basis, &turned);
    let mut entries = Vec::with_capacity(tubes.len());
    for tube in &tubes {
        step(tube.shape.name)?;
        entries.push(pack_tube(tube, &grid, &basis, &turned, config, progress)?);
    }
    let modes = basis.vectors.columns();
    let identity = Matrix::from_fn(modes, modes, |i, j| f32::from(u8::from(i == j)));
    let parity = basis.parity.clone();
    Ok(Dictionary {
        preset: config.preset.clone(),
        settings: config.describe(),
        resolution: config.resolution,
        probes: 0,
        shapes: entries,
        variants: Vec::new(),
        lightfields: LightfieldOperators {
            parity: parity.clone(),
            from_emission: identity.clone(),
            straight: interface.straight.cast(),
            left: interface.left.cast(),
            exchange: exchange.cast(),
            holes: Vec::new(),
            response_from_lightfield: identity,
            dropped_energy: basis.dropped_energy as f32,
        },
        sources: None,
        paths: PathTable {
            depth: 0,
            hole_depth: 0,
            emission_parity: parity.clone(),
            response_parity: parity,
            entries: Vec::new(),
            emission_dropped_energy: 0.0,
            response_dropped_energy: 0.0,
        },
    })
}

/// The basis of what the tubes send and of what becomes of it on its way.
fn basis(
    grid: &LightfieldGrid,
    tubes: &[Tube],
    config: &BakeConfig,
    step: &mut impl FnMut(&str) -> Result<(), Cancelled>,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let classes = grid.parity_classes();
    let mut sent = Vec::new();
    for tube in tubes {
        progress.check()?;
        // What leaves by the other opening is the mirror image, whose parts of each parity are the same.
        let opening = tube.form.openings()[0];
        sent.push(emitted(grid, tube, opening, config));
    }
    let modes = config.lightfield.lightfield_modes;
    let mut basis = lightfield_basis(&classes, &sent, modes, progress)?;
    for _ in 0..config.lightfield.enrichment_rounds {
        step("lightfield enrichment")?;
        basis = tube_enriched_basis(grid, &classes, &basis, &config.lightfield, progress)?;
    }
    Ok(basis)
}

/// What leaves by an opening when the tube's modes shine.
fn emitted(grid: &LightfieldGrid, tube: &Tube, opening: Face, config: &BakeConfig) -> Matrix<f64> {
    let radiosity = &tube.transport.implicit_lighting;
    tube_emitted_lightfield(grid, tube.form, opening, radiosity, config.resolution)
}

/// The joint basis and the openings of one tube; `turned` are the basis vectors with u and v exchanged.
fn pack_tube(
    tube: &Tube,
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    turned: &Matrix<f64>,
    config: &BakeConfig,
    progress: &Progress,
) -> Result<ShapeOperators, Cancelled> {
    let (form, resolution) = (tube.form, config.resolution);
    let weights = AreaWeights::new(form, resolution);
    let mut arriving = Vec::with_capacity(4);
    for opening in form.openings() {
        for lightfields in [&basis.vectors, turned] {
            progress.check()?;
            let response = tube_wall_response(grid, lightfields, form, opening, resolution);
            arriving.push(ForeignLight {
                field: weights.weigh(&response),
                vector: Matrix::zeros(0, response.columns()),
            });
        }
    }
    let transport = &tube.transport;
    let modes = transport.implicit_lighting.columns();
    let own = OwnLight {
        irradiance: weights.weigh(&transport.indirect_basis),
        probes: Matrix::zeros(0, modes),
        vector: Matrix::zeros(0, modes),
    };
    let classes = tube_parity_classes(form, resolution);
    let extra = config.coupling.foreign_modes;
    let JointBasis {
        irradiance,
        probes,
        vector,
        joint_from_response,
        dropped_energy,
    } = joint_basis_of(&own, arriving, &basis.scales, &classes, extra, 2);
    let openings = form
        .openings()
        .iter()
        .zip(&joint_from_response)
        .map(|(&opening, joint_from_response)| {
            let sent = emitted(grid, tube, opening, config);
            let both = [lightfield_coefficients(basis, &sent), {
                let sent = exchanged(grid, &sent);
                lightfield_coefficients(basis, &sent)
            }];
            OpeningOperators {
                emission_from_coefficients: both.iter().map(Matrix::cast).collect(),
                joint_from_response: joint_from_response.iter().map(Matrix::cast).collect(),
            }
        })
        .collect();
    Ok(ShapeOperators {
        shape: tube.shape,
        coefficients_from_direct: transport.coefficients_from_direct.cast(),
        joint_basis: weights.unweigh(&irradiance).cast(),
        probe_basis: probes.cast(),
        vector_basis: vector.cast(),
        openings,
        implicit_lighting: transport.implicit_lighting.cast(),
        singular_values: transport.singular_values[..modes]
            .iter()
            .map(|&s| s as f32)
            .collect(),
        dropped_energy: transport.dropped_energy as f32,
        joint_dropped_energy: dropped_energy as f32,
    })
}
