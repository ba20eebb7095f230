//! Error of a frame against a reference file, light by light.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::error_measure::{HOP_GROUPS, rel_l2, rel_l2_by_hop};
use mrt_core::reference::oracle_file::{
    Kind, PROBE_BOUNCES, RGB_BOUNCES, ReferenceError, ReferenceFile,
};
use mrt_runtime::blocks::CellsError;
use mrt_runtime::{
    AssembleConfig, AssembleError, BlockIndex, Bounces, Coupling, Dictionary, Frame, FrameConfig,
    Level, Light, Outputs, ProbeOrder, Scene, SkippedLight,
};
use serde::Serialize;

/// Which bounces a comparison covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComparedBounces {
    /// The first.
    First,
    /// All together.
    All,
}

/// How to compare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompareConfig {
    /// Which bounces to compare.
    pub bounces: ComparedBounces,
    /// Albedo of all walls, for references without their own: in (0, 1], and below 1 for all bounces. `None` is 1 for the
    /// first bounce and 0.5 for all.
    pub albedo: Option<f64>,
    /// How light is taken from block to block.
    pub coupling: Coupling,
    /// Openings that light may cross, at most.
    pub max_depth: usize,
}

impl Default for CompareConfig {
    /// The first bounce, with the path table.
    fn default() -> Self {
        Self {
            bounces: ComparedBounces::First,
            albedo: None,
            coupling: Coupling::Table,
            max_depth: AssembleConfig::default().max_depth,
        }
    }
}

/// Why a comparison failed.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The albedo is one for which bounces do not die out.
    #[error("albedo {found}; expected {expected}")]
    Albedo {
        /// The range.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
    /// The reference is at fault.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The reference's cells are not a level of the dictionary's shapes.
    #[error("{scene}: {source}")]
    Cells {
        /// Name of the reference.
        scene: String,
        /// Why.
        source: CellsError,
    },
    /// The level cannot be assembled.
    #[error("{scene}: {source}")]
    Assemble {
        /// Name of the reference.
        scene: String,
        /// Why.
        source: AssembleError,
    },
    /// A light does not shine.
    #[error("{scene}: {source}")]
    Light {
        /// Name of the reference.
        scene: String,
        /// Why.
        source: SkippedLight,
    },
    /// The reference holds probes and the dictionary has none.
    #[error(
        "{scene}: the reference holds probes, and the dictionary has none; expected one baked with probes"
    )]
    NoProbes {
        /// Name of the reference.
        scene: String,
    },
    /// A probe is outside the level.
    #[error("{scene}: probe {found} is in no block of the level")]
    ProbeOutside {
        /// Name of the reference.
        scene: String,
        /// Where it is, metres.
        found: DVec3,
    },
}

/// Error of one light's indirect irradiance.
#[derive(Clone, Debug, Serialize)]
pub struct LightAccuracy {
    /// Name of the reference.
    pub scene: String,
    /// Index of the light.
    pub light: usize,
    /// "first_bounce" or "all_bounces".
    pub term: &'static str,
    /// Preset of the dictionary.
    pub preset: String,
    /// Relative L2 error over the whole level, as a fraction.
    pub rel_l2: f64,
    /// The same over blocks 0, 1, 2 and 3 or more openings away; `None` where there are none.
    pub rel_l2_by_hop: [Option<f64>; HOP_GROUPS],
}

impl CompareConfig {
    /// Checks the albedo.
    ///
    /// # Errors
    /// [`CompareError::Albedo`].
    pub fn check(&self) -> Result<(), CompareError> {
        let Some(found) = self.albedo else {
            return Ok(());
        };
        let (is_legal, expected) = match self.bounces {
            ComparedBounces::First => (found > 0.0 && found <= 1.0, "above 0, at most 1"),
            ComparedBounces::All => (found > 0.0 && found < 1.0, "above 0 and below 1"),
        };
        if is_legal {
            Ok(())
        } else {
            Err(CompareError::Albedo { expected, found })
        }
    }
}

