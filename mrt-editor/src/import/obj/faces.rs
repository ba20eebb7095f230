//! The faces of an OBJ: corners, their indices, and the triangles that they are cut into.

use super::lines::{before_comment, readable, words};
use super::polygons::{Cut, Cutter};
use crate::import::limits::{MAX_OBJ_ELEMENTS, MAX_POLYGON_CORNERS};
use glam::DVec3;

/// In place of an index of texture coordinates where a corner has none.
pub(super) const NO_TEXTURE: u32 = u32::MAX;

/// In place of one that cannot be in any file.
const WRONG_TEXTURE: u32 = u32::MAX - 1;

/// What is wrong in a line.
#[derive(Debug, PartialEq)]
pub(super) struct Fault {
    /// The word at fault, readable.
    pub(super) found: String,
    /// What should be there.
    pub(super) expected: String,
}

impl Fault {
    pub(super) fn new(found: &[u8], expected: impl Into<String>) -> Self {
        Self {
            found: readable(found),
            expected: expected.into(),
        }
    }
}

/// Where a face stands, and of what it is.
#[derive(Clone, Copy)]
pub(super) struct FacePlace {
    /// Number of its line.
    pub(super) line: usize,
    pub(super) material: u32,
}

/// How many vertices and texture coordinates stand above a face.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    pub(super) positions: usize,
    pub(super) textures: usize,
}

#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    texture: u32,
}

/// A face that names vertices below it, and waits for them.
struct LateFace {
    place: FacePlace,
    corner_count: usize,
}

/// The triangles of all faces so far.
#[derive(Default)]
pub(super) struct Faces {
    pub(super) triangles: Vec<[u32; 3]>,
    /// The material of each triangle.
    pub(super) materials: Vec<u32>,
    /// Indices of texture coordinates of each triangle's corners, unchecked; empty if no face has any.
    pub(super) textures: Vec<[u32; 3]>,
    /// Faces of one or two corners.
    pub(super) short_count: usize,
    /// Faces whose outline crosses itself.
    pub(super) crossing_count: usize,
    late: Vec<LateFace>,
    /// Corners of the late faces, one face after the other.
    late_corners: Vec<Corner>,
    /// Of the face at hand.
    corners: Vec<Corner>,
    points: Vec<DVec3>,
    cutter: Cutter,
}

impl Faces {
    /// Adds a face, whose `text` is what follows `f`; vertices and texture coordinates are those above it.
    pub(super) fn add(
        &mut self,
        place: FacePlace,
        text: &[u8],
        positions: &[DVec3],
        texture_count: usize,
    ) -> Result<(), Fault> {
        let counts = Counts {
            positions: positions.len(),
            textures: texture_count,
        };
        self.corners.clear();
        for word in words(before_comment(text)) {
            if self.corners.len() == MAX_POLYGON_CORNERS {
                let expected = format!("a face of at most {MAX_POLYGON_CORNERS} corners");
                return Err(Fault::new(word, expected));
            }
            self.corners.push(corner(word, counts)?);
        }
        if self.corners.len() < 3 {
            self.short_count += 1;
            return Ok(());
        }
        let highest = self.corners.iter().map(|corner| corner.position).max();
        if highest.is_some_and(|highest| highest as usize >= positions.len()) {
            return self.postpone(place);
        }
        self.cut(place.material, positions)
    }

    fn postpone(&mut self, place: FacePlace) -> Result<(), Fault> {
        self.late.push(LateFace {
            place,
            corner_count: self.corners.len(),
        });
        self.late_corners.append(&mut self.corners);
        check_count(self.late_corners.len(), MAX_OBJ_ELEMENTS, "late corner")
    }

    /// Adds the faces that had to wait for vertices below them; `Err` with the line of one whose vertices never came.
    pub(super) fn finish(&mut self, positions: &[DVec3]) -> Result<(), (usize, Fault)> {
        let mut corners = std::mem::take(&mut self.late_corners).into_iter();
        for face in std::mem::take(&mut self.late) {
            self.corners.clear();
            self.corners
                .extend(corners.by_ref().take(face.corner_count));
            let missing = |corner: &&Corner| corner.position as usize >= positions.len();
            if let Some(corner) = self.corners.iter().find(missing) {
                let number = u64::from(corner.position) + 1;
                let expected = no_such_vertex(positions.len());
                let fault = Fault::new(number.to_string().as_bytes(), expected);
                return Err((face.place.line, fault));
            }
            let cut = self.cut(face.place.material, positions);
            cut.map_err(|fault| (face.place.line, fault))?;
        }
        Ok(())
    }

