//! Error against distance: how far light may go before either coupling loses it.

use super::error::FigureError;
use super::plot::{Axis, Plot, Scale, Stroke, draw_legend};
use super::source::FigureSource;
use crate::canvas::{Anchor, Area, Canvas, Colour, Lettering, SERIES, TextStyle};
use mrt_core::reference::error_measure::HOP_GROUPS;
use mrt_core::reference::oracle_file::{ReferenceFile, WHITE_LEVELS, oracle_folder, read};
use mrt_editor::accuracy::reference_file::{CompareConfig, LightAccuracy, compare};
use mrt_editor::cli::dictionary_source::load;
use mrt_runtime::{Coupling, Dictionary};
use std::borrow::Cow;

/// Errors of exact transport between texels of the files' own resolution, %, as the description of the files states them:
/// noise of the files and of the texel grid, least and most of any file.
const REFERENCE_ERROR: [[f64; 2]; HOP_GROUPS] = [[0.1, 0.3], [0.1, 0.4], [0.2, 1.3], [0.6, 3.2]];

/// Pixels above the legend.
const LEGEND: i32 = 566;

/// Colour of the references' own errors.
const BAND: Colour = [238, 238, 240];

pub(super) fn draw(source: &FigureSource) -> Result<Canvas, FigureError> {
    let references = references()?;
    let mut dictionaries = vec![Cow::Borrowed(source.dictionary)];
    for preset in source.presets {
        dictionaries.push(Cow::Owned(load(None, Some(preset))?));
    }
    let series = 2 * dictionaries.len() as i32;
    let mut canvas = Canvas::titled(
        [900, LEGEND + 20 * series + 34],
        "Error of indirect light by distance from the lamp",
        &["First bounce, against path-traced references of six levels; mean over all lamps."],
    );
    let plot = plot();
    plot.draw_band(&mut canvas, &reference_band(&plot), BAND);
    plot.draw_axes(&mut canvas);
    let mut legend = Vec::new();
    for (dictionary, colour) in dictionaries.iter().zip(SERIES) {
        for (coupling, name) in [
            (Coupling::Table, "whole paths from a table"),
            (Coupling::Lightfield, "lightfields, opening by opening"),
        ] {
            let errors = Errors::measure(&references, dictionary, coupling)?;
            let stroke = Stroke {
                colour,
                is_dashed: coupling == Coupling::Lightfield,
                mark: 4.0,
            };
            let points = errors.points();
            plot.draw_series(&mut canvas, &points, stroke);
            // Numbers of several dictionaries would stand on each other.
            if dictionaries.len() == 1 {
                draw_numbers(&mut canvas, &plot, &points, stroke);
            }
            legend.push((stroke, errors.sentence(&dictionary.preset, name)));
        }
    }
    canvas.text(
        [20, LEGEND],
        Anchor::Start,
        Lettering::Remark,
        "Errors in %, by distance. Grey: what the references themselves are good to.",
    );
    draw_legend(&mut canvas, [20, LEGEND + 24], &legend);
    Ok(canvas)
}

fn references() -> Result<Vec<ReferenceFile>, FigureError> {
    let folder = oracle_folder().ok_or(FigureError::NoReferences)?;
    let read = |name: &&str| Ok(read(&folder.join(format!("{name}.json")))?);
    WHITE_LEVELS.iter().map(read).collect()
}

/// The errors of the references themselves: x, and y from and to.
fn reference_band(plot: &Plot) -> Vec<[f64; 3]> {
    let errors = (0u32..).zip(REFERENCE_ERROR);
    errors
        .map(|(hop, [low, high])| [f64::from(hop), low.max(plot.y.range[0]), high])
        .collect()
}

/// Mean errors over all lights, %.
struct Errors {
    whole: f64,
    /// By openings on the way.
    by_hop: [f64; HOP_GROUPS],
}

impl Errors {
    fn measure(
        references: &[ReferenceFile],
        dictionary: &Dictionary,
        coupling: Coupling,
    ) -> Result<Self, FigureError> {
        let config = CompareConfig {
            coupling,
            ..CompareConfig::default()
        };
        let mut lights: Vec<LightAccuracy> = Vec::new();
        for reference in references {
            lights.extend(compare(reference, dictionary, &config)?);
        }
        let mean =
            |values: Vec<f64>| 100.0 * values.iter().sum::<f64>() / values.len().max(1) as f64;
        let of_hop = |hop: usize| lights.iter().filter_map(move |l| l.rel_l2_by_hop[hop]);
        Ok(Self {
            whole: mean(lights.iter().map(|light| light.rel_l2).collect()),
            by_hop: std::array::from_fn(|hop| mean(of_hop(hop).collect())),
        })
    }

    fn points(&self) -> Vec<[f64; 2]> {
        let errors = (0u32..).zip(self.by_hop);
        errors.map(|(hop, error)| [f64::from(hop), error]).collect()
    }

    fn sentence(&self, preset: &str, name: &str) -> String {
        let numbers = self.by_hop.map(|error| format!("{error:.1}")).join(" / ");
        format!("{preset}, {name}: {numbers}, whole level {:.1}", self.whole)
    }
}

/// Each point's error beside it.
fn draw_numbers(canvas: &mut Canvas, plot: &Plot, points: &[[f64; 2]], stroke: Stroke) {
    for &point in points {
        let [x, y] = plot.pixel(point).map(|k| k as i32);
        // The better coupling's numbers stand below its line, the other's above.
        let offset = if stroke.is_dashed { -14 } else { 15 };
        let style = TextStyle {
            colour: stroke.colour,
            ..TextStyle::new(Anchor::Middle, Lettering::Remark)
        };
        canvas.styled_text([x, y + offset], style, &format!("{:.1}", point[1]));
    }
}

fn plot() -> Plot {
    let hops = [
        "same block",
        "next block",
        "2 openings on",
        "3 or more openings on",
    ];
    let percent = |value: f64| (value, format!("{value} %"));
    Plot {
        area: Area {
            x: 84,
            y: 92,
            width: 780,
            height: 400,
        },
        x: Axis {
            label: "from the lamp's block to the lit one",
            scale: Scale::Linear,
            range: [-0.35, 3.35],
            ticks: (0u32..)
                .zip(hops)
                .map(|(hop, name)| (f64::from(hop), name.to_owned()))
                .collect(),
        },
        y: Axis {
            label: "relative L2 error of irradiance",
            scale: Scale::Logarithmic,
            range: [0.2, 30.0],
            ticks: [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0].map(percent).into(),
        },
    }
}
