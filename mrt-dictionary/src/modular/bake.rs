//! The bake: from canonical shapes to a dictionary, a list of calls.

use crate::config::BakeConfig;
use crate::modular::bake_tubes::bake_tubes;
use crate::modular::joint::{JointBasis, OwnLight, joint_basis};
use crate::modular::lightfield::grid::LightfieldGrid;
use crate::modular::lightfield::interface::{
    InterfaceOperators, InterfaceSetup, emitted_lightfield, enriched_basis, interface_operators,
    lightfield_basis,
};
use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
use crate::modular::outputs::cube::{ProbeSamples, probe_operator, vector_irradiance};
use crate::modular::paths::emission::{EmissionBasis, emission_basis, emitter_radiosity};
use crate::modular::paths::response::{ResponseBasis, response_basis, rows, stack};
use crate::modular::paths::transport::Gather;
use crate::modular::transport::cube::{ShapeTransport, neighbours, shape_transport};
use crate::progress::{Cancelled, Progress};
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::linalg::parity_modes::ParityBasis;
use mrt_runtime::Dictionary;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::{Hole, Outline, shape_set};
use mrt_runtime::low_level::modular::dictionary::{
    LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators, Sources,
};
use mrt_runtime::low_level::modular::path::Word;

/// Bakes a set of shapes with settings that pass [`BakeConfig::check`]. The same settings give the same bits
/// on every machine and thread count.
///
/// # Errors
/// [`Cancelled`].
pub fn bake(config: &BakeConfig, progress: &Progress) -> Result<Dictionary, Cancelled> {
    let shapes = shape_set(&config.shapes).unwrap_or_default();
    if shapes.iter().any(|shape| shape.tube().is_some()) {
        return bake_tubes(config, &shapes, progress);
    }
    let set = Set::of(&shapes);
    let steps = 2 * shapes.len() + 6 + config.lightfield.enrichment_rounds;
    let mut done = 0;
    let mut step = |what: &str| {
        done += 1;
        progress.step(what, done - 1, steps)
    };
    step("one-bounce operator")?;
    let closed = closed_cube_bounce(config.resolution, Reconstruction::Constant, progress)?;
    step("light beyond openings")?;
    let neighbours = neighbours(config, &set.outlines)?;
    let mut transports = Vec::with_capacity(shapes.len());
    for shape in &shapes {
        step(shape.name)?;
        transports.push(shape_transport(shape, &closed, &neighbours, config));
    }
    step("paths through openings")?;
    let emission = emission(&shapes, &transports, config, &set);
    let hole_depth = if set.holes.is_empty() {
        0
    } else {
        config.coupling.hole_depth
    };
    let depths = [config.coupling.depth, hole_depth];
    let words = Word::all(depths[0], depths[1], &set.holes, set.has_exchanges);
    let gather = Gather {
        resolution: config.resolution,
        probes: config.outputs.probes,
        vector: config.outputs.vector,
    };
    let response = response_basis(
        &words,
        &emission,
        &gather,
        config.coupling.response_modes,
        set.has_exchanges,
        progress,
    )?;
    let mut entries = Vec::with_capacity(shapes.len());
    for (shape, transport) in shapes.iter().zip(&transports) {
        step(shape.name)?;
        entries.push(pack_shape(
            shape, transport, &emission, &response, config, &set,
        ));
    }
    step("lightfields at the openings")?;
    let grid = LightfieldGrid::new(&config.lightfield);
    let classes = grid.parity_classes();
    let emitted = emitted_lightfield(&grid, &emission.radiosity, config.resolution);
    let scaled = emitted.scaled_columns(&emission.scales);
    let modes = config.lightfield.lightfield_modes;
    let mut basis = lightfield_basis(&classes, &[scaled], modes, progress)?;
    for _ in 0..config.lightfield.enrichment_rounds {
        step("lightfield enrichment")?;
        basis = enriched_basis(
            &grid,
            &classes,
            &basis,
            &config.lightfield,
            set.has_exchanges,
            progress,
        )?;
    }
    step("lightfield operators")?;
    let setup = InterfaceSetup {
        resolution: config.resolution,
        probes: config.outputs.probes,
        has_exchanges: set.has_exchanges,
        holes: set.holes.clone(),
    };
    let interface = interface_operators(&grid, &basis, &emitted, &response, &setup, progress)?;
    Ok(Dictionary {
        preset: config.preset.clone(),
        settings: config.describe(),
        resolution: config.resolution,
        probes: config.outputs.probes,
        shapes: entries,
        variants: Vec::new(),
        lightfields: pack_lightfields(&basis, &interface),
        sources: Some(pack_sources(&emission, &response, config.resolution)),
        paths: pack_paths(words, depths, &emission, response),
    })
}

/// What a set of shapes needs.
struct Set {
    /// True with vertical openings.
    has_exchanges: bool,
    outlines: Vec<Outline>,
    holes: Vec<Hole>,
}

impl Set {
    fn of(shapes: &[&Shape]) -> Self {
        let openings = || shapes.iter().flat_map(|shape| shape.openings);
        let has = |outline: Outline| openings().any(|opening| opening.outline == outline);
        let holes: Vec<Hole> = Hole::ALL
            .into_iter()
            .filter(|&hole| has(Outline::Hole(hole)))
            .collect();
        Self {
            has_exchanges: openings().any(|opening| opening.face.axis() == 1),
            outlines: std::iter::once(Outline::Whole)
                .chain(holes.iter().map(|&hole| Outline::Hole(hole)))
                .collect(),
            // Words and masks are indexed by position in `Hole::ALL`.
            holes: if holes.is_empty() {
                holes
            } else {
                Hole::ALL.to_vec()
            },
        }
    }

