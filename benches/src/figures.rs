//! `mrt-figures`: draws the pictures that explain the method, those of `docs/FIGURES.md`.

mod basis;
mod hops;
mod plot;
mod probes;
mod room;
mod spectra;
mod warps;
mod white_face;

use crate::canvas::Canvas;
use mrt_core::reference::oracle_file::ReferenceError;
use mrt_core::reference::radiosity::ExactError;
use mrt_dictionary::progress::Cancelled;
use mrt_editor::cli::accuracy::AccuracyError;
use mrt_editor::cli::dictionary_source::{SourceError, load};
use mrt_editor::cli::table::Table;
use mrt_editor::render::file::WriteError;
use mrt_editor::render::level_view::ViewError;
use mrt_runtime::{AssembleError, Dictionary, LevelTextError, SkippedLight};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Draws the pictures that explain the method: bases, spectra, errors, warps, colours and probes.
#[derive(Clone, Debug, clap::Parser)]
#[command(name = "mrt-figures", version, max_term_width = 100)]
pub struct FiguresArgs {
    /// Folder for the pictures.
    #[arg(long, default_value = "docs/pictures")]
    pub out: PathBuf,
    /// Figures to draw [default: all].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAME,...")]
    pub only: Vec<Figure>,
    /// Dictionary file instead of the built-in one.
    #[arg(long)]
    pub dictionary: Option<PathBuf>,
    /// Further presets in `hops`, baked first: mobile, quality.
    #[arg(long, value_delimiter = ',', value_name = "PRESET,...")]
    pub presets: Vec<String>,
    /// Texels along an edge of a wall in figures that compute their own transport: spectra, warps, white-face.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u8).range(3..=32))]
    pub resolution: u8,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// A picture that can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Figure {
    /// Implicit lights and the indirect light that they make.
    Basis,
    /// How fast singular values fall.
    Spectra,
    /// Error against distance, for both couplings.
    Hops,
    /// Error of warped blocks, and a long hall.
    Warps,
    /// A red box with one white face.
    WhiteFace,
    /// Spheres lit by probes.
    Probes,
}

impl Figure {
    const ALL: [Figure; 6] = [
        Figure::Basis,
        Figure::Spectra,
        Figure::Hops,
        Figure::Warps,
        Figure::WhiteFace,
        Figure::Probes,
    ];

    /// Name of the file, without extension.
    fn name(self) -> &'static str {
        match self {
            Figure::Basis => "basis",
            Figure::Spectra => "spectra",
            Figure::Hops => "hops",
            Figure::Warps => "warps",
            Figure::WhiteFace => "white-face",
            Figure::Probes => "probes",
        }
    }

    fn draw(self, setting: &Setting) -> Result<Canvas, FigureError> {
        match self {
            Figure::Basis => basis::draw(setting),
            Figure::Spectra => spectra::draw(setting),
            Figure::Hops => hops::draw(setting),
            Figure::Warps => warps::draw(setting),
            Figure::WhiteFace => white_face::draw(setting),
            Figure::Probes => probes::draw(setting),
        }
    }
}

/// What figures are drawn from.
struct Setting<'a> {
    dictionary: &'a Dictionary,
    /// Further presets to compare.
    presets: &'a [String],
    /// Texels along an edge of a wall where a figure computes its own transport.
    resolution: usize,
}

