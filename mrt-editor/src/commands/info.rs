//! `mrt info`: what a dictionary file holds.

use crate::dictionary_source::{SourceError, from_file};
use crate::table::Table;
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_dictionary::spectrum::{Spectrum, closed_cube_spectra};
use mrt_runtime::dictionary::Dictionary;
use serde::Serialize;
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
    pub(super) fn of(dictionary: &Dictionary) -> Self {
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
    let dictionary = from_file(&args.file)?;
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
    dictionary: &'a Dictionary,
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
