//! The canonical shapes (Loos et al. 2011, section 6.1): cubes with faces missing.
//!
//! A shape is data. Adding one means adding a line to [`SHAPES`]; everything else, tests included,
//! sweeps over that list.

use glam::DVec3;
use mrt_core::cube::Face;

/// A unit cube some of whose faces are openings.
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// Used in level files and on the command line.
    pub name: &'static str,
    /// Missing faces, in the order of [`Face::ALL`].
    pub openings: &'static [Face],
}

/// Every shape: the two-dimensional dictionary, all cubes with 0 to 4 side faces missing up to
/// rotation, with twelve openings between them.
pub static SHAPES: [Shape; 6] = [
    Shape {
        name: "closed",
        openings: &[],
    },
    Shape {
        name: "dead_end",
        openings: &[Face::PosX],
    },
    Shape {
        name: "straight",
        openings: &[Face::NegX, Face::PosX],
    },
    Shape {
        name: "corner",
        openings: &[Face::PosX, Face::PosZ],
    },
    Shape {
        name: "tee",
        openings: &[Face::NegX, Face::PosX, Face::PosZ],
    },
    Shape {
        name: "cross",
        openings: &[Face::NegX, Face::PosX, Face::NegZ, Face::PosZ],
    },
];

impl Shape {
    /// The shape of that name.
    pub fn from_name(name: &str) -> Option<&'static Shape> {
        SHAPES.iter().find(|shape| shape.name == name)
    }

    /// True when the face is missing.
    pub fn is_open(&self, face: Face) -> bool {
        self.openings.contains(&face)
    }

    /// Faces that are there, in the order of [`Face::ALL`]; they carry the texels.
    pub fn walls(&self) -> impl Iterator<Item = Face> + '_ {
        Face::ALL.into_iter().filter(|&face| !self.is_open(face))
    }

    /// Number of texels at `resolution`² a wall.
    pub fn texel_count(&self, resolution: usize) -> usize {
        (6 - self.openings.len()) * resolution * resolution
    }

    /// Index of a wall's first texel, or `None` for an opening.
    pub fn wall_offset(&self, face: Face, resolution: usize) -> Option<usize> {
        let position = self.walls().position(|wall| wall == face)?;
        Some(position * resolution * resolution)
    }

    /// Texels in storage order: wall by wall, row (v) by row, column (u) by column, with the centre
    /// in the unit cube.
    pub fn texels(&self, resolution: usize) -> impl Iterator<Item = (Face, DVec3)> + '_ {
        self.walls().flat_map(move |face| {
            (0..resolution).flat_map(move |j| {
                (0..resolution).map(move |i| (face, face.texel_center(resolution, j, i)))
            })
        })
    }

    /// The index in [`SHAPES`].
    pub fn index(&'static self) -> usize {
        SHAPES
            .iter()
            .position(|shape| shape == self)
            .unwrap_or(SHAPES.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_core::cube::CubeRotation;

    #[test]
    fn side_openings_are_covered_once_up_to_rotation() {
        let sides = [Face::NegX, Face::PosX, Face::NegZ, Face::PosZ];
        for mask in 0..16u32 {
            let wanted: Vec<Face> = (0..4)
                .filter(|bit| mask >> bit & 1 == 1)
                .map(|bit| sides[bit])
                .collect();
            let matches = SHAPES
                .iter()
                .filter(|shape| {
                    (0..4).any(|turns| {
                        let rotation = CubeRotation::about_y(turns);
                        shape.openings.len() == wanted.len()
                            && shape
                                .openings
                                .iter()
                                .all(|&face| wanted.contains(&rotation.face(face)))
                    })
                })
                .count();
            assert_eq!(matches, 1, "openings {wanted:?}");
        }
        assert_eq!(SHAPES.iter().map(|s| s.openings.len()).sum::<usize>(), 12);
    }

    #[test]
    fn texels_follow_the_walls() {
        for shape in &SHAPES {
            let texels: Vec<_> = shape.texels(4).collect();
            assert_eq!(texels.len(), shape.texel_count(4));
            for face in Face::ALL {
                match shape.wall_offset(face, 4) {
                    Some(offset) => assert_eq!(texels[offset], (face, face.texel_center(4, 0, 0))),
                    None => assert!(shape.is_open(face)),
                }
            }
        }
    }
}
