//! Run time against error, both logarithmic: what to draw and where, for any writer.

use super::record::{Record, frontier};
use crate::canvas::{Colour, FAINT_INK, INK, PAPER, RULE, SERIES, mix};
use crate::canvas::{Lettering, Side};
use std::collections::BTreeSet;

/// Pixels across and down.
pub const SIZE: [i32; 2] = [1120, 640];

/// Inside the axes: left, top, right, bottom.
const AREA: [f32; 4] = [84.0, 96.0, 850.0, 570.0];

/// Something to draw.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A line.
    Line {
        /// Start.
        from: [f32; 2],
        /// End.
        to: [f32; 2],
        /// Pixels.
        width: f32,
        /// Its colour.
        colour: Colour,
    },
    /// A disk.
    Disk {
        /// Centre.
        at: [f32; 2],
        /// Pixels.
        radius: f32,
        /// Its colour.
        colour: Colour,
    },
    /// A line of text.
    Text {
        /// Its point, at half its height.
        at: [i32; 2],
        /// Where it stands there.
        side: Side,
        /// How it looks.
        lettering: Lettering,
        /// Its colour.
        colour: Colour,
        /// What it says.
        text: String,
    },
}

/// Methods in the order of the legend: name in records, name for people, colour, and whether points are joined.
const METHODS: [(&str, &str, Colour, bool); 6] = [
    ("mrt", "mrt", SERIES[0], false),
    ("paper", "dense products (paper)", SERIES[1], false),
    ("dense", "F of the level", SERIES[2], false),
    ("svd", "truncated SVD of F", SERIES[5], true),
    ("vpl", "virtual point lights", SERIES[3], true),
    ("gather", "rays from texels", SERIES[4], true),
];

/// What is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// All methods, from lights to indirect light.
    Methods,
    /// The frame and the dense products, from direct light to indirect light.
    Frame,
}

impl View {
    /// Both.
    pub const ALL: [View; 2] = [View::Methods, View::Frame];

    /// What it adds to the name of a level's picture.
    pub fn suffix(self) -> &'static str {
        match self {
            View::Methods => "",
            View::Frame => "-frame",
        }
    }

    fn shows(self, record: &Record) -> bool {
        self == View::Methods || ["mrt", "paper"].contains(&record.method)
    }

    fn ms(self, record: &Record) -> f64 {
        match self {
            View::Methods => record.ms_from_lights,
            View::Frame => record.ms,
        }
    }

    fn title(self) -> &'static str {
        match self {
            View::Methods => "run time against error of the first bounce",
            View::Frame => "run time of the indirect light against its error",
        }
    }

    fn time_label(self) -> &'static str {
        match self {
            View::Methods => "ms from lights to indirect light",
            View::Frame => "ms from direct light to indirect light",
        }
    }
}

/// A logarithmic axis.
struct Axis {
    /// Decimal logarithms at both ends.
    range: [f64; 2],
    /// Pixels at both ends.
    pixels: [f32; 2],
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, pixels: [f32; 2]) -> Self {
        let logarithms = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        // Points keep off the frame, and half a decade is shown at least.
        let margin = (0.25 - 0.5 * (high - low))
            .max(0.06 * (high - low))
            .max(0.1);
        Self {
            range: [low - margin, high + margin],
            pixels,
        }
    }

    fn place(&self, value: f64) -> f32 {
        let [low, high] = self.range;
        let share = (value.max(1e-300).log10() - low) / (high - low);
        self.pixels[0] + share as f32 * (self.pixels[1] - self.pixels[0])
    }

    /// Values to name: powers of ten, with some between them where there is room.
    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        let steps: &[f64] = match high - low {
            4.0.. => &[1.0],
            1.0..4.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        };
        let powers = low.floor() as i32..=high.ceil() as i32;
        powers
            .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
            .filter(|value| (low..=high).contains(&value.log10()))
            .collect()
    }
}