/// Why a figure was not drawn.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// There is nothing to compare with.
    #[error(
        "the reference files are absent; expected them in the folder oracle of shared/ or of $MRT_SHARED"
    )]
    NoReferences,
    /// The dictionary lacks what the figure shows.
    #[error(
        "the dictionary has no {missing}; expected one that `mrt bake` wrote with its defaults"
    )]
    NotInDictionary {
        /// What it lacks.
        missing: &'static str,
    },
    /// No further dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A reference is at fault.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A comparison failed.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
    /// The exact solver refuses.
    #[error("exact solution: {0}")]
    Exact(#[from] ExactError),
    /// The built-in level is at fault.
    #[error("the built-in maze: {0}")]
    Level(#[from] LevelTextError),
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// A light is refused.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// Nothing can be seen.
    #[error(transparent)]
    View(#[from] ViewError),
}

impl FigureError {
    /// True where the figure's source is absent, which is no fault of anything.
    fn is_absence(&self) -> bool {
        matches!(
            self,
            FigureError::NoReferences | FigureError::NotInDictionary { .. }
        )
    }
}

/// Why figures are missing.
#[derive(Debug, thiserror::Error)]
pub enum FiguresError {
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A file stands where the folder should be.
    #[error("--out {file}: found a file; expected a folder or a new name")]
    OutIsFile {
        /// The file.
        file: String,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Some figures could not be drawn; the others were.
    #[error("{failed} of {count} figures could not be drawn (see above)")]
    Some {
        /// How many.
        failed: usize,
        /// Of how many.
        count: usize,
    },
    /// The report has no form as JSON.
    #[error("the report cannot be printed: {0}")]
    Report(#[from] serde_json::Error),
}

#[derive(Serialize)]
struct FiguresReport {
    preset: String,
    figures: Vec<FigureReport>,
}

#[derive(Serialize)]
struct FigureReport {
    figure: &'static str,
    file: String,
    size: [usize; 2],
    bytes: usize,
    seconds: f64,
}

/// Draws and writes the figures; one that fails is reported and the others are still drawn.
///
/// # Errors
/// [`FiguresError`]. A figure whose source is absent counts only if it was asked for by name.
pub fn run(args: &FiguresArgs) -> Result<(), FiguresError> {
    if args.out.exists() && !args.out.is_dir() {
        return Err(FiguresError::OutIsFile {
            file: args.out.display().to_string(),
        });
    }
    let dictionary = load(args.dictionary.as_deref(), None)?;
    let setting = Setting {
        dictionary: &dictionary,
        presets: &args.presets,
        resolution: usize::from(args.resolution),
    };
    let chosen: Vec<Figure> = Figure::ALL
        .into_iter()
        .filter(|figure| args.only.is_empty() || args.only.contains(figure))
        .collect();
    std::fs::create_dir_all(&args.out).map_err(|source| WriteError::Io {
        path: args.out.clone(),
        source,
    })?;
    let mut figures = Vec::new();
    let mut failed = 0;
    for (k, &figure) in chosen.iter().enumerate() {
        let name = figure.name();
        eprintln!("figure {} of {}: {name}", k + 1, chosen.len());
        let start = Instant::now();
        match figure.draw(&setting) {
            Ok(canvas) => {
                let path = args.out.join(format!("{name}.png"));
                figures.push(FigureReport {
                    figure: name,
                    file: path.display().to_string(),
                    size: canvas.size(),
                    bytes: canvas.write(&path)?,
                    seconds: start.elapsed().as_secs_f64(),
                });
            }
            Err(error) if error.is_absence() && args.only.is_empty() => {
                eprintln!("mrt-figures: {name} is left out: {error}");
            }
            Err(error) => {
                eprintln!("mrt-figures: {name}: {error}");
                failed += 1;
            }
        }
    }
    let report = FiguresReport {
        preset: dictionary.preset.clone(),
        figures,
    };
    if args.json {
        mrt_editor::report_line!("{}", serde_json::to_string(&report)?);
    } else {
        print(&report);
    }
    match failed {
        0 => Ok(()),
        failed => Err(FiguresError::Some {
            failed,
            count: chosen.len(),
        }),
    }
}

fn print(report: &FiguresReport) {
    let mut table = Table::new(&["figure", "file", "pixels", "kB", "s"]);
    for figure in &report.figures {
        let [width, height] = figure.size;
        table.row([
            figure.figure.to_owned(),
            figure.file.clone(),
            format!("{width} x {height}"),
            figure.bytes.div_ceil(1000).to_string(),
            format!("{:.1}", figure.seconds),
        ]);
    }
    mrt_editor::report!("{table}");
    mrt_editor::report_line!("dictionary: preset {}", report.preset);
}
