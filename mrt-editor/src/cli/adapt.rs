//! `mrt adapt`: gives warped blocks operators of their own.

use crate::cli::dictionary_source::{SourceError, load};
use crate::cli::output::{ReportError, print_report};
use crate::cli::output_files::{OutputError, OutputFiles};
use crate::cli::progress::with_progress;
use crate::cli::table::Table;
use crate::document::level_file::{LevelFileError, read_level, stage_level};
use mrt_core::container::{ContainerError, StagedFile};
use mrt_dictionary::modular::variants::advice::{BlockEstimate, Thresholds, estimate_blocks};
use mrt_dictionary::modular::variants::build::{
    VariantConfig, VariantError, has_hole, make_variants,
};
use mrt_runtime::blocks::WarpTransport;
use mrt_runtime::low_level::level::warp_form::same_form;
use mrt_runtime::low_level::modular::dictionary::Variant;
use mrt_runtime::{Dictionary, DictionaryError, Level};
use serde::Serialize;
use std::path::PathBuf;

/// Measures what each block's warp costs, and computes operators for the blocks that need their own.
#[derive(Clone, Debug, clap::Args)]
pub struct AdaptArgs {
    /// Level file.
    pub level: PathBuf,
    /// Full dictionary file, as `mrt bake` writes it [default: the built-in one].
    #[arg(long)]
    pub dictionary: Option<PathBuf>,
    /// Which transport blocks get: `auto` chooses by the expected error.
    #[arg(long, value_enum, default_value = "auto")]
    pub to: Target,
    /// With `auto`: error that a warp may add before its light is gathered anew.
    #[arg(long, default_value_t = Thresholds::default().regather)]
    pub threshold_regather: f64,
    /// With `auto`: error that re-gathering may leave before everything is rebuilt.
    #[arg(long, default_value_t = Thresholds::default().rebuild)]
    pub threshold_rebuild: f64,
    /// Level file to write, with each block's transport.
    #[arg(long, required_unless_present = "report")]
    pub out_level: Option<PathBuf>,
    /// Dictionary file to write, with the blocks' operators.
    #[arg(long, required_unless_present = "report")]
    pub out_dictionary: Option<PathBuf>,
    /// Only print what would be done.
    #[arg(long)]
    pub report: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Which transport blocks get.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    /// The cheapest within the thresholds.
    Auto,
    /// Re-gathered, for all blocks that are no cubes.
    Regathered,
    /// Rebuilt, for all blocks that are no cubes.
    Rebuilt,
}

