//! Paths of light through openings, in canonical form.
//!
//! A straight ray through a grid of cubes never uses two opposite headings. A symmetry of the cube makes its first
//! heading +z, the first other heading +x, and the third +y. So a path is a word over the letters z, x and y. A
//! dictionary stores one operator for each word; for a path in a level, assembly finds the word, and the symmetry that
//! takes the word to the path.
//!
//! Light leaves the canonical emitter, a unit cube, through z = 1. Light enters the canonical receiver, a unit cube,
//! through z = 0, heading for +z.

use crate::level::shape::{Hole, Outline};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;

/// Most openings that a path of a table crosses: the length of the longest word.
pub const MAX_WORD: usize = 12;

/// One crossing of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Crossing {
    /// Direction of travel: +x, +y or +z.
    pub heading: Face,
    /// The hole that the path passes; `None` for a missing face.
    pub hole: Option<HoleIndex>,
}

/// Position of a hole in [`Hole::ALL`].
pub type HoleIndex = u8;

/// A canonical path: a sequence of crossings, the first with heading +z.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Word(Vec<Crossing>);

impl Word {
    /// The crossings, at least one.
    pub fn crossings(&self) -> &[Crossing] {
        &self.0
    }

    /// The word with one more crossing.
    pub fn then(&self, crossing: Crossing) -> Word {
        let mut crossings = self.0.clone();
        crossings.push(crossing);
        Word(crossings)
    }

    /// Heading of the last crossing.
    pub fn last_heading(&self) -> Face {
        self.0
            .last()
            .map_or(Face::PosZ, |crossing| crossing.heading)
    }

    /// True if a crossing has this heading.
    pub fn uses(&self, heading: Face) -> bool {
        self.0.iter().any(|crossing| crossing.heading == heading)
    }

    /// All words without a hole of up to `depth` crossings, and all with exactly one hole of up to `hole_depth`
    /// crossings. Without `vertical`, no word has heading +y.
    pub fn all(depth: usize, hole_depth: usize, holes: &[Hole], vertical: bool) -> Vec<Word> {
        let mut words = Vec::new();
        let mut front = vec![Word::default()];
        for length in 1..=depth.max(hole_depth) {
            let mut next = Vec::new();
            for word in &front {
                let mut headings = vec![Face::PosZ];
                if !word.0.is_empty() {
                    headings.push(Face::PosX);
                }
                if vertical && word.uses(Face::PosX) {
                    headings.push(Face::PosY);
                }
                for heading in headings {
                    let has_hole = word.0.iter().any(|crossing| crossing.hole.is_some());
                    let fits = if has_hole { hole_depth } else { depth };
                    if length <= fits || (!has_hole && length <= hole_depth) {
                        next.push(word.then(Crossing {
                            heading,
                            hole: None,
                        }));
                    }
                    // Doors and windows are in side faces, and stand upright along y.
                    if !has_hole && length <= hole_depth && heading != Face::PosY {
                        next.extend(holes.iter().map(|hole| {
                            word.then(Crossing {
                                heading,
                                hole: Some(hole.index() as HoleIndex),
                            })
                        }));
                    }
                }
            }
            words.extend(next.iter().cloned());
            front = next;
        }
        words.retain(|word| {
            let has_hole = word.0.iter().any(|crossing| crossing.hole.is_some());
            word.0.len() <= if has_hole { hole_depth } else { depth }
        });
        words
    }

    /// The word as text: one letter for each crossing, followed by `d` for a door or `w` for a window.
    pub fn name(&self) -> String {
        let mut name = String::new();
        for crossing in &self.0 {
            name.push(['x', 'y', 'z'][crossing.heading.axis()]);
            if let Some(hole) = crossing.hole {
                name.push(HOLE_LETTERS[usize::from(hole)]);
            }
        }
        name
    }

    /// The word with that [`name`](Word::name); `None` if the text is not a canonical word of up to [`MAX_WORD`]
    /// crossings.
    pub fn from_name(name: &str) -> Option<Word> {
        let mut word = Word::default();
        for letter in name.chars() {
            if let Some(hole) = HOLE_LETTERS.iter().position(|&l| l == letter) {
                let last = word.0.last_mut()?;
                if last.hole.is_some() {
                    return None;
                }
                last.hole = Some(hole as HoleIndex);
                continue;
            }
            let heading = match letter {
                'z' => Face::PosZ,
                'x' if !word.0.is_empty() => Face::PosX,
                'y' if word.uses(Face::PosX) => Face::PosY,
                _ => return None,
            };
            // A name from a hostile file may be as long as the file.
            if word.0.len() == MAX_WORD {
                return None;
            }
            word.0.push(Crossing {
                heading,
                hole: None,
            });
        }
        (!word.0.is_empty()).then_some(word)
    }

