//! The canonical shapes (Loos et al. 2011, section 6.1): cubes with faces missing, or with a hole in a face, and
//! round tubes.
//!
//! A shape is data. Adding one means adding a line to [`SHAPES`] and its name to a set of [`SHAPE_SETS`];
//! everything else, tests included, sweeps over those lists. The round walls of tubes are in [`crate::level::wall`].

use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use std::f64::consts::PI;

/// A unit cube with open faces or holes in faces, or a tube inside a unit cube.
#[derive(Debug, PartialEq)]
pub struct Shape {
    /// Name in level and dictionary files.
    pub name: &'static str,
    /// Form of the walls.
    pub form: WallForm,
    /// Where light passes: at most one opening in each face, in the order of [`Face::ALL`].
    pub openings: &'static [Aperture],
}

/// Form of the walls of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WallForm {
    /// Faces of the cube.
    Cube,
    /// A round wall in four charts. Each chart is named by a face that the tube does not open through.
    Tube(TubeForm),
}

/// An opening of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// The face with the opening.
    pub face: Face,
    /// Outline of the opening in the face.
    pub outline: Outline,
}

/// The part of a face that an opening takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// The whole face, which is missing.
    Whole,
    /// A hole in a wall.
    Hole(Hole),
    /// The round end of a tube, of radius [`TUBE_RADIUS`] about the middle of the face. The rest of the face is neither
    /// wall nor opening.
    Disc,
}

/// Number of corners of the polygon that stands for a disc. The polygon contains the disc, so that light which grazes
/// the wall on both sides of an opening passes; at its corners it is 0.002 block widths too wide.
const DISC_CORNERS: usize = 32;

/// A rectangle in a wall, in the face's (u, v). It is symmetric in u, so that the two faces that meet there have the
/// same rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hole {
    /// 0.4 wide, from the floor to 0.7 above it.
    Doorway,
    /// 0.5 wide, from 0.4 to 0.8 above the floor.
    Window,
}

impl Hole {
    /// All holes.
    pub const ALL: [Hole; 2] = [Hole::Doorway, Hole::Window];

    /// The ranges of u and v on a side face.
    pub fn rectangle(self) -> [[f64; 2]; 2] {
        match self {
            Hole::Doorway => [[0.3, 0.7], [0.0, 0.7]],
            Hole::Window => [[0.25, 0.75], [0.4, 0.8]],
        }
    }

    /// Position in [`Hole::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }
}

impl std::fmt::Display for Outline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Outline::Whole => "no wall",
            Outline::Disc => "a tube's end",
            Outline::Hole(Hole::Doorway) => "a doorway",
            Outline::Hole(Hole::Window) => "a window",
        })
    }
}

impl Aperture {
    /// Corners in the unit cube, in a loop: four, or 32 around a disc.
    pub fn corners(&self) -> Vec<DVec3> {
        match self.outline {
            Outline::Whole => self.face.rectangle([0.0, 1.0], [0.0, 1.0]).to_vec(),
            Outline::Hole(hole) => {
                let [u, v] = hole.rectangle();
                self.face.rectangle(u, v).to_vec()
            }
            Outline::Disc => {
                let step = 2.0 * PI / DISC_CORNERS as f64;
                let radius = TUBE_RADIUS / (0.5 * step).cos();
                // Half a step off the axes, so that the loop keeps every symmetry of the square.
                let angle = |k: usize| (k as f64 + 0.5) * step;
                (0..DISC_CORNERS)
                    .map(|k| {
                        let (sine, cosine) = angle(k).sin_cos();
                        self.face.point(0.5 + radius * cosine, 0.5 + radius * sine)
                    })
                    .collect()
            }
        }
    }
}

const fn whole(face: Face) -> Aperture {
    Aperture {
        face,
        outline: Outline::Whole,
    }
}

const fn hole(face: Face, hole: Hole) -> Aperture {
    Aperture {
        face,
        outline: Outline::Hole(hole),
    }
}

const NEG_X: Aperture = whole(Face::NegX);
const POS_X: Aperture = whole(Face::PosX);
const NEG_Y: Aperture = whole(Face::NegY);
const POS_Y: Aperture = whole(Face::PosY);
const NEG_Z: Aperture = whole(Face::NegZ);
const POS_Z: Aperture = whole(Face::PosZ);
const DOORWAY: Aperture = hole(Face::PosX, Hole::Doorway);
const WINDOW: Aperture = hole(Face::PosX, Hole::Window);

const fn disc(face: Face) -> Aperture {
    Aperture {
        face,
        outline: Outline::Disc,
    }
}

const fn shape(name: &'static str, openings: &'static [Aperture]) -> Shape {
    Shape {
        name,
        form: WallForm::Cube,
        openings,
    }
}

const fn tube(name: &'static str, form: TubeForm, openings: &'static [Aperture]) -> Shape {
    Shape {
        name,
        form: WallForm::Tube(form),
        openings,
    }
}

