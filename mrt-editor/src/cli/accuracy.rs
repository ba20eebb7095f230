//! `mrt accuracy`: error of the reduced solution against reference files.

use crate::cli::dictionary_source::{
    DEFAULT_PRESET, DEFAULT_SET, SourceError, from_file, from_preset,
};
use crate::cli::table::Table;
use glam::{DVec3, Vec3};
use mrt_core::reference::error_measure::{HOP_GROUPS, rel_l2, rel_l2_by_hop};
use mrt_core::reference::oracle_file::{
    Kind, PROBE_BOUNCES, RGB_BOUNCES, ReferenceError, ReferenceFile, read,
};
use mrt_dictionary::config::BakeConfig;
use mrt_runtime::BlockIndex;
use mrt_runtime::FrameConfig;
use mrt_runtime::SkippedLight;
use mrt_runtime::blocks::CellsError;
use mrt_runtime::{
    AssembleConfig, AssembleError, Bounces, Coupling, Dictionary, Frame, Level, Light, Outputs,
    ProbeOrder, Scene,
};
use serde::Serialize;
use std::path::PathBuf;

/// Compares solved levels with reference solutions, light by light.
#[derive(Clone, Debug, clap::Args)]
pub struct AccuracyArgs {
    /// Reference descriptions, each with its numbers beside it in a file of the same name ending in .f32.
    #[arg(required = true, value_name = "REF.json")]
    pub references: Vec<PathBuf>,
    /// Dictionary preset: mobile, standard, high or quality; all but standard are baked first.
    #[arg(long)]
    pub preset: Option<String>,
    /// Set of shapes of the preset [default: cubes-2d, and cubes-3d for references with cells one above another].
    #[arg(long)]
    pub set: Option<String>,
    /// Dictionary file, instead of a preset.
    #[arg(long, conflicts_with_all = ["preset", "set"])]
    pub dictionary: Option<PathBuf>,
    /// Which bounces to compare.
    #[arg(long, value_enum, default_value = "first")]
    pub bounces: BouncesArg,
    /// Albedo of all walls, for references without their own [default: 1 for the first bounce, 0.5 for
    /// all].
    #[arg(long)]
    pub albedo: Option<f64>,
    /// Openings that light may cross, at most.
    #[arg(long, default_value_t = AssembleConfig::default().max_depth)]
    pub max_depth: usize,
    /// How light is taken from block to block.
    #[arg(long, value_enum, default_value = "table")]
    pub coupling: CouplingArg,
    /// Print one JSON object a line: scene, light, term, preset, rel_l2, rel_l2_by_hop.
    #[arg(long)]
    pub json: bool,
}

/// How light is taken from block to block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CouplingArg {
    /// By the operator of each whole path of openings.
    Table,
    /// By lightfields passed on from opening to opening, as in the paper.
    Lightfield,
}

impl From<CouplingArg> for Coupling {
    fn from(arg: CouplingArg) -> Self {
        match arg {
            CouplingArg::Table => Coupling::Table,
            CouplingArg::Lightfield => Coupling::Lightfield,
        }
    }
}

/// Which bounces a comparison covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum BouncesArg {
    /// The first.
    First,
    /// All together.
    All,
}

