//! The bake: from canonical shapes to a dictionary, a list of calls.
//!
//! 1. F, the one-bounce operator of the closed cube.
//! 2. The light that goes on through openings into the next block.
//! 3. For each shape: light prior, reduced transport.
//! 4. The emission basis of all that the shapes send.
//! 5. The response basis of all that arrives, and the operator of each path.
//! 6. For each shape: the joint basis, and the operators of its openings.
//! 7. Lightfields at the openings: their basis, and the operators between openings.

use crate::config::BakeConfig;
use crate::matrix_parts::{rows, stack};
use crate::modular::bake_tubes::bake_tubes;
use crate::modular::joint::{JointBasis, JointInput, OwnLight, joint_basis};
use crate::modular::lightfield::basis::{lightfield_basis, lightfield_coefficients};
use crate::modular::lightfield::grid::LightfieldGrid;
use crate::modular::lightfield::interface::cube::{
    emitted_lightfield, enriched_basis, interface_operators,
};
use crate::modular::lightfield::wall_response::cube::wall_response;
use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
use crate::modular::outputs::cube::{probe_operator, vector_irradiance};
use crate::modular::outputs::probe_samples::{PROBE_WEIGHT, ProbeSamples};
use crate::modular::paths::arrival::arriving_light;
use crate::modular::paths::emission::{EmissionBasis, emission_basis, emitter_radiosity};
use crate::modular::paths::ends::RECEIVER;
use crate::modular::paths::response::{ResponseBasis, ResponseConfig, response_basis};
use crate::modular::shape_set::ShapeSet;
use crate::modular::surface::mirrors::cube::output_parity_classes;
use crate::modular::surface::output_grid::OutputGrid;
use crate::modular::transport::cube::{neighbours, shape_transport};
use crate::modular::transport::modes::BlockTransport;
use crate::progress::{Cancelled, Progress, Steps};
use mrt_core::linalg::matrix::{Matrix, multiply, transpose_multiply};
use mrt_runtime::Dictionary;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::shape_set;
use mrt_runtime::low_level::modular::dictionary::{
    LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators, Sources,
};
use mrt_runtime::low_level::modular::path::Word;

/// Bakes a set of shapes with settings that pass [`BakeConfig::check`]. The same settings give the same bits
/// on every machine and thread count.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn bake(config: &BakeConfig, progress: &Progress) -> Result<Dictionary, Cancelled> {
    let shapes = shape_set(&config.shapes).unwrap_or_default();
    if shapes.iter().any(|shape| shape.tube().is_some()) {
        return bake_tubes(config, &shapes, progress);
    }
    let set = ShapeSet::of(shapes);
    let count = 2 * set.shapes.len() + 6 + config.lightfield.enrichment_rounds;
    let mut steps = Steps::new(progress, count);

    steps.start("one-bounce operator")?;
    let closed = closed_cube_bounce(config.resolution, Reconstruction::Constant, progress)?;

    steps.start("light beyond openings")?;
    let neighbours = neighbours(config, &set.outlines);

    let mut transports = Vec::with_capacity(set.shapes.len());
    for shape in &set.shapes {
        steps.start(shape.name)?;
        transports.push(shape_transport(shape, &closed, &neighbours, config));
    }

    steps.start("paths through openings")?;
    let emission = emission(&set, &transports, config);
    let words = PathWords::of(&set, config);
    let response_config = ResponseConfig {
        grid: OutputGrid::of(config),
        modes: config.coupling.response_modes,
        has_exchanges: set.has_exchanges,
    };
    let response = response_basis(&words.words, &emission, &response_config, progress)?;

    let packing = Packing {
        config,
        set: &set,
        emission: &emission,
        response: &response,
    };
    let mut entries = Vec::with_capacity(set.shapes.len());
    for (&shape, transport) in set.shapes.iter().zip(&transports) {
        steps.start(shape.name)?;
        entries.push(packing.shape(shape, transport));
    }

    let lightfields = packing.lightfields(&mut steps, progress)?;
    Ok(Dictionary {
        preset: config.preset.clone(),
        settings: config.describe(),
        resolution: config.resolution,
        probes: config.outputs.probes,
        shapes: entries,
        variants: Vec::new(),
        lightfields,
        sources: Some(packing.sources()),
        paths: packing.paths(words),
    })
}

/// The emission basis of all that the shapes send.
fn emission(set: &ShapeSet, transports: &[BlockTransport], config: &BakeConfig) -> EmissionBasis {
    let resolution = config.resolution;
    let mut sent = Vec::new();
    for (shape, transport) in set.shapes.iter().zip(transports) {
        let radiosity = &transport.implicit_lighting;
        for opening in shape.openings.iter().filter(|_| radiosity.columns() > 0) {
            for &frame in set.frames() {
                let face = opening.face;
                sent.push(emitter_radiosity(shape, face, frame, radiosity, resolution));
            }
        }
    }
    emission_basis(&sent, resolution, config.coupling.emission_modes)
}

/// The words of a table of paths.
struct PathWords {
    words: Vec<Word>,
    depth: usize,
    hole_depth: usize,
}

impl PathWords {
    fn of(set: &ShapeSet, config: &BakeConfig) -> Self {
        let depth = config.coupling.depth;
        let hole_depth = if set.holes.is_empty() {
            0
        } else {
            config.coupling.hole_depth
        };
        Self {
            words: Word::all(depth, hole_depth, &set.holes, set.has_exchanges),
            depth,
            hole_depth,
        }
    }
}

/// What the parts of the dictionary are made from.
struct Packing<'a> {
    config: &'a BakeConfig,
    set: &'a ShapeSet,
    emission: &'a EmissionBasis,
    response: &'a ResponseBasis,
}

