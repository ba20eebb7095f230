//! The bake of tubes: the stages of [`crate::modular::bake`] in the geometry of round walls and openings, as a dictionary
//! of the same form.
//!
//! 1. For each tube: one bounce, light prior, reduced transport.
//! 2. The basis of the lightfields at the openings, and the operators between openings.
//! 3. For each tube: the joint basis, and the operators of its openings.
//!
//! Light goes from tube to tube by lightfields alone, because there would be as many paths as tunnels. So the modes that
//! tubes send are the lightfield modes themselves, and so are the modes that they answer to: what each texel
//! does with a lightfield goes into the joint basis of its shape directly.

use crate::config::BakeConfig;
use crate::modular::joint::{JointBasis, JointInput, OwnLight, joint_basis};
use crate::modular::lightfield::basis::{lightfield_basis, lightfield_coefficients};
use crate::modular::lightfield::grid::LightfieldGrid;
use crate::modular::lightfield::interface::tube::{
    TubeInterface, tube_emitted_lightfield, tube_enriched_basis, tube_interface,
};
use crate::modular::lightfield::symmetries::exchanged;
use crate::modular::lightfield::wall_response::tube::tube_wall_response;
use crate::modular::paths::arrival::ArrivingLight;
use crate::modular::surface::area_weights::AreaWeights;
use crate::modular::surface::mirrors::tube::tube_parity_classes;
use crate::modular::surface::walls::tube::TubeWall;
use crate::modular::transport::modes::BlockTransport;
use crate::modular::transport::tube::tube_transport;
use crate::progress::{Cancelled, Progress, Steps};
use mrt_core::geometry::cube::Face;
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
    wall: TubeWall,
    transport: BlockTransport,
}

/// Bakes tubes with settings that pass [`BakeConfig::check`]; shapes that are no tubes are left out. The same settings
/// give the same bits on every machine and thread count.
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn bake_tubes(
    config: &BakeConfig,
    shapes: &[&'static Shape],
    progress: &Progress,
) -> Result<Dictionary, Cancelled> {
    let count = 2 * shapes.len() + 2 + config.lightfield.enrichment_rounds;
    let mut steps = Steps::new(progress, count);

    let mut tubes = Vec::with_capacity(shapes.len());
    for &shape in shapes {
        let Some(form) = shape.tube() else { continue };
        steps.start(shape.name)?;
        let wall = TubeWall::new(form, config.resolution);
        tubes.push(Tube {
            shape,
            transport: tube_transport(&wall, config, progress)?,
            wall,
        });
    }

    steps.start("lightfields at the openings")?;
    let grid = LightfieldGrid::on_discs(&config.lightfield);
    let basis = lightfields(&grid, &tubes, config, &mut steps, progress)?;
    steps.start("lightfield operators")?;
    let interface = tube_interface(&grid, &basis, progress)?;

    let packing = Packing {
        config,
        exchanged: exchanged(&grid, &basis.vectors),
        grid,
        basis,
    };
    let mut entries = Vec::with_capacity(tubes.len());
    for tube in &tubes {
        steps.start(tube.shape.name)?;
        entries.push(packing.shape(tube, progress)?);
    }
    Ok(Dictionary {
        preset: config.preset.clone(),
        settings: config.describe(),
        resolution: config.resolution,
        probes: 0,
        shapes: entries,
        variants: Vec::new(),
        lightfields: packing.lightfields(&interface),
        sources: None,
        paths: packing.no_paths(),
    })
}

/// The basis of the lightfields that the tubes send, and of what passing through tubes makes of these.
fn lightfields(
    grid: &LightfieldGrid,
    tubes: &[Tube],
    config: &BakeConfig,
    steps: &mut Steps,
    progress: &Progress,
) -> Result<ParityBasis, Cancelled> {
    let mut sent = Vec::new();
    for tube in tubes {
        progress.check()?;
        // What leaves by the other opening is the mirror image of this, and has the same part in each parity class but for
        // its sign.
        let opening = tube.wall.form.openings()[0];
        sent.push(emitted(grid, tube, opening));
    }
    let config = &config.lightfield;
    let mut basis = lightfield_basis(grid, &sent, config.lightfield_modes, progress)?;
    for _ in 0..config.enrichment_rounds {
        steps.start("lightfield enrichment")?;
        basis = tube_enriched_basis(grid, &basis, config, progress)?;
    }
    Ok(basis)
}

/// The lightfields that leave by an opening when the tube's walls emit the implicit lighting of its modes.
fn emitted(grid: &LightfieldGrid, tube: &Tube, opening: Face) -> Matrix<f64> {
    tube_emitted_lightfield(grid, &tube.wall, opening, &tube.transport.implicit_lighting)
}

/// What the parts of the dictionary are made from.
struct Packing<'a> {
    config: &'a BakeConfig,
    grid: LightfieldGrid,
    basis: ParityBasis,
    /// The vectors of the basis with u and v exchanged.
    exchanged: Matrix<f64>,
}