/// Every shape: all cubes with 0 to 6 faces missing up to rotation (the first six have missing faces at the sides
/// only), rooms with a door or a window, and tubes. Bends to the left, to the right, up and down are orientations of
/// the one `bend`.
pub static SHAPES: [Shape; 16] = [
    shape("closed", &[]),
    shape("dead_end", &[POS_X]),
    shape("straight", &[NEG_X, POS_X]),
    shape("corner", &[POS_X, POS_Z]),
    shape("tee", &[NEG_X, POS_X, POS_Z]),
    shape("cross", &[NEG_X, POS_X, NEG_Z, POS_Z]),
    shape("corner_up", &[POS_X, POS_Y, POS_Z]),
    shape("tee_up", &[NEG_X, POS_X, POS_Y, POS_Z]),
    shape("floor", &[NEG_X, POS_X, POS_Y, NEG_Z, POS_Z]),
    shape("open", &[NEG_X, POS_X, NEG_Y, POS_Y, NEG_Z, POS_Z]),
    shape("door", &[DOORWAY]),
    shape("window", &[WINDOW]),
    shape("doorway", &[NEG_X, DOORWAY]),
    shape("window_end", &[NEG_X, WINDOW]),
    tube(
        "tube",
        TubeForm::Straight,
        &[disc(Face::NegX), disc(Face::PosX)],
    ),
    tube(
        "bend",
        TubeForm::Bend,
        &[disc(Face::PosX), disc(Face::PosZ)],
    ),
];

/// Shapes that are baked together, by name.
pub static SHAPE_SETS: [(&str, &[&str]); 4] = [
    (
        "cubes-2d",
        &["closed", "dead_end", "straight", "corner", "tee", "cross"],
    ),
    (
        "cubes-3d",
        &[
            "closed",
            "dead_end",
            "straight",
            "corner",
            "tee",
            "cross",
            "corner_up",
            "tee_up",
            "floor",
            "open",
        ],
    ),
    (
        "rooms",
        &[
            "closed",
            "dead_end",
            "straight",
            "corner",
            "tee",
            "cross",
            "door",
            "window",
            "doorway",
            "window_end",
        ],
    ),
    ("cylinders", &["tube", "bend"]),
];

/// The shapes of the set of that name; `None` if [`SHAPE_SETS`] has no such set.
pub fn shape_set(name: &str) -> Option<Vec<&'static Shape>> {
    let (_, names) = SHAPE_SETS.iter().find(|(set, _)| *set == name)?;
    names.iter().map(|name| Shape::from_name(name)).collect()
}

/// The shapes that are cubes.
pub fn cubes() -> impl Iterator<Item = &'static Shape> {
    SHAPES.iter().filter(|shape| shape.form == WallForm::Cube)
}

