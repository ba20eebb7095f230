//! Run time against error, both logarithmic: what to draw and where, for any writer.

mod log_axis;
pub mod mark;
mod names;

use super::record::{Record, frontier};
use crate::canvas::{Anchor, Colour, INK, Lettering, PAPER, RULE, SERIES, TextStyle, mix};
use log_axis::{LogAxis, tick};
use mark::{AREA, Mark};
use names::{Names, PointName};
use std::collections::BTreeSet;

/// A method, and how it is shown.
struct Method {
    /// Name in records.
    name: &'static str,
    /// Name in the legend.
    title: &'static str,
    colour: Colour,
    /// Whether a line joins its points.
    is_joined: bool,
}

impl Method {
    const fn new(name: &'static str, title: &'static str, colour: Colour, is_joined: bool) -> Self {
        Self {
            name,
            title,
            colour,
            is_joined,
        }
    }
}

/// In the order of the legend.
const METHODS: [Method; 6] = [
    Method::new("mrt", "mrt", SERIES[0], false),
    Method::new("paper", "dense products (paper)", SERIES[1], false),
    Method::new("dense", "F of the level", SERIES[2], false),
    Method::new("svd", "truncated SVD of F", SERIES[5], true),
    Method::new("vpl", "virtual point lights", SERIES[3], true),
    Method::new("gather", "rays from texels", SERIES[4], true),
];

/// Which methods are shown, and which of their times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartView {
    /// All methods, from lights to indirect light.
    Methods,
    /// The frame and the dense products, from direct light to indirect light.
    Frame,
}

impl ChartView {
    /// Both views.
    pub const ALL: [ChartView; 2] = [ChartView::Methods, ChartView::Frame];

    /// The end of a picture's name, after the level's.
    pub fn suffix(self) -> &'static str {
        match self {
            ChartView::Methods => "",
            ChartView::Frame => "-frame",
        }
    }

    fn shows(self, record: &Record) -> bool {
        self == ChartView::Methods || ["mrt", "paper"].contains(&record.method)
    }

    fn ms(self, record: &Record) -> f64 {
        match self {
            ChartView::Methods => record.ms_from_lights,
            ChartView::Frame => record.ms,
        }
    }

    fn title(self) -> &'static str {
        match self {
            ChartView::Methods => "run time against error of the first bounce",
            ChartView::Frame => "run time of the indirect light against its error",
        }
    }

    fn time_label(self) -> &'static str {
        match self {
            ChartView::Methods => "ms from lights to indirect light",
            ChartView::Frame => "ms from direct light to indirect light",
        }
    }
}

/// A chart of the records of one level.
pub fn draw(level: &str, view: ChartView, records: &[Record], remarks: &[String]) -> Vec<Mark> {
    let chart = Chart::new(level, view, records);
    let mut marks = Vec::new();
    let title = format!("{level}: {}", view.title());
    draw_heading(&mut marks, &title, remarks);
    draw_axes(&mut marks, &chart.x, &chart.y, view);
    let mut names = Names::default();
    for method in METHODS.iter().rev() {
        chart.draw_lines(&mut marks, method);
        chart.draw_points(&mut marks, &mut names, method);
    }
    // Names come after all points, so that none hides one. The paper's way is named first.
    let (paper, others): (Vec<&Method>, _) = METHODS.iter().partition(|m| m.name == "paper");
    for method in paper.into_iter().chain(others) {
        chart.draw_names(&mut marks, &mut names, method);
    }
    draw_legend(&mut marks, &chart.shown);
    marks
}

/// The records of a level, and the axes that show them.
struct Chart<'a> {
    view: ChartView,
    shown: Vec<&'a Record>,
    /// Records of the frame that no other setting beats.
    best: Vec<&'a Record>,
    /// Milliseconds.
    x: LogAxis,
    /// Error, percent.
    y: LogAxis,
}

impl<'a> Chart<'a> {
    fn new(level: &str, view: ChartView, records: &'a [Record]) -> Self {
        let shown: Vec<&Record> = records
            .iter()
            .filter(|r| r.level == level && view.shows(r) && view.ms(r) > 0.0 && r.rel_l2 > 0.0)
            .collect();
        let [left, top, right, bottom] = AREA;
        let ours: Vec<&Record> = shown
            .iter()
            .copied()
            .filter(|r| r.method == "mrt")
            .collect();
        let points: Vec<[f64; 2]> = ours.iter().map(|r| [view.ms(r), r.rel_l2]).collect();
        let best = ours.into_iter().zip(frontier(&points));
        Self {
            view,
            best: best
                .filter(|(_, is_best)| *is_best)
                .map(|(r, _)| r)
                .collect(),
            x: LogAxis::new(shown.iter().map(|r| view.ms(r)), [left, right]),
            y: LogAxis::new(shown.iter().map(|r| 100.0 * r.rel_l2), [bottom, top]),
            shown,
        }
    }

    fn place(&self, record: &Record) -> [f32; 2] {
        let error = 100.0 * record.rel_l2;
        [self.x.place(self.view.ms(record)), self.y.place(error)]
    }