    fn exchanges(&self) -> &'static [bool] {
        if self.has_exchanges {
            &[false, true]
        } else {
            &[false]
        }
    }
}

/// The emission basis of all that the shapes send.
fn emission(
    shapes: &[&'static Shape],
    transports: &[ShapeTransport],
    config: &BakeConfig,
    set: &Set,
) -> EmissionBasis {
    let mut sent = Vec::new();
    for (shape, transport) in shapes.iter().zip(transports) {
        let radiosity = &transport.implicit_lighting;
        for opening in shape.openings.iter().filter(|_| radiosity.columns() > 0) {
            for &is_exchanged in set.exchanges() {
                sent.push(emitter_radiosity(
                    shape,
                    opening.face,
                    is_exchanged,
                    radiosity,
                    config.resolution,
                ));
            }
        }
    }
    emission_basis(&sent, config.resolution, config.coupling.emission_modes)
}

/// The joint basis and the openings of one shape.
fn pack_shape(
    shape: &'static Shape,
    transport: &ShapeTransport,
    emission: &EmissionBasis,
    response: &ResponseBasis,
    config: &BakeConfig,
    set: &Set,
) -> ShapeOperators {
    let (resolution, probes) = (config.resolution, config.outputs.probes);
    let radiosity = &transport.implicit_lighting;
    let operator = probe_operator(shape, resolution, probes);
    let own = OwnLight {
        irradiance: transport.indirect_basis.clone(),
        probes: multiply(operator.view(), radiosity.view()),
        vector: if config.outputs.vector {
            vector_irradiance(shape, resolution, radiosity)
        } else {
            Matrix::zeros(0, radiosity.columns())
        },
    };
    let JointBasis {
        irradiance,
        probes: probe_basis,
        vector,
        joint_from_response,
        dropped_energy,
    } = joint_basis(
        shape,
        &own,
        response,
        resolution,
        probes,
        config.coupling.foreign_modes,
        set.has_exchanges,
    );
    let openings = shape
        .openings
        .iter()
        .zip(&joint_from_response)
        .map(|(opening, joint_from_response)| OpeningOperators {
            emission_from_coefficients: set
                .exchanges()
                .iter()
                .map(|&is_exchanged| {
                    let sent =
                        emitter_radiosity(shape, opening.face, is_exchanged, radiosity, resolution);
                    multiply(emission.from_radiosity.view(), sent.view()).cast()
                })
                .collect(),
            joint_from_response: joint_from_response.iter().map(Matrix::cast).collect(),
        })
        .collect();
    let modes = radiosity.columns();
    ShapeOperators {
        shape,
        coefficients_from_direct: transport.coefficients_from_direct.cast(),
        joint_basis: irradiance.cast(),
        probe_basis: probe_basis.cast(),
        vector_basis: vector.cast(),
        openings,
        implicit_lighting: radiosity.cast(),
        singular_values: transport.singular_values[..modes]
            .iter()
            .map(|&s| s as f32)
            .collect(),
        dropped_energy: transport.dropped_energy as f32,
        joint_dropped_energy: dropped_energy as f32,
    }
}

fn pack_lightfields(basis: &ParityBasis, interface: &InterfaceOperators) -> LightfieldOperators {
    LightfieldOperators {
        parity: basis.parity.clone(),
        from_emission: interface.from_emission.cast(),
        straight: interface.straight.cast(),
        left: interface.left.cast(),
        exchange: interface.exchange.cast(),
        holes: interface.holes.iter().map(Matrix::cast).collect(),
        response_from_lightfield: interface.response_from_lightfield.cast(),
        dropped_energy: basis.dropped_energy as f32,
    }
}

fn pack_sources(emission: &EmissionBasis, response: &ResponseBasis, resolution: usize) -> Sources {
    let walls = 5 * resolution * resolution;
    let samples = rows(&response.basis, walls..response.basis.rows());
    let probes =
        ProbeSamples::default().to_sh(&samples, crate::modular::outputs::cube::PROBE_WEIGHT);
    Sources {
        emission_from_radiosity: emission.from_radiosity.cast(),
        response_basis: stack(&rows(&response.basis, 0..walls), &probes).cast(),
    }
}

fn pack_paths(
    words: Vec<Word>,
    [depth, hole_depth]: [usize; 2],
    emission: &EmissionBasis,
    response: ResponseBasis,
) -> PathTable {
    let mut entries: Vec<PathEntry> = words
        .into_iter()
        .zip(&response.paths)
        .map(|(word, operator)| PathEntry {
            word,
            response_from_emission: operator.cast(),
        })
        .collect();
    entries.sort_by(|a, b| a.word.cmp(&b.word));
    PathTable {
        emission_parity: emission.parity.clone(),
        response_parity: response.parity,
        depth,
        hole_depth,
        entries,
        emission_dropped_energy: emission.dropped_energy as f32,
        response_dropped_energy: response.dropped_energy as f32,
    }
}