impl Packing<'_> {
    /// The operators of one shape: its joint basis and its openings.
    fn shape(&self, shape: &'static Shape, transport: &BlockTransport) -> ShapeOperators {
        let joint = self.joint(shape, transport);
        let modes = transport.implicit_lighting.columns();
        let singular_values = transport.singular_values[..modes].iter();
        ShapeOperators {
            shape,
            coefficients_from_direct: transport.coefficients_from_direct.cast(),
            joint_basis: joint.irradiance.cast(),
            probe_basis: joint.probes.cast(),
            vector_basis: joint.vector.cast(),
            openings: self.openings(shape, &transport.implicit_lighting, &joint),
            implicit_lighting: transport.implicit_lighting.cast(),
            singular_values: singular_values.map(|&s| s as f32).collect(),
            dropped_energy: transport.dropped_energy as f32,
            joint_dropped_energy: joint.dropped_energy as f32,
        }
    }

    fn joint(&self, shape: &Shape, transport: &BlockTransport) -> JointBasis {
        let grid = OutputGrid::of(self.config);
        let OutputGrid {
            resolution, probes, ..
        } = grid;
        let radiosity = &transport.implicit_lighting;
        let operator = probe_operator(shape, resolution, probes);
        let own = OwnLight {
            irradiance: transport.indirect_basis.clone(),
            probes: multiply(operator.view(), radiosity.view()),
            vector: if grid.vector {
                vector_irradiance(shape, resolution, radiosity)
            } else {
                Matrix::zeros(0, radiosity.columns())
            },
        };
        let frames = self.set.frames();
        joint_basis(JointInput {
            own: &own,
            arriving: arriving_light(shape, frames, self.response, &grid),
            frames: frames.len(),
            scales: &self.response.scales,
            classes: &output_parity_classes(shape, resolution, probes),
            extra_modes: self.config.coupling.foreign_modes,
        })
    }

    fn openings(
        &self,
        shape: &Shape,
        radiosity: &Matrix<f64>,
        joint: &JointBasis,
    ) -> Vec<OpeningOperators> {
        let resolution = self.config.resolution;
        let openings = shape.openings.iter().zip(&joint.joint_from_response);
        openings
            .map(|(opening, joint_from_response)| {
                let emission = self.set.frames().iter().map(|&frame| {
                    let face = opening.face;
                    let sent = emitter_radiosity(shape, face, frame, radiosity, resolution);
                    multiply(self.emission.from_radiosity.view(), sent.view()).cast()
                });
                OpeningOperators {
                    emission_from_coefficients: emission.collect(),
                    joint_from_response: joint_from_response.iter().map(Matrix::cast).collect(),
                }
            })
            .collect()
    }

    /// The basis of the lightfields at openings, and the operators on them.
    fn lightfields(
        &self,
        steps: &mut Steps,
        progress: &Progress,
    ) -> Result<LightfieldOperators, Cancelled> {
        let (config, response) = (&self.config.lightfield, self.response);
        steps.start("lightfields at the openings")?;
        let grid = LightfieldGrid::on_squares(config);
        let radiosity = &self.emission.radiosity;
        let emitted = emitted_lightfield(&grid, radiosity, self.config.resolution);
        let scaled = emitted.scaled_columns(&self.emission.scales);
        let mut basis = lightfield_basis(&grid, &[scaled], config.lightfield_modes, progress)?;
        for _ in 0..config.enrichment_rounds {
            steps.start("lightfield enrichment")?;
            basis = enriched_basis(&grid, &basis, config, self.set.has_exchanges, progress)?;
        }
        steps.start("lightfield operators")?;
        let interface = interface_operators(&grid, &basis, self.set, progress)?;
        let walls = wall_response(&grid, &basis.vectors, &OutputGrid::of(self.config));
        let from_lightfield = transpose_multiply(response.basis.view(), walls.view());
        Ok(LightfieldOperators {
            from_emission: lightfield_coefficients(&basis, &emitted).cast(),
            straight: interface.straight.cast(),
            left: interface.left.cast(),
            exchange: interface.exchange.cast(),
            holes: interface.holes.iter().map(Matrix::cast).collect(),
            response_from_lightfield: from_lightfield.cast(),
            dropped_energy: basis.dropped_energy as f32,
            parity: basis.parity,
        })
    }

    /// What operators of warped blocks are computed from later.
    fn sources(&self) -> Sources {
        let basis = &self.response.basis;
        let walls = RECEIVER.texel_count(self.config.resolution);
        let samples = rows(basis, walls..basis.rows());
        let probes = ProbeSamples::default().to_sh(&samples, PROBE_WEIGHT);
        Sources {
            emission_from_radiosity: self.emission.from_radiosity.cast(),
            response_basis: stack(&[&rows(basis, 0..walls), &probes]).cast(),
        }
    }

    fn paths(&self, words: PathWords) -> PathTable {
        let (emission, response) = (self.emission, self.response);
        let operators = words.words.into_iter().zip(&response.paths);
        let mut entries: Vec<PathEntry> = operators
            .map(|(word, operator)| PathEntry {
                word,
                response_from_emission: operator.cast(),
            })
            .collect();
        entries.sort_by(|a, b| a.word.cmp(&b.word));
        PathTable {
            emission_parity: emission.parity.clone(),
            response_parity: response.parity.clone(),
            depth: words.depth,
            hole_depth: words.hole_depth,
            entries,
            emission_dropped_energy: emission.dropped_energy as f32,
            response_dropped_energy: response.dropped_energy as f32,
        }
    }
}
