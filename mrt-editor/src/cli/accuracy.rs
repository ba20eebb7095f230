//! `mrt accuracy`: error of the reduced solution against reference files.

use crate::accuracy::reference_file::{
    CompareConfig, CompareError, ComparedBounces, LightAccuracy, compare,
};
use crate::cli::dictionary_report::CouplingArg;
use crate::cli::dictionary_source::{
    DEFAULT_PRESET, DEFAULT_SET, SourceError, from_file, from_preset,
};
use crate::cli::output::{ReportError, print_json, warn};
use crate::cli::table::Table;
use mrt_core::excerpt::excerpt;
use mrt_core::geometry::cube::Face;
use mrt_core::reference::cells::CellIndex;
use mrt_core::reference::error_measure::HOP_GROUPS;
use mrt_core::reference::oracle_file::{ReferenceFile, read};
use mrt_dictionary::config::BakeConfig;
use mrt_runtime::{AssembleConfig, Dictionary};
use std::path::{Path, PathBuf};

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

/// Which bounces a comparison covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum BouncesArg {
    /// The first.
    First,
    /// All together.
    All,
}

impl AccuracyArgs {
    fn config(&self) -> CompareConfig {
        CompareConfig {
            bounces: match self.bounces {
                BouncesArg::First => ComparedBounces::First,
                BouncesArg::All => ComparedBounces::All,
            },
            albedo: self.albedo,
            coupling: self.coupling.into(),
            max_depth: self.max_depth,
        }
    }
}

/// Why the command failed.
#[derive(Debug, thiserror::Error)]
pub enum AccuracyError {
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A comparison failed, or its settings are out of range.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Some references could not be compared; the others were.
    #[error("{failed} of {count} references could not be compared (see above)")]
    Some {
        /// How many failed.
        failed: usize,
        /// How many there are.
        count: usize,
    },
    /// A line has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// Compares all references and prints. A reference that fails is reported, and the others still run.
///
/// # Errors
/// [`AccuracyError`].
pub fn run(args: &AccuracyArgs) -> Result<(), AccuracyError> {
    let config = args.config();
    config.check()?;
    let mut dictionaries = Dictionaries::new(args)?;
    let mut all = Vec::new();
    let mut failed = 0;
    for path in &args.references {
        match compare_file(path, &mut dictionaries, &config) {
            Ok(lights) => all.extend(report_lights(args, lights)?),
            // Without a dictionary nothing can be compared.
            Err(AccuracyError::Source(error)) => return Err(error.into()),
            Err(error) => {
                warn(format_args!("{error}"));
                failed += 1;
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

fn compare_file(
    path: &Path,
    dictionaries: &mut Dictionaries,
    config: &CompareConfig,
) -> Result<Vec<LightAccuracy>, AccuracyError> {
    let reference = read(path).map_err(CompareError::from)?;
    let dictionary = dictionaries.of(&reference)?;
    Ok(compare(&reference, dictionary, config)?)
}

/// Lines of JSON are printed as soon as they are known.
fn report_lights(
    args: &AccuracyArgs,
    lights: Vec<LightAccuracy>,
) -> Result<Vec<LightAccuracy>, ReportError> {
    if args.json {
        lights.iter().try_for_each(print_json)?;
    }
    Ok(lights)
}

/// The dictionaries of a comparison. Those of a preset are made when a reference first needs them.
struct Dictionaries<'a> {
    args: &'a AccuracyArgs,
    /// By set of shapes; a file serves for all sets.
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
    let (index, _) = CellIndex::new(cells);
    let mut cells = cells.iter();
    cells.any(|&cell| index.across(cell, Face::PosY).is_some())
}

fn print(all: &[LightAccuracy]) {
    crate::report_line!(
        "relative L2 error of indirect irradiance, %, by openings from the light's block"
    );
    let mut table = Table::new(&["scene", "light", "whole", "0", "1", "2", "3+"]);
    for light in all {
        let whole = Some(light.rel_l2);
        let names = [light.scene.clone(), light.light.to_string()];
        let errors = std::iter::once(whole).chain(light.rel_l2_by_hop);
        table.row(names.into_iter().chain(errors.map(percent)));
    }
    let whole = mean(all.iter().map(|light| light.rel_l2));
    let by_hop = (0..HOP_GROUPS).map(|hop| mean(all.iter().filter_map(|l| l.rel_l2_by_hop[hop])));
    let names = ["mean over lights".to_owned(), all.len().to_string()];
    let means = std::iter::once(whole).chain(by_hop);
    table.row(names.into_iter().chain(means.map(percent)));
    crate::report!("{table}");
    crate::report_line!("preset {}, {}", excerpt(&all[0].preset), all[0].term);
}

fn percent(error: Option<f64>) -> String {
    error.map_or("-".to_owned(), |error| format!("{:.2}", 100.0 * error))
}

/// `None` without values.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0u32, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / f64::from(count))
}
