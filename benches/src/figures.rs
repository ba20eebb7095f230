//! `mrt-figures`: draws the pictures that explain the method, those of `docs/FIGURES.md`.

mod basis;
mod error;
mod hops;
mod plot;
mod probes;
mod room;
mod source;
mod spectra;
mod warps;
mod white_face;

pub use error::{FigureError, FiguresError};

use crate::canvas::Canvas;
use mrt_core::excerpt::excerpt;
use mrt_editor::cli::dictionary_source::load;
use mrt_editor::cli::output::{print_report, warn};
use mrt_editor::cli::output_files::OutputFiles;
use mrt_editor::cli::table::Table;
use mrt_editor::render::file::{WriteError, make_folder};
use serde::Serialize;
use source::FigureSource;
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

impl FiguresArgs {
    /// The figures asked for, or all.
    fn figures(&self) -> Vec<Figure> {
        let is_asked_for = |figure: &Figure| self.only.is_empty() || self.only.contains(figure);
        Figure::ALL.into_iter().filter(is_asked_for).collect()
    }
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

    fn draw(self, source: &FigureSource) -> Result<Canvas, FigureError> {
        match self {
            Figure::Basis => basis::draw(source),
            Figure::Spectra => spectra::draw(source),
            Figure::Hops => hops::draw(source),
            Figure::Warps => warps::draw(source),
            Figure::WhiteFace => white_face::draw(source),
            Figure::Probes => probes::draw(source),
        }
    }
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

/// Draws and writes the figures. A figure that fails is reported, and the others are still drawn.
///
/// # Errors
/// [`FiguresError`]. A figure whose source is absent counts only if it was asked for by name.
pub fn run(args: &FiguresArgs) -> Result<(), FiguresError> {
    let outputs = OutputFiles::new(args.dictionary.as_deref());
    outputs.check_folder("--out", &args.out, &["png"])?;
    let dictionary = load(args.dictionary.as_deref(), None)?;
    let source = FigureSource {
        dictionary: &dictionary,
        presets: &args.presets,
        resolution: usize::from(args.resolution),
    };
    let chosen = args.figures();
    make_folder(&args.out)?;
    let mut figures = Vec::new();
    let mut failed = 0;
    for (k, &figure) in chosen.iter().enumerate() {
        let name = figure.name();
        eprintln!("figure {} of {}: {name}", k + 1, chosen.len());
        let start = Instant::now();
        match figure.draw(&source) {
            Ok(canvas) => figures.push(write(args, name, &canvas, start)?),
            Err(error) if error.is_absence() && args.only.is_empty() => {
                warn(format_args!("{name} is left out: {error}"));
            }
            Err(error) => {
                warn(format_args!("{name}: {error}"));
                failed += 1;
            }
        }
    }
    let report = FiguresReport {
        preset: dictionary.preset.clone(),
        figures,
    };
    print_report(&report, args.json, print)?;
    match failed {
        0 => Ok(()),
        failed => Err(FiguresError::Some {
            failed,
            count: chosen.len(),
        }),
    }
}

fn write(
    args: &FiguresArgs,
    name: &'static str,
    canvas: &Canvas,
    start: Instant,
) -> Result<FigureReport, WriteError> {
    let path = args.out.join(format!("{name}.png"));
    Ok(FigureReport {
        figure: name,
        file: path.display().to_string(),
        size: canvas.size(),
        bytes: canvas.write(&path)?,
        seconds: start.elapsed().as_secs_f64(),
    })
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
    mrt_editor::report_line!("dictionary: preset {}", excerpt(&report.preset));
}