/// Why nothing was adapted.
#[derive(Debug, thiserror::Error)]
pub enum AdaptError {
    /// The level's file is at fault, or cannot be written.
    #[error(transparent)]
    Level(#[from] LevelFileError),
    /// There is no dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The dictionary has no form as bytes.
    #[error(transparent)]
    Dictionary(#[from] DictionaryError),
    /// The dictionary cannot be adapted, or the user stopped it.
    #[error("{0}; no file was written")]
    Variants(#[from] VariantError),
    /// A threshold is negative or not a number.
    #[error("--{name} {found}; expected 0 or more")]
    Threshold {
        /// Which flag.
        name: &'static str,
        /// The value given.
        found: f64,
    },
    /// An output cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The dictionary cannot be written.
    #[error(transparent)]
    Write(#[from] ContainerError),
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}

#[derive(Default, Serialize)]
struct Report {
    blocks: Vec<BlockReport>,
    variants: usize,
    variant_bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dictionary: Option<String>,
}

#[derive(Serialize)]
struct BlockReport {
    block: usize,
    shape: &'static str,
    stretch: f64,
    expected_error: ExpectedErrors,
    used: &'static str,
    advised: &'static str,
}

#[derive(Serialize)]
struct ExpectedErrors {
    canonical: f64,
    regathered: f64,
    rebuilt: f64,
}

/// Measures, computes, writes both files and reports.
///
/// # Errors
/// [`AdaptError`]; then no file is written or changed, except that the dictionary may be there when the
/// level, already on the disk, cannot be given its name.
pub fn run(args: &AdaptArgs) -> Result<(), AdaptError> {
    check(args)?;
    let level = read_level(&args.level)?;
    let mut dictionary = load(args.dictionary.as_deref(), None)?;
    let estimates = with_progress("adapting", |progress| {
        estimate_blocks(&level, &dictionary, progress)
    })?;
    let adapted = adapted(&level, &estimates, args);
    let written = if args.report {
        None
    } else {
        write_adapted(args, &adapted, &mut dictionary)?
    };
    let report = Report {
        blocks: block_reports(&level, &adapted, &estimates),
        ..written.unwrap_or_default()
    };
    Ok(print_report(&report, args.json, print)?)
}

/// Computes the operators, writes both files and reports them; `None` without places to write to.
fn write_adapted(
    args: &AdaptArgs,
    adapted: &Level,
    dictionary: &mut Dictionary,
) -> Result<Option<Report>, AdaptError> {
    let (Some(out_level), Some(out_dictionary)) = (&args.out_level, &args.out_dictionary) else {
        return Ok(None);
    };
    let made = with_progress("adapting", |progress| {
        make_variants(adapted, dictionary, &VariantConfig::default(), progress)
    })?;
    let report = Report {
        blocks: Vec::new(),
        variants: made.len(),
        variant_bytes: made.iter().map(|variant| variant.operators.bytes()).sum(),
        level: Some(out_level.display().to_string()),
        dictionary: Some(out_dictionary.display().to_string()),
    };
    add_variants(dictionary, made);
    let bytes = dictionary.to_bytes()?;
    let staged = StagedFile::write(out_dictionary, &bytes)?;
    let level = stage_level(out_level, adapted)?;
    // The dictionary comes first: one with more than a level needs does no harm.
    staged.commit()?;
    level.commit()?;
    Ok(Some(report))
}

fn check(args: &AdaptArgs) -> Result<(), AdaptError> {
    for (name, found) in [
        ("threshold-regather", args.threshold_regather),
        ("threshold-rebuild", args.threshold_rebuild),
    ] {
        // NaN is refused too.
        if !(0.0..=f64::MAX).contains(&found) {
            return Err(AdaptError::Threshold { name, found });
        }
    }
    let inputs = [&args.level].into_iter().chain(&args.dictionary);
    let mut outputs = OutputFiles::new(inputs.map(PathBuf::as_path));
    if let Some(level) = &args.out_level {
        outputs.check_file("--out-level", level)?;
    }
    if let Some(dictionary) = &args.out_dictionary {
        outputs.check_file("--out-dictionary", dictionary)?;
    }
    Ok(())
}

/// Stretch above 1 up to which a block counts as a cube when all others get operators of their own: levels are texts,
/// whose numbers are rounded.
const CUBE_SLACK: f64 = 1e-3;

/// The level with the transport that each block is to have.
fn adapted(level: &Level, estimates: &[BlockEstimate], args: &AdaptArgs) -> Level {
    let thresholds = Thresholds {
        regather: args.threshold_regather,
        rebuild: args.threshold_rebuild,
    };
    let mut level = level.clone();
    for (block, estimate) in level.blocks.iter_mut().zip(estimates) {
        let is_cube = estimate.stretch <= 1.0 + CUBE_SLACK
            && estimate.added(WarpTransport::Canonical) < CUBE_SLACK.sqrt();
        block.transport = match args.to {
            Target::Auto => estimate.advice(&thresholds),
            _ if is_cube => WarpTransport::Canonical,
            Target::Regathered => WarpTransport::Regathered,
            Target::Rebuilt => WarpTransport::Rebuilt,
        };
        if block.shape.tube().is_some() {
            block.transport = WarpTransport::Canonical;
        }
        if has_hole(block.shape) && block.transport == WarpTransport::Rebuilt {
            block.transport = WarpTransport::Regathered;
        }
    }
    level
}

/// Adds variants, and removes those of the same transport, shape and form; all others stay, for other levels.
fn add_variants(dictionary: &mut Dictionary, made: Vec<Variant>) {
    let is_replaced = |old: &Variant| {
        made.iter().any(|new| {
            new.transport == old.transport
                && new.operators.shape == old.operators.shape
                && same_form(&new.corners, &old.corners)
        })
    };
    dictionary.variants.retain(|old| !is_replaced(old));
    dictionary.variants.extend(made);
}

fn block_reports(level: &Level, adapted: &Level, estimates: &[BlockEstimate]) -> Vec<BlockReport> {
    let blocks = level.blocks.iter().zip(&adapted.blocks).zip(estimates);
    blocks
        .enumerate()
        .map(|(block, ((before, after), estimate))| {
            let [canonical, regathered, rebuilt] = estimate.expected;
            BlockReport {
                block,
                shape: before.shape.name,
                stretch: estimate.stretch,
                expected_error: ExpectedErrors {
                    canonical,
                    regathered,
                    rebuilt,
                },
                used: before.transport.name(),
                advised: after.transport.name(),
            }
        })
        .collect()
}

fn print(report: &Report) {
    let mut table = Table::new(&[
        "block",
        "shape",
        "stretch",
        "canonical %",
        "re-gathered %",
        "rebuilt %",
        "uses",
        "should use",
    ]);
    for block in &report.blocks {
        let percent = |x: f64| format!("{:.1}", 100.0 * x);
        table.row([
            block.block.to_string(),
            block.shape.to_owned(),
            format!("{:.2}", block.stretch),
            percent(block.expected_error.canonical),
            percent(block.expected_error.regathered),
            percent(block.expected_error.rebuilt),
            block.used.to_owned(),
            block.advised.to_owned(),
        ]);
    }
    crate::report!("{table}");
    if let (Some(level), Some(dictionary)) = (&report.level, &report.dictionary) {
        crate::report_line!(
            "{dictionary}: {} sets of operators for warped blocks, {} bytes\n{level}: {} blocks",
            report.variants,
            report.variant_bytes,
            report.blocks.len()
        );
    }
}