    fn of(&self, method: &Method) -> impl Iterator<Item = &'a Record> {
        let name = method.name;
        self.shown.iter().copied().filter(move |r| r.method == name)
    }

    /// False for settings of the frame that another setting beats.
    fn is_prominent(&self, record: &Record) -> bool {
        let is_best = self.best.iter().any(|&other| std::ptr::eq(other, record));
        record.method != "mrt" || is_best
    }

    fn draw_lines(&self, marks: &mut Vec<Mark>, method: &Method) {
        if method.is_joined {
            // Sweeps of another resolution have a line of their own.
            let resolutions: BTreeSet<usize> = self.of(method).map(|r| r.resolution).collect();
            for resolution in resolutions {
                let sweep = self.of(method).filter(|r| r.resolution == resolution);
                let points = sweep.map(|r| self.place(r)).collect();
                join(marks, points, method.colour, 1.5);
            }
        }
        if method.name == "mrt" {
            let points = self.best.iter().map(|r| self.place(r)).collect();
            join(marks, points, method.colour, 2.5);
        }
    }

    /// Faint points go under prominent ones.
    fn draw_points(&self, marks: &mut Vec<Mark>, names: &mut Names, method: &Method) {
        for is_prominent in [false, true] {
            let records = self.of(method);
            for record in records.filter(|r| self.is_prominent(r) == is_prominent) {
                let at = self.place(record);
                let (radius, colour) = match is_prominent {
                    false => (3.5, mix(method.colour, PAPER, 0.5)),
                    true => (5.0, method.colour),
                };
                marks.push(Mark::Disk { at, radius, colour });
                names.keep_clear(at);
            }
        }
    }

    fn draw_names(&self, marks: &mut Vec<Mark>, names: &mut Names, method: &Method) {
        for record in self.of(method).filter(|r| self.is_prominent(r)) {
            let sweep = method.is_joined.then_some(self.shown.as_slice());
            let name = PointName {
                at: self.place(record),
                text: short_name(record, sweep),
                colour: method.colour,
                is_on_line: method.is_joined || method.name == "mrt",
            };
            names.write(marks, name);
        }
    }
}

/// A line through points from left to right.
fn join(marks: &mut Vec<Mark>, mut points: Vec<[f32; 2]>, colour: Colour, width: f32) {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for pair in points.windows(2) {
        marks.push(Mark::Line {
            from: pair[0],
            to: pair[1],
            width,
            colour,
        });
    }
}

/// What a point's colour does not tell; at the start of one of several sweeps, also its resolution.
fn short_name(record: &Record, sweep: Option<&[&Record]>) -> String {
    let name = match record.method {
        "mrt" => record.method_case().replace('/', " "),
        "paper" => record.preset.clone(),
        "dense" => format!("{0}x{0}", record.resolution),
        "svd" => format!("rank {}", record.size),
        _ => record.size.to_string(),
    };
    let others = || {
        sweep
            .unwrap_or(&[])
            .iter()
            .filter(|r| r.method == record.method)
    };
    let is_one_of_several = others().any(|other| other.resolution != record.resolution);
    let mut same = others().filter(|other| other.resolution == record.resolution);
    match is_one_of_several && same.all(|other| other.size >= record.size) {
        true => format!("{name} ({0}x{0})", record.resolution),
        false => name,
    }
}

fn text(at: [i32; 2], anchor: Anchor, lettering: Lettering, text: impl Into<String>) -> Mark {
    Mark::Text {
        at,
        style: TextStyle::new(anchor, lettering),
        text: text.into(),
    }
}

fn draw_heading(marks: &mut Vec<Mark>, title: &str, remarks: &[String]) {
    marks.push(text([20, 24], Anchor::Start, Lettering::Title, title));
    for (k, remark) in (0..).zip(remarks) {
        let at = [20, 44 + 16 * k];
        marks.push(text(at, Anchor::Start, Lettering::Remark, remark));
    }
}

fn draw_axes(marks: &mut Vec<Mark>, x: &LogAxis, y: &LogAxis, view: ChartView) {
    let [left, top, right, bottom] = AREA;
    for value in x.ticks() {
        let at = [x.place(value) as i32, bottom as i32 + 16];
        marks.push(text(at, Anchor::Middle, Lettering::Label, tick(value)));
    }
    for value in y.ticks() {
        let at = [left as i32 - 8, y.place(value) as i32];
        marks.push(text(at, Anchor::End, Lettering::Label, tick(value)));
    }
    let mut line = |from: [f32; 2], to: [f32; 2], colour| {
        marks.push(Mark::Line {
            from,
            to,
            width: 1.0,
            colour,
        });
    };
    for value in x.ticks() {
        let at = x.place(value);
        line([at, top], [at, bottom], RULE);
    }
    for value in y.ticks() {
        let at = y.place(value);
        line([left, at], [right, at], RULE);
    }
    line([left, top], [left, bottom], INK);
    line([left, bottom], [right, bottom], INK);
    let below = [((left + right) / 2.0) as i32, bottom as i32 + 38];
    let above = [20, top as i32 - 12];
    let label = Lettering::Label;
    marks.push(text(below, Anchor::Middle, label, view.time_label()));
    marks.push(text(above, Anchor::Start, label, "error, % (relative L2)"));
}

fn draw_legend(marks: &mut Vec<Mark>, shown: &[&Record]) {
    let x = AREA[2] + 24.0;
    let mut y = AREA[1] + 8.0;
    let mut entry = |colour, radius, line_width: Option<f32>, name: &str| {
        if let Some(width) = line_width {
            marks.push(Mark::Line {
                from: [x, y],
                to: [x + 28.0, y],
                width,
                colour,
            });
        }
        marks.push(Mark::Disk {
            at: [x + 14.0, y],
            radius,
            colour,
        });
        let at = [x as i32 + 38, y as i32];
        marks.push(text(at, Anchor::Start, Lettering::Label, name));
        y += 24.0;
    };
    let is_shown = |method: &&Method| shown.iter().any(|r| r.method == method.name);
    for method in METHODS.iter().filter(is_shown) {
        let colour = method.colour;
        if method.name == "mrt" {
            entry(colour, 5.0, Some(2.5), "mrt, Pareto frontier");
            entry(mix(colour, PAPER, 0.5), 3.5, None, "mrt, other settings");
        } else {
            let line_width = method.is_joined.then_some(1.5);
            entry(colour, 5.0, line_width, method.title);
        }
    }
}