/// Solves a reference's level for each of its lights and compares.
///
/// # Errors
/// [`CompareError`], if the reference's level or its kind is not supported.
pub fn compare(
    reference: &ReferenceFile,
    dictionary: &Dictionary,
    config: &CompareConfig,
) -> Result<Vec<LightAccuracy>, CompareError> {
    config.check()?;
    let comparison = Comparison {
        reference,
        bounces: config.bounces,
        albedo: albedo(reference, config),
    };
    let mut frame = comparison.frame(dictionary, config)?;
    let lights = 0..reference.lights.len();
    let error_of = |light| {
        comparison.solve(&mut frame, light)?;
        let theirs = comparison.reference_signal(light)?;
        let ours = comparison.frame_signal(&frame)?;
        let by_hop = match comparison.has_probes() {
            true => [None; HOP_GROUPS],
            false => rel_l2_by_hop(&ours, &theirs, &reference.hops(light)?),
        };
        Ok(LightAccuracy {
            scene: reference.name.clone(),
            light,
            term: match config.bounces {
                ComparedBounces::First => "first_bounce",
                ComparedBounces::All => "all_bounces",
            },
            preset: dictionary.preset.clone(),
            rel_l2: rel_l2(&ours, &theirs),
            rel_l2_by_hop: by_hop,
        })
    };
    lights.map(error_of).collect()
}

/// Albedo of walls to which the reference gives no colour of their own.
fn albedo(reference: &ReferenceFile, config: &CompareConfig) -> f64 {
    match (&reference.kind, config.bounces, config.albedo) {
        // All bounces of probe references have an albedo of their own.
        (Kind::RadianceSh9 { albedo, .. }, ComparedBounces::All, _) => *albedo,
        (_, _, Some(albedo)) => albedo,
        (_, ComparedBounces::First, None) => 1.0,
        (_, ComparedBounces::All, None) => 0.5,
    }
}

/// A reference, and what of it is compared.
struct Comparison<'a> {
    reference: &'a ReferenceFile,
    bounces: ComparedBounces,
    albedo: f64,
}

