//! `mrt info`: what a dictionary file holds.

use crate::cli::dictionary_report::{CouplingReport, kind_bytes};
use crate::cli::dictionary_source::{DictionaryBytes, SourceError};
use crate::cli::output::{ReportError, print_report};
use crate::cli::table::Table;
use mrt_core::excerpt::{excerpt, printable};
use mrt_core::storage::StoredMatrix;
use mrt_dictionary::modular::spectrum::{Spectrum, closed_cube_spectra};
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_runtime::low_level::modular::dictionary::{ShapeOperators, StoredDictionary};
use serde::Serialize;
use std::path::PathBuf;

/// Most characters of a dictionary's settings that are shown: several times what a bake writes.
const LONGEST_SETTINGS: usize = 2000;

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
    #[error(transparent)]
    Report(#[from] ReportError),
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
    let bytes = DictionaryBytes::of_file(&args.file)?;
    let dictionary = bytes.read_stored()?;
    let spectra = spectra(args, dictionary.resolution)?;
    let info = info(args, &dictionary, spectra);
    Ok(print_report(&info, args.json, print)?)
}

/// `None` if the user did not ask for it.
fn spectra(args: &InfoArgs, resolution: usize) -> Result<Option<Vec<SpectrumInfo>>, Cancelled> {
    if !args.spectrum {
        return Ok(None);
    }
    let spectra = closed_cube_spectra(resolution, &Progress::silent())?;
    Ok(Some(spectra.iter().map(spectrum_info).collect()))
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
    let operators = kind_bytes(dictionary).into_iter();
    Info {
        file: args.file.display().to_string(),
        preset: &dictionary.preset,
        settings: &dictionary.settings,
        resolution: dictionary.resolution,
        bytes: dictionary.bytes(),
        coupling: CouplingReport::of(dictionary),
        shapes: dictionary.shapes.iter().map(shape_info).collect(),
        variants: dictionary.variants.len(),
        operators: operators
            .map(|(kind, entry)| KindInfo {
                kind: kind.name(),
                storage: entry.storage,
                bytes: entry.bytes,
            })
            .collect(),
        spectra,
    }
}

fn shape_info(entry: &ShapeOperators<StoredMatrix>) -> ShapeInfo {
    let openings = entry.shape.openings.iter();
    ShapeInfo {
        shape: entry.shape.name,
        openings: openings.map(|opening| opening.face.name()).collect(),
        texels: entry.joint_basis.rows(),
        joint_modes: entry.joint_modes(),
        modes: entry.modes(),
        dropped_energy: entry.dropped_energy,
        largest_singular_value: entry.singular_values.first().copied().unwrap_or(0.0),
        smallest_singular_value: entry.singular_values.last().copied().unwrap_or(0.0),
        bytes: entry.bytes(),
    }
}

fn print(info: &Info) {
    crate::report_line!("{}", info.file);
    let (preset, settings) = (
        excerpt(info.preset),
        printable(info.settings, LONGEST_SETTINGS),
    );
    crate::report_line!("preset {preset}: {settings}");
    print_shapes(&info.shapes);
    info.coupling.print();
    print_operators(&info.operators);
    if info.variants > 0 {
        crate::report_line!("{} variants of shapes", info.variants);
    }
    crate::report_line!("{} bytes of matrices", info.bytes);
    if let Some(spectra) = &info.spectra {
        print_spectra(spectra);
    }
}

fn print_shapes(shapes: &[ShapeInfo]) {
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
    for shape in shapes {
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
}

fn print_operators(operators: &[KindInfo]) {
    let mut table = Table::new(&["operators", "storage", "bytes"]);
    for kind in operators {
        table.row([
            kind.kind.to_owned(),
            kind.storage.to_owned(),
            kind.bytes.to_string(),
        ]);
    }
    crate::report!("{table}");
}

fn print_spectra(spectra: &[SpectrumInfo]) {
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