    /// The cell, relative to the emitter's, that the path is in after each crossing.
    pub fn cells(&self) -> impl Iterator<Item = [i32; 3]> + '_ {
        self.0.iter().scan([0; 3], |cell, crossing| {
            cell[crossing.heading.axis()] += 1;
            Some(*cell)
        })
    }
}

/// The letter of each of [`Hole::ALL`] in names of words.
const HOLE_LETTERS: [char; 2] = ['d', 'w'];

/// Index of the hole of an opening; `None` if it is not a hole.
pub fn hole_of(outline: Outline) -> Option<HoleIndex> {
    match outline {
        Outline::Whole | Outline::Disc => None,
        Outline::Hole(hole) => Some(hole.index() as HoleIndex),
    }
}

/// The reference frame of a heading: the rotation that takes the canonical heading +z to it. For side headings, +y
/// stays up; for the other two, +y turns to +z or -z.
pub fn frame_of_heading(heading: Face) -> CubeSymmetry {
    let images = match heading {
        Face::PosZ => [Face::PosX, Face::PosY, Face::PosZ],
        Face::NegZ => [Face::NegX, Face::PosY, Face::NegZ],
        Face::PosX => [Face::NegZ, Face::PosY, Face::PosX],
        Face::NegX => [Face::PosZ, Face::PosY, Face::NegX],
        Face::PosY => [Face::PosX, Face::NegZ, Face::PosY],
        Face::NegY => [Face::PosX, Face::PosZ, Face::NegY],
    };
    CubeSymmetry::from_images(images[0], images[1], images[2]).unwrap_or(CubeSymmetry::IDENTITY)
}

/// The difference between a frame and the reference frame of its heading ([`frame_of_heading`]): `frame = reference
/// after exchange after mirrors`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Roll {
    /// Whether x and y are exchanged.
    pub exchanged: bool,
    /// Mirrors that are applied before the exchange: bit 0 for x, bit 1 for y.
    pub mirrors: u8,
}

impl Roll {
    /// The roll of a frame.
    pub fn of(frame: CubeSymmetry) -> Roll {
        let reference = frame_of_heading(frame.face(Face::PosZ));
        let g = reference.inverse().after(frame);
        let exchanged = g.face(Face::PosX).axis() == 1;
        let mirrors = if exchanged {
            CubeSymmetry::exchange(0, 1).after(g)
        } else {
            g
        };
        let flipped = |face: Face| u8::from(!mirrors.face(face).is_positive());
        Roll {
            exchanged,
            mirrors: flipped(Face::PosX) | flipped(Face::PosY) << 1,
        }
    }

    /// Sign that the mirrors give a mode. Its parity has bit 0 set if the mode is odd in x, bit 1 if odd in y.
    pub fn sign(self, parity: u8) -> f32 {
        if (parity & self.mirrors).count_ones() % 2 == 1 {
            -1.0
        } else {
            1.0
        }
    }
}

/// The frame of the canonical response in the frame of the canonical path, whose last heading enters the receiver.
pub fn response_frame(word: &Word) -> CubeSymmetry {
    CubeSymmetry::exchange(2, word.last_heading().axis())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_counted_as_restricted_growth_strings() {
        let count = |depth, vertical| Word::all(depth, 0, &[], vertical).len();
        assert_eq!(count(5, false), 1 + 2 + 4 + 8 + 16);
        // 1, 2, 5, 14, 41: (3^d + 1) / 2.
        assert_eq!(count(5, true), 1 + 2 + 5 + 14 + 41);
        // One hole at each of the crossings.
        assert_eq!(Word::all(0, 2, &[Hole::Doorway], false).len(), 1 + 2 * 2);
    }

    #[test]
    fn names_lead_back_to_words() {
        for word in Word::all(4, 3, &Hole::ALL, true) {
            assert_eq!(Word::from_name(&word.name()), Some(word));
        }
        for name in ["", "x", "zy", "d", "zdd", "zq", "zzzzzzzzzzzzz"] {
            assert_eq!(Word::from_name(name), None, "{name}");
        }
    }

    #[test]
    fn frames_of_headings_are_rotations_and_keep_up() {
        for heading in Face::ALL {
            let frame = frame_of_heading(heading);
            assert!(frame.is_rotation());
            assert_eq!(frame.face(Face::PosZ), heading);
            if heading.axis() != 1 {
                assert_eq!(frame.face(Face::PosY), Face::PosY);
            }
        }
    }

    #[test]
    fn a_roll_rebuilds_its_frame() {
        for frame in CubeSymmetry::all() {
            let roll = Roll::of(frame);
            let mut g = CubeSymmetry::IDENTITY;
            for axis in 0..2 {
                if roll.mirrors >> axis & 1 == 1 {
                    g = CubeSymmetry::mirror(axis).after(g);
                }
            }
            if roll.exchanged {
                g = CubeSymmetry::exchange(0, 1).after(g);
            }
            let reference = frame_of_heading(frame.face(Face::PosZ));
            assert_eq!(reference.after(g), frame);
        }
    }
}