impl Comparison<'_> {
    fn scene_name(&self) -> String {
        self.reference.name.clone()
    }

    fn has_probes(&self) -> bool {
        matches!(self.reference.kind, Kind::RadianceSh9 { .. })
    }

    /// A frame of the reference's level.
    fn frame(
        &self,
        dictionary: &Dictionary,
        config: &CompareConfig,
    ) -> Result<Frame, CompareError> {
        let assemble_config = AssembleConfig {
            coupling: config.coupling,
            max_depth: config.max_depth,
            ..AssembleConfig::default()
        };
        let scene =
            Scene::assemble(&self.level()?, dictionary, &assemble_config).map_err(|source| {
                CompareError::Assemble {
                    scene: self.scene_name(),
                    source,
                }
            })?;
        let outputs = Outputs {
            lightmap: true,
            probes: self.has_probes().then_some(ProbeOrder::L2),
            vector: false,
        };
        let frame_config = FrameConfig {
            outputs,
            bounces: self.frame_bounces(),
            ..FrameConfig::default()
        };
        Ok(Frame::new(&scene, frame_config))
    }

    /// The reference's level with its own wall colours, or one albedo everywhere.
    fn level(&self) -> Result<Level, CompareError> {
        let uniform = Vec3::splat(self.albedo as f32);
        let mut level = Level::from_cells(&self.reference.cells, uniform).map_err(|source| {
            CompareError::Cells {
                scene: self.scene_name(),
                source,
            }
        })?;
        if let Kind::IrradianceRgb { albedo } = &self.reference.kind {
            for (&(cell, face), colour) in self.reference.walls.iter().zip(albedo) {
                let colour = Vec3::from_array(colour.map(|c| c as f32));
                level.blocks[cell].albedo[face.index()] = colour;
            }
        }
        Ok(level)
    }

    fn frame_bounces(&self) -> Bounces {
        match (self.bounces, &self.reference.kind) {
            (ComparedBounces::First, _) => Bounces::Count(1),
            // Files of coloured walls and of probes stop after a stated number of bounces.
            (_, Kind::RadianceSh9 { .. }) => Bounces::Count(PROBE_BOUNCES as u32),
            (_, Kind::IrradianceRgb { .. }) => Bounces::Count(RGB_BOUNCES as u32),
            _ => Bounces::Converged {
                tolerance: 1e-6,
                limit: 2000,
            },
        }
    }

    /// Solves the frame with one of the reference's lights.
    fn solve(&self, frame: &mut Frame, light: usize) -> Result<(), CompareError> {
        frame.set_lights(&[Light::Sphere {
            position: self.reference.lights[light].as_vec3(),
            radius: 0.0,
            intensity: Vec3::splat(self.reference.intensity as f32),
        }]);
        let report = frame.solve();
        report
            .require_all_lights()
            .map_err(|source| CompareError::Light {
                scene: self.scene_name(),
                source,
            })
    }

    /// The reference's indirect irradiance, or radiance at probes; channels together.
    fn reference_signal(&self, light: usize) -> Result<Vec<f64>, ReferenceError> {
        let bounces = match self.bounces {
            ComparedBounces::First => ReferenceBounces::First,
            ComparedBounces::All => ReferenceBounces::All,
        };
        let reference = self.reference;
        match reference.kind {
            Kind::IrradianceRgb { .. } => {
                let rgb = reference.indirect_irradiance_rgb(light, bounces)?;
                Ok(rgb.as_flattened().to_vec())
            }
            Kind::RadianceSh9 { .. } => {
                reference.term(light, usize::from(self.bounces == ComparedBounces::All))
            }
            _ => reference.indirect_irradiance(light, bounces, self.albedo),
        }
    }

    /// The frame's light in the reference's order of places and channels.
    fn frame_signal(&self, frame: &Frame) -> Result<Vec<f64>, CompareError> {
        match &self.reference.kind {
            Kind::RadianceSh9 { points, .. } => self.frame_probes(frame, points),
            Kind::IrradianceRgb { .. } => Ok(self.frame_irradiance(frame, 3)),
            _ => Ok(self.frame_irradiance(frame, 1)),
        }
    }

    /// Indirect irradiance at the reference's texel centres.
    ///
    /// It is looked up in the lightmap as a game does, so dictionaries of any resolution can be compared. At the
    /// reference's own resolution the lookup returns the texels.
    fn frame_irradiance(&self, frame: &Frame, channels: usize) -> Vec<f64> {
        let scene = frame.scene();
        let resolution = self.reference.resolution.unwrap_or(scene.level.resolution);
        let mut ours = Vec::new();
        for &(block, face) in &self.reference.walls {
            for texel in 0..resolution * resolution {
                let (row, column) = (texel / resolution, texel % resolution);
                let light = light_at(
                    frame,
                    block,
                    face,
                    face.texel_center(resolution, row, column),
                );
                ours.extend(light[..channels].iter().map(|&e| f64::from(e)));
            }
        }
        ours
    }

    /// Incident radiance at the reference's points, nine coefficients each.
    fn frame_probes(&self, frame: &Frame, points: &[DVec3]) -> Result<Vec<f64>, CompareError> {
        let probes = frame.probes().ok_or_else(|| CompareError::NoProbes {
            scene: self.scene_name(),
        })?;
        let mut ours = Vec::with_capacity(9 * points.len());
        for &point in points {
            let light = probes.at(&frame.scene().level, point);
            let light = light.ok_or_else(|| CompareError::ProbeOutside {
                scene: self.scene_name(),
                found: point,
            })?;
            ours.extend(light.iter().map(|rgb| f64::from(rgb[0])));
        }
        Ok(ours)
    }
}

/// The lightmap at a point of a wall, both in the level's turned cube.
fn light_at(frame: &Frame, block: usize, face: Face, point: DVec3) -> [f32; 3] {
    let scene = frame.scene();
    let canonical = scene.level.blocks[block].orientation.inverse();
    let (point, face) = (canonical.point(point), canonical.face(face));
    let (u, v) = (point[face.u_axis()] as f32, point[face.v_axis()] as f32);
    // Walls of the reference are walls of the level, since both follow from the cells.
    let pixel = scene.atlas.pixel(BlockIndex::new(block), face, u, v);
    pixel.map_or([0.0; 3], |pixel| {
        scene.atlas.sample(frame.lightmap().pixels(), pixel)
    })
}
