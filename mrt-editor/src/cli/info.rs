//! `mrt info`: what a dictionary file holds.

use crate::cli::dictionary_source::{SourceError, read_dictionary_file};
use crate::cli::table::Table;
use mrt_core::container::ByteBudget;
use mrt_core::storage::Storage;
use mrt_dictionary::modular::spectrum::{Spectrum, closed_cube_spectra};
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_runtime::Dictionary;
use mrt_runtime::low_level::modular::dictionary::{OperatorKind, StoredDictionary};
use mrt_runtime::low_level::modular::dictionary_file::DEFAULT_BYTE_BUDGET;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Shows a dictionary's shapes, ranks and sizes.
#[derive(Clone, Debug, clap::Args)]
pub struct InfoArgs {
    /// Dictionary file.
    pub file: PathBuf,
    /// Also compute how many singular values of the closed cube's one-bounce operator, light prior
    /// and light-space operator hold 80, 90 and 95 % of the energy, at the file's resolution.
    #[arg(long)]
    pub spectrum: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum StorageArg {
    /// Four bytes a number, exact.
    F32,
    /// Two bytes: within 0.03 % of f32.
    F16,
    /// One byte for most: within 0.5 % of f32.
    Int8,
}

impl From<StorageArg> for Storage {
    fn from(arg: StorageArg) -> Storage {
        match arg {
            StorageArg::F32 => Storage::F32,
            StorageArg::F16 => Storage::F16,
            StorageArg::Int8 => Storage::Int8,
        }
    }
}

/// How a kind of operator is stored, and in how many bytes; kinds without elements are left out.
pub(super) fn kind_bytes(dictionary: &StoredDictionary) -> BTreeMap<OperatorKind, KindBytes> {
    let mut kinds: BTreeMap<OperatorKind, KindBytes> = BTreeMap::new();
    dictionary.map(|kind, matrix| {
        if matrix.rows() * matrix.columns() == 0 {
            return;
        }
        let storage = matrix.storage().name();
        let entry = kinds.entry(kind).or_insert(KindBytes { bytes: 0, storage });
        entry.bytes += matrix.bytes();
        if entry.storage != storage {
            entry.storage = "mixed";
        }
    });
    kinds
}

/// See [`kind_bytes`].
pub(super) struct KindBytes {
    pub(super) bytes: usize,
    /// "mixed" if not all are alike.
    pub(super) storage: &'static str,
}

/// Why there is nothing to show.
#[derive(Debug, thiserror::Error)]
pub enum InfoError {
    /// The file is at fault.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The report has no form as JSON.
    #[error("the report cannot be printed: {0}")]
    Report(#[from] serde_json::Error),
}

#[derive(Serialize)]
struct Info<'a> {
    file: String,
    preset: &'a str,
    settings: &'a str,
    resolution: usize,
    bytes: usize,
    #[serde(flatten)]
    coupling: CouplingReport,
    shapes: Vec<ShapeInfo>,
    variants: usize,
    operators: Vec<KindInfo>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spectra: Option<Vec<SpectrumInfo>>,
}

/// How light gets from block to block.
#[derive(Serialize)]
pub(super) struct CouplingReport {
    lightfield_modes: usize,
    lightfield_dropped_energy: f32,
    emission_modes: usize,
    emission_dropped_energy: f32,
    response_modes: usize,
    response_dropped_energy: f32,
    paths: usize,
}

impl CouplingReport {
    pub(super) fn of<M>(dictionary: &Dictionary<M>) -> Self {
        let (fields, paths) = (&dictionary.lightfields, &dictionary.paths);
        Self {
            lightfield_modes: fields.parity.len(),
            lightfield_dropped_energy: fields.dropped_energy,
            emission_modes: paths.emission_parity.len(),
            emission_dropped_energy: paths.emission_dropped_energy,
            response_modes: paths.response_parity.len(),
            response_dropped_energy: paths.response_dropped_energy,
            paths: paths.entries.len(),
        }
    }

