//! Error against distance: how far light may go before either coupling loses it.

use super::plot::{Axis, Plot, Scale, Stroke, draw_legend};
use super::{FigureError, Setting};
use crate::canvas::{Area, Canvas, Colour, Lettering, SERIES, Side};
use mrt_core::reference::error_measure::HOP_GROUPS;
use mrt_core::reference::oracle_file::{ReferenceFile, oracle_folder, read};
use mrt_editor::cli::accuracy::{AccuracyArgs, BouncesArg, CouplingArg, LightAccuracy, compare};
use mrt_editor::cli::dictionary_source::load;
use mrt_runtime::{AssembleConfig, Dictionary};
use std::borrow::Cow;

/// Irradiance files whose levels every set of shapes can build.
const REFERENCES: [&str; 6] = [
    "cube",
    "corridor5",
    "l_turn",
    "t_junction",
    "room3x3",
    "maze11",
];

/// What exact transport between texels of the files' own resolution still differs by, %, as their
/// description says: noise of the files and the texel grid, least and most of any file.
const REFERENCE_ERROR: [[f64; 2]; HOP_GROUPS] = [[0.1, 0.3], [0.1, 0.4], [0.2, 1.3], [0.6, 3.2]];

/// Where the legend begins.
const LEGEND: i32 = 566;

const BAND: Colour = [238, 238, 240];

pub(super) fn draw(setting: &Setting) -> Result<Canvas, FigureError> {
    let folder = oracle_folder().ok_or(FigureError::NoReferences)?;
    let references: Vec<ReferenceFile> = REFERENCES
        .iter()
        .map(|name| read(&folder.join(format!("{name}.json"))))
        .collect::<Result<_, _>>()?;
    let mut dictionaries = vec![Cow::Borrowed(setting.dictionary)];
    for preset in setting.presets {
        dictionaries.push(Cow::Owned(load(None, Some(preset))?));
    }
    let series = 2 * dictionaries.len() as i32;
    let mut canvas = Canvas::titled(
        [900, LEGEND + 20 * series + 34],
        "Error of indirect light by distance from the lamp",
        &["First bounce, against path-traced references of six levels; mean over all lamps."],
    );
    let plot = plot();
    let band: Vec<[f64; 3]> = (0u32..)
        .zip(REFERENCE_ERROR)
        .map(|(hop, [low, high])| [f64::from(hop), low.max(plot.y.range[0]), high])
        .collect();
    plot.draw_band(&mut canvas, &band, BAND);
    plot.draw_axes(&mut canvas);
    let mut legend = Vec::new();
    for (dictionary, colour) in dictionaries.iter().zip(SERIES) {
        for (coupling, name) in [
            (CouplingArg::Table, "whole paths from a table"),
            (CouplingArg::Lightfield, "lightfields, opening by opening"),
        ] {
            let (whole, by_hop) = errors(&references, dictionary, coupling)?;
            let points: Vec<[f64; 2]> = (0u32..)
                .zip(by_hop)
                .map(|(hop, error)| [f64::from(hop), error])
                .collect();
            let stroke = Stroke {
                colour,
                is_dashed: coupling == CouplingArg::Lightfield,
                mark: 4.0,
            };
            plot.draw_series(&mut canvas, &points, stroke);
            // Numbers of several dictionaries would stand on each other.
            for &point in points.iter().filter(|_| dictionaries.len() == 1) {
                let [x, y] = plot.pixel(point).map(|k| k as i32);
                // The better coupling's numbers stand below its line, the other's above.
                let offset = if stroke.is_dashed { -14 } else { 15 };
                let text = format!("{:.1}", point[1]);
                canvas.coloured_text(
                    [x, y + offset],
                    Side::Middle,
                    Lettering::Remark,
                    colour,
                    &text,
                );
            }
            let numbers = by_hop.map(|error| format!("{error:.1}")).join(" / ");
            legend.push((
                stroke,
                format!(
                    "{}, {name}: {numbers}, whole level {whole:.1}",
                    dictionary.preset
                ),
            ));
        }
    }
    canvas.text(
        [20, LEGEND],
        Side::Right,
        Lettering::Remark,
        "Errors in %, by distance. Grey: what the references themselves are good to.",
    );
    draw_legend(&mut canvas, [20, LEGEND + 24], &legend);
    Ok(canvas)
}

/// Mean over all lights, %: of the whole level, and by openings on the way.
fn errors(
    references: &[ReferenceFile],
    dictionary: &Dictionary,
    coupling: CouplingArg,
) -> Result<(f64, [f64; HOP_GROUPS]), FigureError> {
    let args = AccuracyArgs {
        set: None,
        references: Vec::new(),
        preset: None,
        dictionary: None,
        bounces: BouncesArg::First,
        albedo: None,
        max_depth: AssembleConfig::default().max_depth,
        coupling,
        json: false,
    };
    let mut lights: Vec<LightAccuracy> = Vec::new();
    for reference in references {
        lights.extend(compare(reference, dictionary, &args)?);
    }
    let mean = |values: Vec<f64>| 100.0 * values.iter().sum::<f64>() / values.len().max(1) as f64;
    let by_hop = std::array::from_fn(|hop| {
        mean(
            lights
                .iter()
                .filter_map(|light| light.rel_l2_by_hop[hop])
                .collect(),
        )
    });
    Ok((
        mean(lights.iter().map(|light| light.rel_l2).collect()),
        by_hop,
    ))
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
