//! Plots: axes with units, lines through points, a legend.

use crate::canvas::{Area, Canvas, Colour, INK, Lettering, PAPER, RULE, Side};

/// How values become places along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long.
    Linear,
    /// Equal ratios are equally long.
    Logarithmic,
}

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: &'static str,
    /// Spacing.
    pub scale: Scale,
    /// Values at both ends.
    pub range: [f64; 2],
    /// Values that are named, and their names.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// Place of a value, 0 to 1 along the axis.
    fn place(&self, value: f64) -> f32 {
        let map = |x: f64| match self.scale {
            Scale::Linear => x,
            Scale::Logarithmic => x.max(1e-300).log10(),
        };
        let [low, high] = self.range.map(map);
        ((map(value) - low) / (high - low)) as f32
    }
}

/// How a series looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Of line and marks.
    pub colour: Colour,
    /// True for a line in dashes.
    pub is_dashed: bool,
    /// Radius of the marks at the points; 0 for none.
    pub mark: f32,
}

/// A plot and its place on the page.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Inside the axes.
    pub area: Area,
    /// Across.
    pub x: Axis,
    /// Up.
    pub y: Axis,
}

/// Pixels of a letter.
const LETTER: i32 = 8;
const LINE_WIDTH: f32 = 2.0;
/// Pixels of a dash and of the gap after it.
const DASH: [f32; 2] = [7.0, 5.0];

impl Plot {
    /// Grid, ticks and labels.
    pub fn draw_axes(&self, canvas: &mut Canvas) {
        let Area {
            x,
            y,
            width,
            height,
        } = self.area;
        for (value, name) in &self.x.ticks {
            let at = x + (self.x.place(*value) * width as f32) as i32;
            canvas.fill(
                Area {
                    x: at,
                    y,
                    width: 1,
                    height,
                },
                RULE,
            );
            canvas.text([at, y + height + 12], Side::Middle, Lettering::Label, name);
        }
        for (value, name) in &self.y.ticks {
            let at = y + height - (self.y.place(*value) * height as f32) as i32;
            canvas.fill(
                Area {
                    x,
                    y: at,
                    width,
                    height: 1,
                },
                RULE,
            );
            canvas.text([x - 7, at], Side::Left, Lettering::Label, name);
        }
        let axis = |x, y, width, height| Area {
            x,
            y,
            width,
            height,
        };
        canvas.fill(axis(x, y, 1, height), INK);
        canvas.fill(axis(x, y + height, width, 1), INK);
        let middle = x + width / 2;
        canvas.text(
            [middle, y + height + 32],
            Side::Middle,
            Lettering::Label,
            self.x.label,
        );
        // Upright text above the axis reads more easily than turned text beside it.
        canvas.text(
            [x - 40, y - 16],
            Side::Right,
            Lettering::Label,
            self.y.label,
        );
    }

    /// Pixel of a value.
    pub fn pixel(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        [
            self.area.x as f32 + self.x.place(x) * self.area.width as f32,
            (self.area.y + self.area.height) as f32 - self.y.place(y) * self.area.height as f32,
        ]
    }

    fn is_inside(&self, [x, y]: [f64; 2]) -> bool {
        let inside = |axis: &Axis, value| (-0.001..=1.001).contains(&axis.place(value));
        inside(&self.x, x) && inside(&self.y, y)
    }

    /// A line through points, as far as they lie inside the axes.
    pub fn draw_series(&self, canvas: &mut Canvas, points: &[[f64; 2]], stroke: Stroke) {
        let pixels: Vec<[f32; 2]> = points
            .iter()
            .copied()
            .take_while(|&point| self.is_inside(point))
            .map(|point| self.pixel(point))
            .collect();
        draw_line(canvas, &pixels, stroke);
        if stroke.mark > 0.0 {
            for &pixel in &pixels {
                canvas.disk(pixel, stroke.mark, stroke.colour);
            }
        }
    }

    /// A light band between two lines that share their x.
    pub fn draw_band(&self, canvas: &mut Canvas, band: &[[f64; 3]], colour: Colour) {
        for pair in band.windows(2) {
            let [[x0, low0, high0], [x1, low1, high1]] = [pair[0], pair[1]];
            let [left, right] = [x0, x1].map(|x| self.pixel([x, high0])[0] as i32);
            for x in left..right {
                let t = (x - left) as f32 / (right - left) as f32;
                let between = |a: f64, b: f64| {
                    let [a, b] = [a, b].map(|y| self.pixel([x0, y])[1]);
                    (a + t * (b - a)) as i32
                };
                let (top, bottom) = (between(high0, high1), between(low0, low1));
                let bottom = bottom.min(self.area.y + self.area.height);
                canvas.fill(
                    Area {
                        x,
                        y: top,
                        width: 1,
                        height: bottom - top,
                    },
                    colour,
                );
            }
        }
    }
}

fn draw_line(canvas: &mut Canvas, pixels: &[[f32; 2]], stroke: Stroke) {
    // Dashes go on around corners.
    let mut run = 0.0;
    for pair in pixels.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let length = ((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)).sqrt();
        if !stroke.is_dashed {
            canvas.line(pair[0], pair[1], LINE_WIDTH, stroke.colour);
            continue;
        }
        let at = |s: f32| [x0 + s / length * (x1 - x0), y0 + s / length * (y1 - y0)];
        let period = DASH[0] + DASH[1];
        let mut start = -(run % period);
        while start < length {
            let (from, to) = (start.max(0.0), (start + DASH[0]).min(length));
            if to > from {
                canvas.line(at(from), at(to), LINE_WIDTH, stroke.colour);
            }
            start += period;
        }
        run += length;
    }
}

/// Names of series beside samples of their lines, downwards from a point.
pub fn draw_legend(canvas: &mut Canvas, [x, y]: [i32; 2], entries: &[(Stroke, String)]) {
    for (k, (stroke, name)) in entries.iter().enumerate() {
        let y = y + 20 * k as i32;
        // Names stand on the page, not on the grid.
        let width = 40 + LETTER * name.chars().count() as i32;
        canvas.fill(
            Area {
                x: x - 4,
                y: y - 10,
                width,
                height: 20,
            },
            PAPER,
        );
        let [left, right] = [[x as f32, y as f32], [(x + 26) as f32, y as f32]];
        draw_line(canvas, &[left, right], *stroke);
        if stroke.mark > 0.0 {
            canvas.disk([(x + 13) as f32, y as f32], stroke.mark, stroke.colour);
        }
        canvas.text([x + 36, y], Side::Right, Lettering::Label, name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_equally_long_on_a_logarithmic_axis() {
        let axis = Axis {
            label: "",
            scale: Scale::Logarithmic,
            range: [1.0, 100.0],
            ticks: Vec::new(),
        };
        for (value, place) in [(1.0, 0.0), (10.0, 0.5), (100.0, 1.0)] {
            assert!((axis.place(value) - place).abs() < 1e-6);
        }
    }
}