    pub(super) fn print(&self) {
        crate::report_line!(
            "between blocks: {} paths from {} emission modes (energy dropped {:.2e}) to {} response modes \
             ({:.2e}); {} lightfield modes ({:.2e})",
            self.paths,
            self.emission_modes,
            self.emission_dropped_energy,
            self.response_modes,
            self.response_dropped_energy,
            self.lightfield_modes,
            self.lightfield_dropped_energy,
        );
    }
}

#[derive(Serialize)]
struct ShapeInfo {
    shape: &'static str,
    openings: Vec<&'static str>,
    texels: usize,
    modes: usize,
    joint_modes: usize,
    dropped_energy: f32,
    largest_singular_value: f32,
    smallest_singular_value: f32,
    bytes: usize,
}

#[derive(Serialize)]
struct KindInfo {
    kind: &'static str,
    storage: &'static str,
    bytes: usize,
}

#[derive(Serialize)]
struct SpectrumInfo {
    matrix: &'static str,
    size: [usize; 2],
    values_for_80_percent: usize,
    values_for_90_percent: usize,
    values_for_95_percent: usize,
}

/// Reads the file and prints.
///
/// # Errors
/// [`InfoError`].
pub fn run(args: &InfoArgs) -> Result<(), InfoError> {
    let bytes = read_dictionary_file(&args.file)?;
    let mut budget = ByteBudget::new(DEFAULT_BYTE_BUDGET);
    let dictionary = StoredDictionary::read(&bytes, &mut budget).map_err(|source| {
        let place = args.file.display().to_string();
        SourceError::Dictionary { place, source }
    })?;
    let spectra = if args.spectrum {
        let spectra = closed_cube_spectra(dictionary.resolution, &Progress::silent())?;
        Some(spectra.iter().map(spectrum_info).collect())
    } else {
        None
    };
    let info = info(args, &dictionary, spectra);
    if args.json {
        crate::report_line!("{}", serde_json::to_string(&info)?);
    } else {
        print(&info);
    }
    Ok(())
}

fn spectrum_info(spectrum: &Spectrum) -> SpectrumInfo {
    let count = |fraction| spectrum.energy_rank(fraction);
    SpectrumInfo {
        matrix: spectrum.matrix,
        size: spectrum.size,
        values_for_80_percent: count(0.80),
        values_for_90_percent: count(0.90),
        values_for_95_percent: count(0.95),
    }
}

fn info<'a>(
    args: &InfoArgs,
    dictionary: &'a StoredDictionary,
    spectra: Option<Vec<SpectrumInfo>>,
) -> Info<'a> {
    Info {
        file: args.file.display().to_string(),
        preset: &dictionary.preset,
        settings: &dictionary.settings,
        resolution: dictionary.resolution,
        bytes: dictionary.bytes(),
        coupling: CouplingReport::of(dictionary),
        shapes: dictionary
            .shapes
            .iter()
            .map(|entry| ShapeInfo {
                shape: entry.shape.name,
                openings: entry
                    .shape
                    .openings
                    .iter()
                    .map(|opening| opening.face.name())
                    .collect(),
                texels: entry.joint_basis.rows(),
                joint_modes: entry.joint_modes(),
                modes: entry.modes(),
                dropped_energy: entry.dropped_energy,
                largest_singular_value: entry.singular_values.first().copied().unwrap_or(0.0),
                smallest_singular_value: entry.singular_values.last().copied().unwrap_or(0.0),
                bytes: entry.bytes(),
            })
            .collect(),
        variants: dictionary.variants.len(),
        operators: kind_bytes(dictionary)
            .into_iter()
            .map(|(kind, entry)| KindInfo {
                kind: kind.name(),
                storage: entry.storage,
                bytes: entry.bytes,
            })
            .collect(),
        spectra,
    }
}

fn print(info: &Info) {
    crate::report_line!("{}", info.file);
    crate::report_line!("preset {}: {}", info.preset, info.settings);
    let mut table = Table::new(&[
        "shape",
        "openings",
        "texels",
        "modes",
        "joint modes",
        "singular values",
        "energy dropped",
        "bytes",
    ]);
    for shape in &info.shapes {
        table.row([
            shape.shape.to_owned(),
            shape.openings.join(" "),
            shape.texels.to_string(),
            shape.modes.to_string(),
            shape.joint_modes.to_string(),
            format!(
                "{:.3} .. {:.2e}",
                shape.largest_singular_value, shape.smallest_singular_value
            ),
            format!("{:.2e}", shape.dropped_energy),
            shape.bytes.to_string(),
        ]);
    }
    crate::report!("{table}");
    info.coupling.print();
    let mut table = Table::new(&["operators", "storage", "bytes"]);
    for kind in &info.operators {
        table.row([
            kind.kind.to_owned(),
            kind.storage.to_owned(),
            kind.bytes.to_string(),
        ]);
    }
    crate::report!("{table}");
    if info.variants > 0 {
        crate::report_line!("{} variants of shapes", info.variants);
    }
    crate::report_line!("{} bytes of matrices", info.bytes);
    if let Some(spectra) = &info.spectra {
        crate::report_line!("\nsingular values that hold a share of the energy, closed cube:");
        let mut table = Table::new(&["matrix", "size", "80 %", "90 %", "95 %"]);
        for spectrum in spectra {
            table.row([
                spectrum.matrix.to_owned(),
                format!("{} x {}", spectrum.size[0], spectrum.size[1]),
                spectrum.values_for_80_percent.to_string(),
                spectrum.values_for_90_percent.to_string(),
                spectrum.values_for_95_percent.to_string(),
            ]);
        }
        crate::report!("{table}");
    }
}
