//! How fast singular values fall, of all that is truncated (the paper's table 2, and light that leaves by openings).

use super::error::FigureError;
use super::plot::{Axis, Plot, Scale, Stroke, draw_legend};
use super::source::FigureSource;
use crate::canvas::{Anchor, Area, Canvas, Colour, Lettering, PAPER, SERIES};
use mrt_core::linalg::matrix::Matrix;
use mrt_dictionary::modular::paths::emission::{emission_basis, emitter_radiosity};
use mrt_dictionary::modular::paths::ends::PathFrame;
use mrt_dictionary::modular::spectrum::{Spectrum, closed_cube_spectra};
use mrt_dictionary::progress::Progress;

/// Shares of energy that are marked.
const SHARES: [f64; 3] = [0.80, 0.90, 0.95];

/// Singular values below this share of the largest are left out.
const FLOOR: f64 = 1e-4;

pub(super) fn draw(source: &FigureSource) -> Result<Canvas, FigureError> {
    let series = series(source)?;
    let mut canvas = Canvas::titled(
        [900, 706],
        "How many modes light needs: singular values of a cube's light transport",
        &[
            "One bounce of any light (F) needs hundreds of modes; one bounce of light that lamps make (M) needs a handful.",
        ],
    );
    let plot = plot();
    plot.draw_axes(&mut canvas);
    for ((_, spectrum), colour) in series.iter().zip(SERIES) {
        draw_spectrum(&mut canvas, &plot, spectrum, colour);
    }
    let entries: Vec<(Stroke, String)> = series
        .iter()
        .zip(SERIES)
        .map(|((name, spectrum), colour)| {
            let [a, b, c] = SHARES.map(|share| spectrum.energy_rank(share));
            (stroke(colour), format!("{name}: {a} / {b} / {c}"))
        })
        .collect();
    let below = plot.area.y + plot.area.height + 62;
    canvas.text(
        [plot.area.x, below],
        Anchor::Start,
        Lettering::Remark,
        "modes that hold 80 / 90 / 95 % of the energy (small, middle, large ring):",
    );
    draw_legend(&mut canvas, [plot.area.x, below + 22], &entries);
    Ok(canvas)
}

/// Spectra and what they are of.
fn series(source: &FigureSource) -> Result<Vec<(String, Spectrum)>, FigureError> {
    let spectra = closed_cube_spectra(source.resolution, &Progress::silent())?;
    let named = spectra.into_iter().map(|spectrum| {
        let name = match spectrum.matrix {
            "L_d" => "L_d, light of lamps anywhere".to_owned(),
            "M" => "M = F P S (64 vectors), what that light becomes".to_owned(),
            name => format!("{name}, one bounce"),
        };
        (name, spectrum)
    });
    let mut series: Vec<(String, Spectrum)> = named.collect();
    if let Some(spectrum) = emission(source) {
        series.push(("light that leaves by an opening".to_owned(), spectrum));
    }
    Ok(series)
}

/// A line through the singular values, and a ring at each of [`SHARES`].
fn draw_spectrum(canvas: &mut Canvas, plot: &Plot, spectrum: &Spectrum, colour: Colour) {
    let values = &spectrum.singular_values;
    let points: Vec<[f64; 2]> = (1u32..)
        .zip(values)
        .map(|(k, value)| [f64::from(k), value / values[0]])
        .collect();
    plot.draw_series(canvas, &points, stroke(colour));
    for (share, radius) in SHARES.into_iter().zip([4.0, 5.5, 7.0]) {
        let rank = spectrum.energy_rank(share).max(1);
        if points[rank - 1][1] >= FLOOR {
            let at = plot.pixel(points[rank - 1]);
            canvas.disk(at, radius, colour);
            canvas.disk(at, radius - 2.0, PAPER);
        }
    }
}

fn stroke(colour: Colour) -> Stroke {
    Stroke {
        colour,
        is_dashed: false,
        mark: 0.0,
    }
}

fn plot() -> Plot {
    let tick = |value: f64| (value, value.to_string());
    Plot {
        area: Area {
            x: 74,
            y: 92,
            width: 796,
            height: 440,
        },
        x: Axis {
            label: "number of the mode",
            scale: Scale::Logarithmic,
            range: [1.0, 1600.0],
            ticks: [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0]
                .map(tick)
                .into(),
        },
        y: Axis {
            label: "singular value, relative to the largest",
            scale: Scale::Logarithmic,
            range: [FLOOR, 1.3],
            ticks: [1e-4, 1e-3, 1e-2, 1e-1, 1.0].map(tick).into(),
        },
    }
}

/// Singular values of the light that the dictionary's shapes send through their openings; `None` if the dictionary does not
/// hold it.
fn emission(source: &FigureSource) -> Option<Spectrum> {
    let resolution = source.dictionary.resolution;
    let sent: Vec<Matrix<f64>> = source
        .dictionary
        .shapes
        .iter()
        .filter(|entry| entry.implicit_lighting.columns() > 0)
        .flat_map(|entry| {
            let radiosity: Matrix<f64> = entry.implicit_lighting.cast();
            let shape = entry.shape;
            shape
                .openings
                .iter()
                .map(move |opening| {
                    let (face, frame) = (opening.face, PathFrame::Upright);
                    emitter_radiosity(shape, face, frame, &radiosity, resolution)
                })
                .collect::<Vec<_>>()
        })
        .collect();
    let basis = emission_basis(&sent, resolution, usize::MAX);
    (!basis.scales.is_empty()).then(|| Spectrum {
        matrix: "emission",
        size: [
            basis.radiosity.rows(),
            sent.iter().map(Matrix::columns).sum(),
        ],
        singular_values: basis.scales,
    })
}