/// A picture of the records of one level.
pub fn draw(level: &str, view: View, records: &[Record], remarks: &[String]) -> Vec<Mark> {
    let shown: Vec<&Record> = records
        .iter()
        .filter(|r| r.level == level && view.shows(r) && view.ms(r) > 0.0 && r.rel_l2 > 0.0)
        .collect();
    let [left, top, right, bottom] = AREA;
    let x = Axis::new(shown.iter().map(|r| view.ms(r)), [left, right]);
    let y = Axis::new(shown.iter().map(|r| 100.0 * r.rel_l2), [bottom, top]);
    let place = |r: &Record| [x.place(view.ms(r)), y.place(100.0 * r.rel_l2)];
    let mut marks = Vec::new();
    draw_frame(
        &mut marks,
        &format!("{level}: {}", view.title()),
        remarks,
        &x,
        &y,
    );
    draw_labels(&mut marks, view);
    let ours: Vec<&Record> = shown
        .iter()
        .copied()
        .filter(|r| r.method == "mrt")
        .collect();
    let points: Vec<[f64; 2]> = ours.iter().map(|r| [view.ms(r), r.rel_l2]).collect();
    let mut best: Vec<&Record> = Vec::new();
    best.extend(
        ours.iter()
            .zip(frontier(&points))
            .filter(|(_, is)| *is)
            .map(|(r, _)| r),
    );
    let is_best = |record: &Record| best.iter().any(|&other| std::ptr::eq(other, record));
    let mut names = Names::default();
    for &(method, _, colour, is_joined) in METHODS.iter().rev() {
        let of_method = || shown.iter().copied().filter(|r| r.method == method);
        if is_joined {
            // Sweeps of another resolution have a line of their own.
            let resolutions: BTreeSet<usize> = of_method().map(|r| r.resolution).collect();
            for resolution in resolutions {
                let sweep = of_method().filter(|r| r.resolution == resolution);
                join(&mut marks, sweep.map(place).collect(), colour, 1.5);
            }
        }
        if method == "mrt" {
            join(
                &mut marks,
                best.iter().map(|r| place(r)).collect(),
                colour,
                2.5,
            );
        }
        // What is faint goes under what is not.
        for pass in [false, true] {
            for record in of_method().filter(|r| (method != "mrt" || is_best(r)) == pass) {
                let at = place(record);
                let (radius, colour) = match pass {
                    false => (3.5, mix(colour, PAPER, 0.5)),
                    true => (5.0, colour),
                };
                marks.push(Mark::Disk { at, radius, colour });
                names.keep_clear(at);
            }
        }
    }
    // Names after all points, so that none hides one; what the frame is compared with is named first.
    let mut named_first = METHODS;
    named_first.sort_by_key(|(method, ..)| *method != "paper");
    for (method, _, colour, is_joined) in named_first {
        for record in shown.iter().filter(|r| r.method == method) {
            if method != "mrt" || is_best(record) {
                let name = short_name(record, is_joined.then_some(shown.as_slice()));
                let is_on_line = is_joined || method == "mrt";
                names.write(&mut marks, place(record), name, (colour, is_on_line));
            }
        }
    }
    draw_legend(&mut marks, &shown);
    marks
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

/// What a point's colour does not say; at the start of one of several sweeps, its resolution.
fn short_name(record: &Record, sweep: Option<&[&Record]>) -> String {
    let name = match record.method {
        "mrt" => record.way().replace('/', " "),
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

fn draw_frame(marks: &mut Vec<Mark>, title: &str, remarks: &[String], x: &Axis, y: &Axis) {
    let [left, top, right, bottom] = AREA;
    let mut text = |at: [i32; 2], side, lettering, colour, text: String| {
        marks.push(Mark::Text {
            at,
            side,
            lettering,
            colour,
            text,
        });
    };
    text(
        [20, 24],
        Side::Right,
        Lettering::Title,
        INK,
        title.to_owned(),
    );
    for (k, remark) in (0..).zip(remarks) {
        let at = [20, 44 + 16 * k];
        text(
            at,
            Side::Right,
            Lettering::Remark,
            FAINT_INK,
            remark.clone(),
        );
    }
    for value in x.ticks() {
        let at = [x.place(value) as i32, bottom as i32 + 16];
        text(at, Side::Middle, Lettering::Label, INK, tick(value));
    }
    for value in y.ticks() {
        let at = [left as i32 - 8, y.place(value) as i32];
        text(at, Side::Left, Lettering::Label, INK, tick(value));
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
}

fn draw_labels(marks: &mut Vec<Mark>, view: View) {
    let [left, top, right, bottom] = AREA;
    let below = [((left + right) / 2.0) as i32, bottom as i32 + 38];
    let above = [20, top as i32 - 12];
    for (at, side, text) in [
        (below, Side::Middle, view.time_label()),
        (above, Side::Right, "error, % (relative L2)"),
    ] {
        marks.push(Mark::Text {
            at,
            side,
            lettering: Lettering::Label,
            colour: INK,
            text: text.to_owned(),
        });
    }
}

/// A value with one or two digits that mean something, without an exponent where it is short.
fn tick(value: f64) -> String {
    if value >= 1e7 {
        return format!("{value:.0e}");
    }
    // Values between powers are computed, and may be off by a rounding.
    let rounded = format!("{value:.9}");
    rounded
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_owned()
}

fn draw_legend(marks: &mut Vec<Mark>, shown: &[&Record]) {
    let present = METHODS
        .iter()
        .filter(|(method, ..)| shown.iter().any(|r| r.method == *method));
    let x = AREA[2] + 24.0;
    let mut y = AREA[1] + 8.0;
    let mut entry = |colour, radius, joined: Option<f32>, name: &str| {
        if let Some(width) = joined {
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
        marks.push(Mark::Text {
            at: [x as i32 + 38, y as i32],
            side: Side::Right,
            lettering: Lettering::Label,
            colour: INK,
            text: name.to_owned(),
        });
        y += 24.0;
    };
    for &(method, name, colour, is_joined) in present {
        if method == "mrt" {
            entry(colour, 5.0, Some(2.5), "mrt, Pareto frontier");
            entry(mix(colour, PAPER, 0.5), 3.5, None, "mrt, other settings");
        } else {
            entry(colour, 5.0, is_joined.then_some(1.5), name);
        }
    }
}

/// Places of names that do not cover each other or points.
#[derive(Default)]
struct Names {
    /// Left, top, right, bottom.
    taken: Vec<[f32; 4]>,
}

impl Names {
    /// Pixels of a letter, and of a line.
    const LETTER: [f32; 2] = [7.0, 13.0];

    fn keep_clear(&mut self, [x, y]: [f32; 2]) {
        self.taken.push([x - 5.0, y - 5.0, x + 5.0, y + 5.0]);
    }

    /// Writes a name beside its point, where there is room; leaves it out where there is none.
    fn write(
        &mut self,
        marks: &mut Vec<Mark>,
        [x, y]: [f32; 2],
        text: String,
        (colour, is_on_line): (Colour, bool),
    ) {
        let width = Self::LETTER[0] * text.chars().count() as f32;
        let half = Self::LETTER[1] / 2.0;
        let right = (Side::Right, x + 9.0, x + 9.0);
        let left = (Side::Left, x - 9.0, x - 9.0 - width);
        let middle = (Side::Middle, x, x - width / 2.0);
        let places = [(right, 0.0), (left, 0.0), (middle, -15.0), (middle, 15.0)];
        let near = [(right, -13.0), (right, 13.0), (left, -13.0), (left, 13.0)];
        let far = [(right, -26.0), (right, 26.0), (left, -26.0), (left, 26.0)];
        // Names on a line would be struck through by it; all of these fall.
        let first = if is_on_line { &near[..] } else { &places[..] };
        for &((side, at, start), offset) in first.iter().chain(&places).chain(&near).chain(&far) {
            let room = [start, y + offset - half, start + width, y + offset + half];
            let is_inside = room[0] > AREA[0] && room[2] < AREA[2] + 10.0 && room[3] < AREA[3];
            let overlaps = |other: &[f32; 4]| {
                room[0] < other[2] && other[0] < room[2] && room[1] < other[3] && other[1] < room[3]
            };
            if is_inside && !self.taken.iter().any(overlaps) {
                self.taken.push(room);
                marks.push(Mark::Text {
                    at: [at as i32, (y + offset) as i32],
                    side,
                    lettering: Lettering::Remark,
                    colour: mix(colour, INK, 0.35),
                    text,
                });
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_on_their_axis_in_its_order() {
        let axis = Axis::new([0.03, 40.0].into_iter(), [0.0, 100.0]);
        let ticks = axis.ticks();
        assert!(ticks.len() > 3);
        let places: Vec<f32> = ticks.iter().map(|&t| axis.place(t)).collect();
        assert!(places.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(places.iter().all(|p| (0.0..=100.0).contains(p)));
        assert_eq!(tick(0.05), "0.05");
        assert_eq!(tick(200.0), "200");
    }

    #[test]
    fn names_do_not_cover_each_other() {
        let (mut names, mut marks) = (Names::default(), Vec::new());
        for _ in 0..20 {
            names.write(
                &mut marks,
                [400.0, 300.0],
                "a name".to_owned(),
                (INK, false),
            );
        }
        assert!(marks.len() > 1 && marks.len() < 9, "{}", marks.len());
    }
}
