//! `mrt pack`: the part of a dictionary that a level uses.

use crate::cli::accuracy::CouplingArg;
use crate::cli::dictionary_source::{DEFAULT_DICTIONARY, SourceError, read_dictionary_file};
use crate::cli::info::{StorageArg, kind_bytes};
use crate::cli::output::is_same_place;
use crate::cli::table::Table;
use crate::document::level_file::{LevelFileError, read_level};
use mrt_core::container::{ByteBudget, ContainerError, write_file_atomically};
use mrt_runtime::low_level::modular::dictionary::{OperatorKind, StoredDictionary};
use mrt_runtime::low_level::modular::dictionary_file::DEFAULT_BYTE_BUDGET;
use mrt_runtime::low_level::modular::pack::{PackConfig, pack};
use mrt_runtime::{AssembleError, DictionaryError};
use serde::Serialize;
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
    /// The output would replace the level.
    #[error("--out {}: expected another file than the level", path.display())]
    SameFile {
        /// The file.
        path: PathBuf,
    },
    /// There is no dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The dictionary lacks something that the level uses.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// The packed dictionary has no form as bytes.
    #[error(transparent)]
    Dictionary(#[from] DictionaryError),
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] ContainerError),
    /// The report has no form as JSON.
    #[error("the report cannot be printed: {0}")]
    Report(#[from] serde_json::Error),
}

#[derive(Serialize)]
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
    let level = read_level(&args.level)?;
    if is_same_place(&args.level, &args.out) {
        return Err(PackError::SameFile {
            path: args.out.clone(),
        });
    }
    let (bytes, place) = match &args.dictionary {
        Some(path) => (read_dictionary_file(path)?, path.display().to_string()),
        None => (
            DEFAULT_DICTIONARY.to_vec(),
            "the built-in dictionary".to_owned(),
        ),
    };
    let mut budget = ByteBudget::new(DEFAULT_BYTE_BUDGET);
    let whole = StoredDictionary::read(&bytes, &mut budget)
        .map_err(|source| SourceError::Dictionary { place, source })?;
    let config = PackConfig {
        probes: !args.no_probes,
        vector: !args.no_vector,
        sources: args.keep_sources,
        lightfields: !matches!(args.coupling, Some(CouplingArg::Table)),
    };
    let part = pack(&level, &whole, &config)?;
    let packed = match args.storage {
        Some(storage) => part.stored_as(storage.into()),
        None => part.clone(),
    };
    let packed_bytes = packed.to_bytes()?;
    write_file_atomically(&args.out, &packed_bytes)?;
    let report = report(args, (&whole, bytes.len()), (&packed, packed_bytes.len()));
    if args.json {
        crate::report_line!("{}", serde_json::to_string(&report)?);
    } else {
        print(&report);
    }
    Ok(())
}

fn report(
    args: &PackArgs,
    (whole, file_bytes_before): (&StoredDictionary, usize),
    (packed, file_bytes): (&StoredDictionary, usize),
) -> PackReport {
    let names = |kept: bool| {
        let entries = whole.shapes.iter();
        entries
            .filter(|entry| packed.shape_index(entry.shape).is_some() == kept)
            .map(|entry| entry.shape.name)
            .collect()
    };
    let (before, after) = (kind_bytes(whole), kind_bytes(packed));
    let kinds = OperatorKind::ALL.into_iter().filter_map(|kind| {
        let bytes_before = before.get(&kind)?.bytes;
        let after = after.get(&kind);
        Some(KindReport {
            kind: kind.name(),
            bytes_before,
            bytes: after.map_or(0, |entry| entry.bytes),
            storage: after.map_or("", |entry| entry.storage),
        })
    });
    PackReport {
        file: args.out.display().to_string(),
        shapes: names(true),
        shapes_left_out: names(false),
        variants: packed.variants.len(),
        paths: packed.paths.entries.len(),
        paths_left_out: whole.paths.entries.len() - packed.paths.entries.len(),
        kinds: kinds.collect(),
        file_bytes_before,
        file_bytes,
    }
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
