//! Names beside points that cover neither each other nor points.

use super::mark::{AREA, Mark};
use crate::canvas::{Anchor, Colour, INK, Lettering, TextStyle, mix};

/// A name to write beside its point.
pub(super) struct PointName {
    pub(super) at: [f32; 2],
    pub(super) text: String,
    /// Of the point.
    pub(super) colour: Colour,
    /// Whether a line runs through the point.
    pub(super) is_on_line: bool,
}

/// Boxes that are covered already: left, top, right, bottom.
#[derive(Default)]
pub(super) struct Names(Vec<[f32; 4]>);

impl Names {
    /// Pixels of a letter, and of a line.
    const LETTER: [f32; 2] = [7.0, 13.0];

    /// Keeps names off a point.
    pub(super) fn keep_clear(&mut self, [x, y]: [f32; 2]) {
        self.0.push([x - 5.0, y - 5.0, x + 5.0, y + 5.0]);
    }

    /// Writes a name where there is room beside its point; leaves it out where there is none.
    pub(super) fn write(&mut self, marks: &mut Vec<Mark>, name: PointName) {
        let [x, y] = name.at;
        let width = Self::LETTER[0] * name.text.chars().count() as f32;
        let half = Self::LETTER[1] / 2.0;
        let right = (Anchor::Start, x + 9.0, x + 9.0);
        let left = (Anchor::End, x - 9.0, x - 9.0 - width);
        let middle = (Anchor::Middle, x, x - width / 2.0);
        let places = [(right, 0.0), (left, 0.0), (middle, -15.0), (middle, 15.0)];
        let near = [(right, -13.0), (right, 13.0), (left, -13.0), (left, 13.0)];
        let far = [(right, -26.0), (right, 26.0), (left, -26.0), (left, 26.0)];
        // A line would strike through names at the height of its points.
        let first = if name.is_on_line {
            &near[..]
        } else {
            &places[..]
        };
        for &((anchor, at, start), offset) in first.iter().chain(&places).chain(&near).chain(&far) {
            let room = [start, y + offset - half, start + width, y + offset + half];
            if self.is_free(room) {
                self.0.push(room);
                marks.push(Mark::Text {
                    at: [at as i32, (y + offset) as i32],
                    style: TextStyle {
                        colour: mix(name.colour, INK, 0.35),
                        ..TextStyle::new(anchor, Lettering::Remark)
                    },
                    text: name.text,
                });
                return;
            }
        }
    }

    fn is_free(&self, room: [f32; 4]) -> bool {
        let is_inside = room[0] > AREA[0] && room[2] < AREA[2] + 10.0 && room[3] < AREA[3];
        let overlaps = |other: &[f32; 4]| {
            room[0] < other[2] && other[0] < room[2] && room[1] < other[3] && other[1] < room[3]
        };
        is_inside && !self.0.iter().any(overlaps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_cover_each_other() {
        let (mut names, mut marks) = (Names::default(), Vec::new());
        for _ in 0..20 {
            let name = PointName {
                at: [400.0, 300.0],
                text: "a name".to_owned(),
                colour: INK,
                is_on_line: false,
            };
            names.write(&mut marks, name);
        }
        assert!(marks.len() > 1 && marks.len() < 9, "{}", marks.len());
    }
}