    /// Cuts the face at hand.
    fn cut(&mut self, material: u32, positions: &[DVec3]) -> Result<(), Fault> {
        self.points.clear();
        let points = self.corners.iter().map(|c| positions[c.position as usize]);
        self.points.extend(points);
        let (cut, outcome) = self.cutter.cut(&self.points);
        self.crossing_count += usize::from(outcome == Cut::Crossing);
        let corners = &self.corners;
        if !self.textures.is_empty() || corners.iter().any(|c| c.texture != NO_TEXTURE) {
            self.textures.resize(self.triangles.len(), [NO_TEXTURE; 3]);
            let textures = cut.iter().map(|t| t.map(|k| corners[k as usize].texture));
            self.textures.extend(textures);
        }
        let triangles = cut.iter().map(|t| t.map(|k| corners[k as usize].position));
        self.triangles.extend(triangles);
        self.materials.resize(self.triangles.len(), material);
        check_count(self.triangles.len(), MAX_OBJ_ELEMENTS, "triangle")
    }
}

/// Refuses more of something than `most`.
pub(super) fn check_count(count: usize, most: usize, what: &str) -> Result<(), Fault> {
    match count > most {
        true => Err(Fault {
            found: format!("{what} number {count}"),
            expected: format!("at most {most}"),
        }),
        false => Ok(()),
    }
}

/// A corner as `v`, `v/vt`, `v//vn` or `v/vt/vn`; the normal is not looked at.
fn corner(word: &[u8], counts: Counts) -> Result<Corner, Fault> {
    let syntax = || Fault::new(word, "a corner such as `1`, `1/2`, `1//3` or `1/2/3`");
    let mut parts = word.splitn(3, |&byte| byte == b'/');
    let position = integer(parts.next().unwrap_or_default()).ok_or_else(syntax)?;
    let texture = match parts.next() {
        None | Some([]) => None,
        Some(part) => Some(integer(part).ok_or_else(syntax)?),
    };
    if parts.next().is_some_and(|normal| normal.contains(&b'/')) {
        return Err(syntax());
    }
    Ok(Corner {
        position: index(position, counts.positions)
            .ok_or_else(|| Fault::new(word, no_such_vertex(counts.positions)))?,
        texture: texture.map_or(NO_TEXTURE, |texture| {
            index(texture, counts.textures).unwrap_or(WRONG_TEXTURE)
        }),
    })
}

fn no_such_vertex(count: usize) -> String {
    format!("the number of one of the {count} vertices, from 1 up or from -1 down")
}

/// From the file's counting, from 1 or back from the last one above, to ours. The result may still lie below the face.
fn index(number: i64, count: usize) -> Option<u32> {
    let index = match number {
        1.. => number - 1,
        0 => return None,
        _ => (count as i64).checked_add(number)?,
    };
    u32::try_from(index)
        .ok()
        .filter(|&index| index < WRONG_TEXTURE)
}

fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];

    fn place(line: usize) -> FacePlace {
        FacePlace { line, material: 0 }
    }

    #[test]
    fn corners_may_name_vertices_in_four_ways_and_backwards() {
        let mut faces = Faces::default();
        let place = FacePlace {
            line: 1,
            material: 7,
        };
        let mut add = |text: &[u8]| faces.add(place, text, &SQUARE, 2).expect("sound");
        add(b"1 2 3 # 4");
        add(b"-4/1 -3/-1/9 3//5");
        add(b"1/ 2// 4/3");
        add(b"1 2");
        assert_eq!(faces.triangles, [[0, 1, 2], [0, 1, 2], [0, 1, 3]]);
        let none = NO_TEXTURE;
        assert_eq!(faces.textures, [[none; 3], [0, 1, none], [none, none, 2]]);
        assert_eq!(faces.materials, [7; 3]);
        assert_eq!(faces.short_count, 1);
    }

    #[test]
    fn a_face_may_stand_above_its_vertices_if_they_come() {
        let mut faces = Faces::default();
        faces.add(place(1), b"1 2 3 4", &[], 0).expect("may come");
        faces
            .add(place(2), b"2 3 5", &SQUARE[..1], 0)
            .expect("may come");
        let (line, fault) = faces.finish(&SQUARE).expect_err("one never came");
        assert_eq!(faces.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!((line, &fault.found[..]), (2, "5"));
        assert!(fault.expected.contains("the 4 vertices"), "{fault:?}");
    }

    #[test]
    fn faulty_corners_are_refused() {
        for (text, found) in [
            ("0 1 2", "0"),
            ("1 2 -5", "-5"),
            ("1 2 x", "x"),
            ("1 2 3/x", "3/x"),
            ("1 2 3/1/1/1", "3/1/1/1"),
            ("1 2 1.5", "1.5"),
            ("1 2 9223372036854775808", "9223372036854775808"),
            ("1 2 -9223372036854775808", "-9223372036854775808"),
            ("1 2 4294967296", "4294967296"),
        ] {
            let fault = Faces::default().add(place(1), text.as_bytes(), &SQUARE, 0);
            assert_eq!(fault.expect_err(text).found, found);
        }
        let many = "1 ".repeat(MAX_POLYGON_CORNERS + 1);
        let fault = Faces::default().add(place(1), many.as_bytes(), &SQUARE, 0);
        assert!(fault.expect_err("too many").expected.contains("16384"));
    }
}