/// Why a comparison failed.
#[derive(Debug, thiserror::Error)]
pub enum AccuracyError {
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
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
    /// A light is refused.
    #[error("{scene}: {source}")]
    Light {
        /// Name of the reference.
        scene: String,
        /// Why.
        source: SkippedLight,
    },
    /// Probe references need probes.
    #[error(
        "{scene}: the reference holds probes, and the dictionary has none; expected one baked with probes"
    )]
    NoProbes {
        /// Name of the reference.
        scene: String,
    },
    /// A probe outside the level.
    #[error("{scene}: probe {found} is in no block of the level")]
    ProbeOutside {
        /// Name of the reference.
        scene: String,
        /// Where it is.
        found: DVec3,
    },
    /// An albedo for which bounces do not die out.
    #[error("albedo {found}; expected {expected}")]
    Albedo {
        /// The range.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
    /// Some references could not be compared; the others were.
    #[error("{failed} of {count} references could not be compared (see above)")]
    Some {
        /// How many.
        failed: usize,
        /// Of how many.
        count: usize,
    },
    /// A line has no form as JSON.
    #[error("the report cannot be printed: {0}")]
    Report(#[from] serde_json::Error),
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
    /// The same over blocks 0, 1, 2 and 3 or more openings away; none where there are none.
    pub rel_l2_by_hop: [Option<f64>; HOP_GROUPS],
}

/// Compares all references and prints; one that fails is reported and the others still run.
///
/// # Errors
/// [`AccuracyError`].
pub fn run(args: &AccuracyArgs) -> Result<(), AccuracyError> {
    check_albedo(args)?;
    let mut dictionaries = Dictionaries::new(args)?;
    let mut all = Vec::new();
    let mut failed = 0;
    for path in &args.references {
        let result = match read(path) {
            Err(error) => Err(AccuracyError::from(error)),
            Ok(reference) => {
                // Without a dictionary nothing can be compared.
                let dictionary = dictionaries.of(&reference)?;
                compare(&reference, dictionary, args)
            }
        };
        match result {
            Err(error) => {
                eprintln!("mrt: {error}");
                failed += 1;
            }
            Ok(lights) => {
                if args.json {
                    for light in &lights {
                        crate::report_line!("{}", serde_json::to_string(light)?);
                    }
                }
                all.extend(lights);
            }
        }
    }
    if !args.json && !all.is_empty() {
        print(&all);
    }
    match failed {
        0 => Ok(()),
        failed => Err(AccuracyError::Some {
            failed,
            count: args.references.len(),
        }),
    }
}

/// The dictionaries of a comparison; those of a preset are made when a reference first needs them.
struct Dictionaries<'a> {
    args: &'a AccuracyArgs,
    /// By set of shapes; a file's stands for all.
    loaded: Vec<(String, Dictionary)>,
}

/// The set for levels that open upwards.
const VERTICAL_SET: &str = "cubes-3d";

impl<'a> Dictionaries<'a> {
    /// Reads the file or checks the preset's name, so that neither fails later.
    fn new(args: &'a AccuracyArgs) -> Result<Self, SourceError> {
        let mut loaded = Vec::new();
        if let Some(file) = &args.dictionary {
            loaded.push((DEFAULT_SET.to_owned(), from_file(file)?));
        } else {
            let mut config = BakeConfig::preset(args.preset.as_deref().unwrap_or(DEFAULT_PRESET))?;
            config.shapes = args.set.clone().unwrap_or(config.shapes);
            config.check()?;
        }
        Ok(Self { args, loaded })
    }

    fn of(&mut self, reference: &ReferenceFile) -> Result<&Dictionary, SourceError> {
        let set = match (&self.args.dictionary, &self.args.set) {
            (None, Some(set)) => set.as_str(),
            (None, None) if opens_upwards(&reference.cells) => VERTICAL_SET,
            _ => DEFAULT_SET,
        };
        let position = match self.loaded.iter().position(|(name, _)| name == set) {
            Some(position) => position,
            None => {
                let dictionary = from_preset(set, self.args.preset.as_deref())?;
                self.loaded.push((set.to_owned(), dictionary));
                self.loaded.len() - 1
            }
        };
        Ok(&self.loaded[position].1)
    }
}

/// True when some cell stands on another.
fn opens_upwards(cells: &[[i32; 3]]) -> bool {
    cells
        .iter()
        .any(|&[x, y, z]| y.checked_add(1).is_some_and(|y| cells.contains(&[x, y, z])))
}

fn check_albedo(args: &AccuracyArgs) -> Result<(), AccuracyError> {
    let (legal, expected) = match (args.bounces, args.albedo) {
        (_, None) => (true, ""),
        (BouncesArg::First, Some(albedo)) => (albedo > 0.0 && albedo <= 1.0, "above 0, at most 1"),
        (BouncesArg::All, Some(albedo)) => (albedo > 0.0 && albedo < 1.0, "above 0 and below 1"),
    };
    match args.albedo {
        Some(found) if !legal => Err(AccuracyError::Albedo { expected, found }),
        _ => Ok(()),
    }
}

