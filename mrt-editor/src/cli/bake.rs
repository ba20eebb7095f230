//! `mrt bake`: computes a dictionary.

use crate::cli::dictionary_report::{CouplingReport, StorageArg};
use crate::cli::dictionary_source::{DEFAULT_PRESET, bake_with_progress};
use crate::cli::output::{ReportError, print_report};
use crate::cli::output_files::{OutputError, OutputFiles};
use crate::cli::table::Table;
use mrt_core::container::{ContainerError, write_file_atomically};
use mrt_dictionary::config::{BakeConfig, ConfigError};
use mrt_dictionary::progress::Cancelled;
use mrt_runtime::{Dictionary, DictionaryError};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Bakes a dictionary of canonical shapes; the same settings give the same bytes.
#[derive(Clone, Debug, clap::Args)]
pub struct BakeArgs {
    /// Shapes to bake: cubes-2d (cubes with side faces missing), cubes-3d (all cubes with faces missing),
    /// rooms (cubes-2d, with doors and windows) or cylinders (round tubes and bends).
    #[arg(long, default_value = "cubes-2d")]
    pub set: String,
    /// Quality and size: mobile, standard, high or quality.
    #[arg(long, default_value = DEFAULT_PRESET)]
    pub preset: String,
    /// Dictionary file to write.
    #[arg(long)]
    pub out: PathBuf,
    /// Texels along an edge of a wall [default: the preset's].
    #[arg(long)]
    pub resolution: Option<usize>,
    /// Modes of indirect light in a block, at most [default: the preset's].
    #[arg(long)]
    pub modes: Option<usize>,
    /// Modes of light through an opening, at most [default: the preset's].
    #[arg(long)]
    pub lightfield_modes: Option<usize>,
    /// Modes of the walls' response to light through an opening, at most [default: the preset's].
    #[arg(long)]
    pub response_modes: Option<usize>,
    /// Emission modes, at most.
    #[arg(long)]
    pub emission_modes: Option<usize>,
    /// Modes that light from other blocks adds to each shape's own, at most.
    #[arg(long)]
    pub foreign_modes: Option<usize>,
    /// Openings that a path of the table crosses, at most.
    #[arg(long)]
    pub path_depth: Option<usize>,
    /// Probes along an edge of a block; 0 for none.
    #[arg(long)]
    pub probes: Option<usize>,
    /// Also bake vector irradiance, for normal maps.
    #[arg(long)]
    pub vector: bool,
    /// Lights of the prior along each axis [default: the preset's].
    #[arg(long)]
    pub lights_per_axis: Option<usize>,
    /// Weight of the enrichment that keeps coloured walls and many bounces right; 0 leaves it out.
    #[arg(long)]
    pub enrichment: Option<f64>,
    /// How to store numbers.
    #[arg(long, value_enum, default_value = "f32")]
    pub storage: StorageArg,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Why nothing was baked.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// A setting is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The user stopped it.
    #[error("{0}; no file was written")]
    Cancelled(#[from] Cancelled),
    /// The dictionary has no form as bytes.
    #[error(transparent)]
    Dictionary(#[from] DictionaryError),
    /// The dictionary cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] ContainerError),
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}

#[derive(Serialize)]
struct BakeReport {
    file: String,
    preset: String,
    settings: String,
    seconds: f64,
    file_bytes: usize,
    #[serde(flatten)]
    coupling: CouplingReport,
    shapes: Vec<ShapeReport>,
}

#[derive(Serialize)]
struct ShapeReport {
    shape: &'static str,
    texels: usize,
    modes: usize,
    joint_modes: usize,
    dropped_energy: f32,
    joint_dropped_energy: f32,
    bytes: usize,
}

/// Bakes, writes the file and reports.
///
/// # Errors
/// [`BakeError`]; the file is then as it was.
pub fn run(args: &BakeArgs) -> Result<(), BakeError> {
    let config = config(args)?;
    OutputFiles::new([]).check_file("--out", &args.out)?;
    let start = Instant::now();
    let dictionary = bake_with_progress(&config)?;
    let bytes = dictionary.stored_as(args.storage.into()).to_bytes()?;
    write_file_atomically(&args.out, &bytes)?;
    let report = report(
        args,
        &dictionary,
        bytes.len(),
        start.elapsed().as_secs_f64(),
    );
    Ok(print_report(&report, args.json, print)?)
}

fn config(args: &BakeArgs) -> Result<BakeConfig, ConfigError> {
    let mut config = BakeConfig::preset_for(&args.preset, &args.set)?;
    let overrides = [
        (args.resolution, &mut config.resolution),
        (args.modes, &mut config.modes),
        (
            args.lightfield_modes,
            &mut config.lightfield.lightfield_modes,
        ),
        (args.response_modes, &mut config.coupling.response_modes),
        (args.emission_modes, &mut config.coupling.emission_modes),
        (args.foreign_modes, &mut config.coupling.foreign_modes),
        (args.path_depth, &mut config.coupling.depth),
        (args.probes, &mut config.outputs.probes),
        (args.lights_per_axis, &mut config.prior.lights_per_axis),
    ];
    let mut changed = args.enrichment.is_some() || args.vector;
    for (given, setting) in overrides {
        if let Some(value) = given {
            *setting = value;
            changed = true;
        }
    }
    match args.enrichment {
        Some(0.0) => config.enrichment = None,
        Some(weight) => {
            if let Some(enrichment) = &mut config.enrichment {
                enrichment.constant_weight = weight;
                enrichment.indirect_weight = weight;
            }
        }
        None => {}
    }
    config.outputs.vector |= args.vector;
    if changed {
        config.preset = format!("{} (changed)", args.preset);
    }
    config.check()?;
    Ok(config)
}

fn report(args: &BakeArgs, dictionary: &Dictionary, file_bytes: usize, seconds: f64) -> BakeReport {
    BakeReport {
        file: args.out.display().to_string(),
        preset: dictionary.preset.clone(),
        settings: dictionary.settings.clone(),
        seconds,
        file_bytes,
        coupling: CouplingReport::of(dictionary),
        shapes: dictionary
            .shapes
            .iter()
            .map(|entry| ShapeReport {
                shape: entry.shape.name,
                texels: entry.joint_basis.rows(),
                modes: entry.modes(),
                joint_modes: entry.joint_modes(),
                dropped_energy: entry.dropped_energy,
                joint_dropped_energy: entry.joint_dropped_energy,
                bytes: entry.bytes(),
            })
            .collect(),
    }
}

fn print(report: &BakeReport) {
    crate::report_line!("{}: {}", report.preset, report.settings);
    let mut table = Table::new(&[
        "shape",
        "texels",
        "modes",
        "energy dropped",
        "joint modes",
        "foreign dropped",
        "bytes",
    ]);
    for shape in &report.shapes {
        table.row([
            shape.shape.to_owned(),
            shape.texels.to_string(),
            shape.modes.to_string(),
            format!("{:.2e}", shape.dropped_energy),
            shape.joint_modes.to_string(),
            format!("{:.2e}", shape.joint_dropped_energy),
            shape.bytes.to_string(),
        ]);
    }
    crate::report!("{table}");
    report.coupling.print();
    crate::report_line!(
        "{}: {} bytes in {:.1} s",
        report.file,
        report.file_bytes,
        report.seconds
    );
}