impl Shape {
    /// The shape of that name; `None` if there is none.
    pub fn from_name(name: &str) -> Option<&'static Shape> {
        SHAPES.iter().find(|shape| shape.name == name)
    }

    /// The form of a tube; `None` for cubes.
    pub fn tube(&self) -> Option<TubeForm> {
        match self.form {
            WallForm::Cube => None,
            WallForm::Tube(form) => Some(form),
        }
    }

    /// True when a face has no wall: it is missing, or a tube ends there.
    pub fn is_open(&self, face: Face) -> bool {
        self.opening(face)
            .is_some_and(|opening| !matches!(opening.outline, Outline::Hole(_)))
    }

    /// The opening in a face; `None` for a closed wall.
    pub fn opening(&self, face: Face) -> Option<&Aperture> {
        self.openings.iter().find(|opening| opening.face == face)
    }

    /// Faces with a wall, whole or with a hole, in the order of [`Face::ALL`]; they carry the texels.
    pub fn walls(&self) -> impl Iterator<Item = Face> + '_ {
        Face::ALL.into_iter().filter(|&face| !self.is_open(face))
    }

    /// Number of walls.
    pub fn wall_count(&self) -> usize {
        self.walls().count()
    }

    /// Number of texels at `resolution`² a wall. Texels in a hole count; they stay dark.
    pub fn texel_count(&self, resolution: usize) -> usize {
        self.wall_count() * resolution * resolution
    }

    /// Index of the first texel of a wall; `None` for a face without wall.
    pub fn wall_offset(&self, face: Face, resolution: usize) -> Option<usize> {
        let position = self.walls().position(|wall| wall == face)?;
        Some(position * resolution * resolution)
    }

    /// The wall of each texel and the texel's centre in the unit cube, in storage order: wall by wall, row (v) by row,
    /// column (u) by column.
    pub fn texels(&self, resolution: usize) -> impl Iterator<Item = (Face, DVec3)> + '_ {
        let tube = self.tube();
        self.walls().flat_map(move |face| {
            (0..resolution).flat_map(move |j| {
                (0..resolution).map(move |i| {
                    let center = match tube {
                        None => face.texel_center(resolution, j, i),
                        Some(form) => form.texel_center(face, resolution, j, i).position,
                    };
                    (face, center)
                })
            })
        })
    }

    /// True when the centre of a texel of wall `face` is in a hole of the wall.
    pub fn is_in_hole(&self, face: Face, center: DVec3) -> bool {
        let Some(Outline::Hole(hole)) = self.opening(face).map(|opening| opening.outline) else {
            return false;
        };
        let [u, v] = hole.rectangle();
        let within = |range: [f64; 2], x: f64| range[0] < x && x < range[1];
        within(u, center[face.u_axis()]) && within(v, center[face.v_axis()])
    }

    /// Position in [`SHAPES`].
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
    use mrt_core::geometry::cube::CubeRotation;

    /// How many shapes of a set have exactly the wanted faces missing in some rotation.
    fn matches(
        set: &str,
        wanted: &[Face],
        rotations: impl Iterator<Item = CubeRotation> + Clone,
    ) -> usize {
        shape_set(set)
            .expect("a set")
            .iter()
            .filter(|shape| {
                rotations.clone().any(|rotation| {
                    shape.openings.len() == wanted.len()
                        && shape
                            .openings
                            .iter()
                            .all(|opening| wanted.contains(&rotation.face(opening.face)))
                })
            })
            .count()
    }

    fn subset(faces: &[Face], mask: u32) -> Vec<Face> {
        (0..faces.len())
            .filter(|bit| mask >> bit & 1 == 1)
            .map(|bit| faces[bit])
            .collect()
    }

    #[test]
    fn side_openings_are_covered_once_up_to_turns_about_y() {
        let sides = [Face::NegX, Face::PosX, Face::NegZ, Face::PosZ];
        for mask in 0..16u32 {
            let wanted = subset(&sides, mask);
            let turns = (0..4).map(CubeRotation::about_y);
            assert_eq!(matches("cubes-2d", &wanted, turns), 1, "{wanted:?}");
        }
        let openings = |set: &str| -> usize {
            let shapes = shape_set(set).expect("a set");
            shapes.iter().map(|s| s.openings.len()).sum()
        };
        assert_eq!(openings("cubes-2d"), 12);
        assert_eq!(openings("cubes-3d"), 30);
    }

    #[test]
    fn all_openings_are_covered_once_up_to_rotation() {
        for mask in 0..64u32 {
            let wanted = subset(&Face::ALL, mask);
            let rotations: Vec<_> = CubeRotation::all().collect();
            let rotations = rotations.iter().copied();
            assert_eq!(matches("cubes-3d", &wanted, rotations), 1, "{wanted:?}");
        }
    }

    #[test]
    fn every_shape_is_in_a_set_and_has_its_own_name() {
        for (index, shape) in SHAPES.iter().enumerate() {
            assert_eq!(shape.index(), index, "{}", shape.name);
            assert!(SHAPE_SETS.iter().any(|(_, set)| set.contains(&shape.name)));
            assert!(shape.openings.is_sorted_by_key(|opening| opening.face));
        }
        for (name, _) in SHAPE_SETS {
            assert!(shape_set(name).is_some(), "{name}");
        }
    }

    #[test]
    fn texels_follow_the_walls() {
        for shape in &SHAPES {
            let texels: Vec<_> = shape.texels(4).collect();
            assert_eq!(texels.len(), shape.texel_count(4));
            for face in Face::ALL {
                let first = match shape.tube() {
                    None => face.texel_center(4, 0, 0),
                    Some(form) => form.texel_center(face, 4, 0, 0).position,
                };
                match shape.wall_offset(face, 4) {
                    Some(offset) => assert_eq!(texels[offset], (face, first)),
                    None => assert!(shape.is_open(face)),
                }
            }
        }
    }

    #[test]
    fn tubes_open_where_their_forms_do() {
        for shape in SHAPES.iter() {
            let Some(form) = shape.tube() else { continue };
            let openings: Vec<Face> = shape.openings.iter().map(|o| o.face).collect();
            assert_eq!(openings, form.openings());
            assert_eq!(shape.walls().collect::<Vec<_>>(), form.charts());
        }
    }

    #[test]
    fn the_polygon_of_a_disc_is_drawn_around_it() {
        let corners = disc(Face::PosX).corners();
        let middle = Face::PosX.point(0.5, 0.5);
        for (k, &corner) in corners.iter().enumerate() {
            let next = corners[(k + 1) % corners.len()];
            let edge = 0.5 * (corner + next);
            // A few roundings.
            assert!((edge.distance(middle) - TUBE_RADIUS).abs() < 1e-15);
            assert!(corner.distance(middle) < TUBE_RADIUS + 0.002);
        }
    }

    #[test]
    fn both_sides_of_a_hole_see_the_same_rectangle() {
        for hole in Hole::ALL {
            let [u, v] = hole.rectangle();
            // Two decimals that add up to one.
            assert!((u[0] + u[1] - 1.0).abs() < 1e-15);
            assert!(0.0 <= v[0] && v[1] <= 1.0);
        }
    }
}