/// Solves a reference's level for each of its lights and compares.
///
/// # Errors
/// [`AccuracyError`], if the reference's level or its kind is not supported.
pub fn compare(
    reference: &ReferenceFile,
    dictionary: &Dictionary,
    args: &AccuracyArgs,
) -> Result<Vec<LightAccuracy>, AccuracyError> {
    let scene_name = || reference.name.clone();
    let albedo = match (&reference.kind, args.bounces, args.albedo) {
        // All bounces of probe references have an albedo of their own.
        (Kind::RadianceSh9 { albedo, .. }, BouncesArg::All, _) => *albedo,
        (_, _, Some(albedo)) => albedo,
        (_, BouncesArg::First, None) => 1.0,
        (_, BouncesArg::All, None) => 0.5,
    };
    let level = level(reference, albedo)?;
    let config = AssembleConfig {
        coupling: args.coupling.into(),
        max_depth: args.max_depth,
        ..AssembleConfig::default()
    };
    let scene =
        Scene::assemble(&level, dictionary, &config).map_err(|source| AccuracyError::Assemble {
            scene: scene_name(),
            source,
        })?;
    let is_probes = matches!(reference.kind, Kind::RadianceSh9 { .. });
    let outputs = Outputs {
        lightmap: true,
        probes: is_probes.then_some(ProbeOrder::L2),
        vector: false,
    };
    let config = FrameConfig {
        outputs,
        bounces: frame_bounces(reference, args),
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    (0..reference.lights.len())
        .map(|light| {
            let source = Light::Sphere {
                position: reference.lights[light].as_vec3(),
                radius: 0.0,
                intensity: Vec3::splat(reference.intensity as f32),
            };
            frame.set_lights(&[source]);
            frame
                .solve()
                .require_all_lights()
                .map_err(|source| AccuracyError::Light {
                    scene: scene_name(),
                    source,
                })?;
            let theirs = reference_signal(reference, light, albedo, args)?;
            let ours = our_signal(reference, &scene, &frame)?;
            Ok(LightAccuracy {
                scene: scene_name(),
                light,
                term: match args.bounces {
                    BouncesArg::First => "first_bounce",
                    BouncesArg::All => "all_bounces",
                },
                preset: dictionary.preset.clone(),
                rel_l2: rel_l2(&ours, &theirs),
                rel_l2_by_hop: if is_probes {
                    [None; HOP_GROUPS]
                } else {
                    rel_l2_by_hop(&ours, &theirs, &reference.hops(light)?)
                },
            })
        })
        .collect()
}

/// The reference's level with its own wall colours, or `albedo` everywhere.
fn level(reference: &ReferenceFile, albedo: f64) -> Result<Level, AccuracyError> {
    let uniform = Vec3::splat(albedo as f32);
    let mut level =
        Level::from_cells(&reference.cells, uniform).map_err(|source| AccuracyError::Cells {
            scene: reference.name.clone(),
            source,
        })?;
    if let Kind::IrradianceRgb { albedo } = &reference.kind {
        for (&(cell, face), colour) in reference.walls.iter().zip(albedo) {
            level.blocks[cell].albedo[face.index()] = Vec3::from_array(colour.map(|c| c as f32));
        }
    }
    Ok(level)
}

fn frame_bounces(reference: &ReferenceFile, args: &AccuracyArgs) -> Bounces {
    match (args.bounces, &reference.kind) {
        (BouncesArg::First, _) => Bounces::Count(1),
        (BouncesArg::All, Kind::RadianceSh9 { .. }) => Bounces::Count(PROBE_BOUNCES as u32),
        // Coloured references stop after a stated number of bounces.
        (BouncesArg::All, Kind::IrradianceRgb { .. }) => Bounces::Count(RGB_BOUNCES as u32),
        (BouncesArg::All, _) => Bounces::Converged {
            tolerance: 1e-6,
            limit: 2000,
        },
    }
}

/// The reference's indirect irradiance, channels together.
fn reference_signal(
    reference: &ReferenceFile,
    light: usize,
    albedo: f64,
    args: &AccuracyArgs,
) -> Result<Vec<f64>, ReferenceError> {
    let bounces = match args.bounces {
        BouncesArg::First => mrt_core::reference::bounces::ReferenceBounces::First,
        BouncesArg::All => mrt_core::reference::bounces::ReferenceBounces::All,
    };
    match reference.kind {
        Kind::IrradianceRgb { .. } => {
            let rgb = reference.indirect_irradiance_rgb(light, bounces)?;
            Ok(rgb.as_flattened().to_vec())
        }
        Kind::RadianceSh9 { .. } => {
            reference.term(light, usize::from(args.bounces == BouncesArg::All))
        }
        _ => reference.indirect_irradiance(light, bounces, albedo),
    }
}

/// Our indirect irradiance at the reference's texel centres, in its order of texels and channels.
///
/// It is looked up in the lightmap as a game does, so dictionaries of any resolution can be compared; at the
/// reference's own the lookup returns the texels.
fn our_signal(
    reference: &ReferenceFile,
    scene: &Scene,
    frame: &Frame,
) -> Result<Vec<f64>, AccuracyError> {
    if let Kind::RadianceSh9 { points, .. } = &reference.kind {
        return our_probes(reference, scene, frame, points);
    }
    let resolution = reference.resolution.unwrap_or(scene.level.resolution);
    let channels = match reference.kind {
        Kind::IrradianceRgb { .. } => 3,
        _ => 1,
    };
    let mut ours = Vec::new();
    for (block, face) in reference.walls.iter().copied() {
        let canonical = scene.level.blocks[block].orientation.inverse();
        for texel in 0..resolution * resolution {
            let (row, column) = (texel / resolution, texel % resolution);
            let point = canonical.point(face.texel_center(resolution, row, column));
            let face = canonical.face(face);
            let (u, v) = (point[face.u_axis()] as f32, point[face.v_axis()] as f32);
            // Walls of the reference are walls of the level: both follow from the cells.
            let light = scene
                .atlas
                .pixel(BlockIndex::new(block), face, u, v)
                .map_or([0.0; 3], |pixel| {
                    scene.atlas.sample(frame.lightmap().pixels(), pixel)
                });
            ours.extend(light[..channels].iter().map(|&e| f64::from(e)));
        }
    }
    Ok(ours)
}

/// Our incident radiance at the reference's points, nine coefficients each.
fn our_probes(
    reference: &ReferenceFile,
    scene: &Scene,
    frame: &Frame,
    points: &[DVec3],
) -> Result<Vec<f64>, AccuracyError> {
    let scene_name = || reference.name.clone();
    let probes = frame.probes().ok_or_else(|| AccuracyError::NoProbes {
        scene: scene_name(),
    })?;
    let mut ours = Vec::with_capacity(9 * points.len());
    for &point in points {
        let light = probes
            .at(&scene.level, point)
            .ok_or_else(|| AccuracyError::ProbeOutside {
                scene: scene_name(),
                found: point,
            })?;
        ours.extend(light.iter().map(|rgb| f64::from(rgb[0])));
    }
    Ok(ours)
}

fn print(all: &[LightAccuracy]) {
    crate::report_line!(
        "relative L2 error of indirect irradiance, %, by openings from the light's block"
    );
    let mut table = Table::new(&["scene", "light", "whole", "0", "1", "2", "3+"]);
    let percent = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{:.2}", 100.0 * x));
    for light in all {
        let mut cells = vec![
            light.scene.clone(),
            light.light.to_string(),
            percent(Some(light.rel_l2)),
        ];
        cells.extend(light.rel_l2_by_hop.map(percent));
        table.row(cells);
    }
    let mean = |values: Vec<f64>| {
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let mut cells = vec![
        "mean over lights".to_owned(),
        all.len().to_string(),
        percent(mean(all.iter().map(|light| light.rel_l2).collect())),
    ];
    cells.extend((0..HOP_GROUPS).map(|hop| {
        percent(mean(
            all.iter()
                .filter_map(|light| light.rel_l2_by_hop[hop])
                .collect(),
        ))
    }));
    table.row(cells);
    crate::report!("{table}");
    crate::report_line!("preset {}, {}", all[0].preset, all[0].term);
}
