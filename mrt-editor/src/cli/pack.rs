//! `mrt pack`: the part of a dictionary that a level uses.

use crate::cli::dictionary_report::{CouplingArg, KindBytes, StorageArg, kind_bytes};
use crate::cli::dictionary_source::{DictionaryBytes, SourceError};
use crate::cli::hint::after_assembly;
use crate::cli::output::{ReportError, print_report};
use crate::cli::output_files::{OutputError, OutputFiles};
use crate::cli::table::Table;
use crate::document::level_file::{LevelFileError, read_level};
use mrt_core::container::{ContainerError, write_file_atomically};
use mrt_runtime::low_level::modular::dictionary::{OperatorKind, StoredDictionary};
use mrt_runtime::low_level::modular::pack::{PackConfig, pack};
use mrt_runtime::{AssembleError, DictionaryError};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Writes the part of a dictionary that a level uses: its shapes and the paths that light takes in it.
///
/// Frames are the same as with the whole dictionary, to the last bit, unless --storage changes or --coupling table ends
/// light at the table's longest path.
#[derive(Clone, Debug, clap::Args)]
pub struct PackArgs {
    /// Level file.
    pub level: PathBuf,
    /// Dictionary file [default: the built-in dictionary].
    #[arg(long)]
    pub dictionary: Option<PathBuf>,
    /// File to write.
    #[arg(long)]
    pub out: PathBuf,
    /// How to store numbers [default: as in the dictionary].
    #[arg(long, value_enum)]
    pub storage: Option<StorageArg>,
    /// Leave out light for probes.
    #[arg(long)]
    pub no_probes: bool,
    /// Leave out vector irradiance.
    #[arg(long)]
    pub no_vector: bool,
    /// Keep what only tools use.
    #[arg(long)]
    pub keep_sources: bool,
    /// The only coupling to be used; "table" leaves out lightfields [default: either].
    #[arg(long, value_enum)]
    pub coupling: Option<CouplingArg>,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Why nothing was packed.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// The level cannot be read, or is at fault.
    #[error(transparent)]
    Level(#[from] LevelFileError),
    /// The dictionary cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// There is no dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The dictionary lacks something that the level uses.
    #[error("{0}{hint}", hint = after_assembly(.0))]
    Assemble(#[from] AssembleError),
    /// The packed dictionary has no form as bytes.
    #[error(transparent)]
    Dictionary(#[from] DictionaryError),
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] ContainerError),
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}

#[derive(Default, Serialize)]
struct PackReport {
    file: String,
    shapes: Vec<&'static str>,
    shapes_left_out: Vec<&'static str>,
    variants: usize,
    paths: usize,
    paths_left_out: usize,
    kinds: Vec<KindReport>,
    file_bytes_before: usize,
    file_bytes: usize,
}

#[derive(Serialize)]
struct KindReport {
    kind: &'static str,
    bytes_before: usize,
    bytes: usize,
    storage: &'static str,
}

/// Packs, writes the file and reports.
///
/// # Errors
/// [`PackError`]; the file is then as it was.
pub fn run(args: &PackArgs) -> Result<(), PackError> {
    let inputs = [&args.level].into_iter().chain(&args.dictionary);
    OutputFiles::new(inputs.map(PathBuf::as_path)).check_file("--out", &args.out)?;
    let level = read_level(&args.level)?;
    let source = DictionaryBytes::of(args.dictionary.as_deref())?;
    let whole = source.read_stored()?;
    let part = pack(&level, &whole, &config(args))?;
    let packed = match args.storage {
        Some(storage) => part.stored_as(storage.into()),
        None => part.clone(),
    };
    let bytes = packed.to_bytes()?;
    write_file_atomically(&args.out, &bytes)?;
    let report = PackReport {
        file: args.out.display().to_string(),
        file_bytes_before: source.count(),
        file_bytes: bytes.len(),
        ..contents(&whole, &packed)
    };
    Ok(print_report(&report, args.json, print)?)
}

fn config(args: &PackArgs) -> PackConfig {
    PackConfig {
        probes: !args.no_probes,
        vector: !args.no_vector,
        sources: args.keep_sources,
        lightfields: !matches!(args.coupling, Some(CouplingArg::Table)),
    }
}

/// A report of what was kept and what was left out, without files.
fn contents(whole: &StoredDictionary, packed: &StoredDictionary) -> PackReport {
    let names = |kept: bool| {
        let entries = whole.shapes.iter();
        entries
            .filter(|entry| packed.shape_index(entry.shape).is_some() == kept)
            .map(|entry| entry.shape.name)
            .collect()
    };
    PackReport {
        shapes: names(true),
        shapes_left_out: names(false),
        variants: packed.variants.len(),
        paths: packed.paths.entries.len(),
        paths_left_out: whole.paths.entries.len() - packed.paths.entries.len(),
        kinds: kinds(&kind_bytes(whole), &kind_bytes(packed)),
        ..PackReport::default()
    }
}

fn kinds(
    before: &BTreeMap<OperatorKind, KindBytes>,
    after: &BTreeMap<OperatorKind, KindBytes>,
) -> Vec<KindReport> {
    let kind = |kind: OperatorKind| {
        let bytes_before = before.get(&kind)?.bytes;
        let after = after.get(&kind);
        Some(KindReport {
            kind: kind.name(),
            bytes_before,
            bytes: after.map_or(0, |entry| entry.bytes),
            storage: after.map_or("", |entry| entry.storage),
        })
    };
    OperatorKind::ALL.into_iter().filter_map(kind).collect()
}

fn print(report: &PackReport) {
    crate::report_line!("shapes: {}", report.shapes.join(" "));
    if !report.shapes_left_out.is_empty() {
        crate::report_line!("left out: {}", report.shapes_left_out.join(" "));
    }
    crate::report_line!(
        "{} paths of {}, {} variants",
        report.paths,
        report.paths + report.paths_left_out,
        report.variants
    );
    let mut table = Table::new(&["operators", "bytes before", "bytes", "storage"]);
    for kind in &report.kinds {
        table.row([
            kind.kind.to_owned(),
            kind.bytes_before.to_string(),
            kind.bytes.to_string(),
            kind.storage.to_owned(),
        ]);
    }
    crate::report!("{table}");
    crate::report_line!(
        "{}: {} bytes, from {}",
        report.file,
        report.file_bytes,
        report.file_bytes_before
    );
}