impl Packing<'_> {
    /// The operators of one tube: its joint basis and its openings.
    fn shape(&self, tube: &Tube, progress: &Progress) -> Result<ShapeOperators, Cancelled> {
        let weights = AreaWeights::of_tube(&tube.wall);
        let joint = self.joint(tube, &weights, progress)?;
        let transport = &tube.transport;
        let modes = transport.implicit_lighting.columns();
        let singular_values = transport.singular_values[..modes].iter();
        Ok(ShapeOperators {
            shape: tube.shape,
            coefficients_from_direct: transport.coefficients_from_direct.cast(),
            joint_basis: weights.unweigh(&joint.irradiance).cast(),
            probe_basis: joint.probes.cast(),
            vector_basis: joint.vector.cast(),
            openings: self.openings(tube, &joint),
            implicit_lighting: transport.implicit_lighting.cast(),
            singular_values: singular_values.map(|&s| s as f32).collect(),
            dropped_energy: transport.dropped_energy as f32,
            joint_dropped_energy: joint.dropped_energy as f32,
        })
    }

    /// The joint basis of one tube, between signals weighted by area.
    fn joint(
        &self,
        tube: &Tube,
        weights: &AreaWeights,
        progress: &Progress,
    ) -> Result<JointBasis, Cancelled> {
        let mut arriving = Vec::with_capacity(4);
        for opening in tube.wall.form.openings() {
            for fields in [&self.basis.vectors, &self.exchanged] {
                progress.check()?;
                let response = tube_wall_response(&self.grid, fields, &tube.wall, opening);
                arriving.push(ArrivingLight {
                    outputs: weights.weigh(&response),
                    vector: Matrix::zeros(0, response.columns()),
                });
            }
        }
        let modes = tube.transport.implicit_lighting.columns();
        let own = OwnLight {
            irradiance: weights.weigh(&tube.transport.indirect_basis),
            probes: Matrix::zeros(0, modes),
            vector: Matrix::zeros(0, modes),
        };
        Ok(joint_basis(JointInput {
            own: &own,
            arriving,
            frames: 2,
            scales: &self.basis.scales,
            classes: &tube_parity_classes(&tube.wall),
            extra_modes: self.config.coupling.foreign_modes,
        }))
    }

    fn openings(&self, tube: &Tube, joint: &JointBasis) -> Vec<OpeningOperators> {
        let openings = tube.wall.form.openings();
        let openings = openings.iter().zip(&joint.joint_from_response);
        openings
            .map(|(&opening, joint_from_response)| {
                let sent = emitted(&self.grid, tube, opening);
                let exchanged = exchanged(&self.grid, &sent);
                let emission = [&sent, &exchanged]
                    .map(|fields| lightfield_coefficients(&self.basis, fields).cast());
                OpeningOperators {
                    emission_from_coefficients: emission.to_vec(),
                    joint_from_response: joint_from_response.iter().map(Matrix::cast).collect(),
                }
            })
            .collect()
    }

    /// The operators on lightfields. Emission and response modes are the lightfield modes themselves.
    fn lightfields(&self, interface: &TubeInterface) -> LightfieldOperators {
        let identity = Matrix::identity(self.basis.vectors.columns());
        LightfieldOperators {
            parity: self.basis.parity.clone(),
            from_emission: identity.clone(),
            straight: interface.straight.cast(),
            left: interface.left.cast(),
            exchange: lightfield_coefficients(&self.basis, &self.exchanged).cast(),
            holes: Vec::new(),
            response_from_lightfield: identity,
            dropped_energy: self.basis.dropped_energy as f32,
        }
    }

    /// A table of paths without any.
    fn no_paths(&self) -> PathTable {
        PathTable {
            depth: 0,
            hole_depth: 0,
            emission_parity: self.basis.parity.clone(),
            response_parity: self.basis.parity.clone(),
            entries: Vec::new(),
            emission_dropped_energy: 0.0,
            response_dropped_energy: 0.0,
        }
    }
}
