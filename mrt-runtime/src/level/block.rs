//! What a designer edits: warped blocks and the openings through which they are joined.

use crate::level::shape::{Aperture, Outline, Shape};
use crate::light::placed::MAX_LIGHT_VALUE;
use crate::modular::dictionary::WarpTransport;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::{Hexahedron, HexahedronError};

/// More blocks than this are refused: a level of that size is a mistake or an attack.
pub const MAX_BLOCKS: usize = 100_000;

/// Corners of joined faces must meet within this fraction of the block's diagonal.
pub const JOIN_TOLERANCE: f64 = 1e-3;

/// Coordinates may be at most this many diagonals of a block: texel positions in `f32` are then good to a
/// thousandth of it, a fortieth of a texel at 16².
pub const FAR_LIMIT: f64 = 1e4;

/// Blocks may enter each other by this fraction of their smaller diagonal before they overlap.
pub const OVERLAP_TOLERANCE: f64 = 1e-2;

/// A level: blocks and their connections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Level {
    /// In the order in which results are given.
    pub blocks: Vec<Block>,
    /// Openings that lead into one another. An opening without a connection leads outside: light
    /// leaves through it, and directional lights shine in.
    pub connections: Vec<Connection>,
    /// Connections that can be closed while the game runs, in the order in which a frame counts them.
    pub doors: Vec<Door>,
}

/// A connection that can be closed, at run time, by any amount.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Door {
    /// Index into [`Level::connections`].
    pub connection: usize,
    /// How much light passes at first, in [0, 1].
    pub value: f32,
}

/// One instance of a canonical shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The canonical shape.
    pub shape: &'static Shape,
    /// Turns the canonical shape in the unit cube before it is warped.
    pub orientation: CubeRotation,
    /// The unit cube's corners in the world, metres.
    pub warp: Hexahedron,
    /// Linear RGB albedo in [0, 1] of each face of the turned cube, in the order of [`Face::ALL`];
    /// entries of openings have no meaning.
    pub albedo: [Vec3; 6],
    /// Radiosity that each face emits of itself, linear RGB, W/m², in the order of [`Face::ALL`].
    pub emission: [Vec3; 6],
    /// Whose operators it uses: the canonical shape's, or those that were made for its warp.
    pub transport: WarpTransport,
}

/// One end of a connection: a face of a block's turned cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Opening {
    /// Index into [`Level::blocks`].
    pub block: usize,
    /// The face after orientation.
    pub face: Face,
}

/// Two openings that are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Connection {
    /// One side.
    pub a: Opening,
    /// The other side.
    pub b: Opening,
}

/// What is wrong with a level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevelError {
    /// No block at all.
    #[error("the level has no block; expected at least one")]
    Empty,
    /// Above [`MAX_BLOCKS`].
    #[error("the level has {found} blocks; expected at most {expected}")]
    TooManyBlocks {
        /// [`MAX_BLOCKS`].
        expected: usize,
        /// Blocks in the level.
        found: usize,
    },
    /// The eight corners are not the image of a cube.
    #[error("block {block}: {source}")]
    Warp {
        /// Which block.
        block: usize,
        /// What is wrong with it.
        source: HexahedronError,
    },
    /// An albedo is NaN, negative or above one.
    #[error("block {block}, face {face}: albedo {found}; expected three values in [0, 1]")]
    Albedo {
        /// Which block.
        block: usize,
        /// Which face.
        face: Face,
        /// The albedo there.
        found: Vec3,
    },
    /// An emission is NaN, negative or absurd.
    #[error(
        "block {block}, face {face}: emission {found}; expected three values in [0, {MAX_LIGHT_VALUE:e}]"
    )]
    Emission {
        /// Which block.
        block: usize,
        /// Which face.
        face: Face,
        /// The emission there.
        found: Vec3,
    },
    /// A door is nowhere, or not a fraction.
    #[error(
        "door {door}: connection {connection}, value {found}; expected one of {count} connections, each with \
         one door at most, and a value in [0, 1]"
    )]
    Door {
        /// Which door.
        door: usize,
        /// The connection that it names.
        connection: usize,
        /// Number of connections.
        count: usize,
        /// Its value.
        found: f32,
    },
    /// Two openings meet whose outlines differ.
    #[error(
        "face {face} of block {block} has {found}, and face {other_face} of block {other} {expected}; expected \
         the same on both sides"
    )]
    OutlineMismatch {
        /// One block.
        block: usize,
        /// Its face.
        face: Face,
        /// The other block.
        other: usize,
        /// Its face.
        other_face: Face,
        /// What the other face has.
        expected: String,
        /// What the face has.
        found: String,
    },
    /// A connection names a block that is not there.
    #[error("connection {connection}: block {found}; expected an index below {expected}")]
    NoSuchBlock {
        /// Which connection.
        connection: usize,
        /// Number of blocks.
        expected: usize,
        /// The index given.
        found: usize,
    },
    /// A connection names a face that is a wall.
    #[error(
        "connection {connection}: face {face} of block {block} is a wall of shape `{shape}` in its \
         orientation; expected an opening"
    )]
    NotAnOpening {
        /// Which connection.
        connection: usize,
        /// Which block.
        block: usize,
        /// Which face of it.
        face: Face,
        /// Its shape.
        shape: &'static str,
    },
    /// An opening is connected more than once, or to itself.
    #[error("opening {face} of block {block} is in {found} connections; expected at most one")]
    ConnectedTwice {
        /// Which block.
        block: usize,
        /// Which face of it.
        face: Face,
        /// Connections that name it.
        found: usize,
    },
    /// The corners of two joined faces are in different places.
    #[error(
        "face {face} of block {block} and face {other_face} of block {other}: corners are up to \
         {found:.4} m apart; expected at most {expected:.4} m"
    )]
    InterfaceMismatch {
        /// One block.
        block: usize,
        /// Its face.
        face: Face,
        /// The other block.
        other: usize,
        /// Its face.
        other_face: Face,
        /// Largest distance accepted, metres.
        expected: f64,
        /// Largest distance between corners that should meet, metres.
        found: f64,
    },
    /// Blocks whose bounding boxes overlap one another by the hundred.
    #[error(
        "blocks are packed so that each bounding box meets over {expected} others; expected fewer"
    )]
    TooCrowded {
        /// Pairs a block that are tested.
        expected: usize,
    },
    /// Too far from the origin for positions in single precision.
    #[error(
        "block {block}: a corner is {found:.3e} m from the origin along an axis; expected at most \
         {expected:.3e} m, {FAR_LIMIT:.0e} of the block's diagonals"
    )]
    TooFar {
        /// Which block.
        block: usize,
        /// Largest coordinate accepted, metres.
        expected: f64,
        /// Largest coordinate, metres.
        found: f64,
    },
    /// Two blocks share a volume.
    #[error("blocks {a} and {b} overlap by {found:.4} m; expected at most {expected:.4} m")]
    Overlap {
        /// One block.
        a: usize,
        /// The other.
        b: usize,
        /// Largest depth accepted, metres.
        expected: f64,
        /// Depth along the direction that separates them best, metres.
        found: f64,
    },
}

impl Block {
    /// A block with the same albedo on all faces.
    pub fn new(
        shape: &'static Shape,
        orientation: CubeRotation,
        warp: Hexahedron,
        albedo: Vec3,
    ) -> Self {
        Self {
            shape,
            orientation,
            warp,
            albedo: [albedo; 6],
            emission: [Vec3::ZERO; 6],
            transport: WarpTransport::Canonical,
        }
    }

    /// True when the whole face of the turned cube is missing.
    pub fn is_open(&self, face: Face) -> bool {
        self.shape.is_open(self.orientation.inverse().face(face))
    }

    /// The opening in a face of the turned cube, as the canonical shape has it.
    pub fn opening(&self, face: Face) -> Option<&'static Aperture> {
        self.shape.opening(self.orientation.inverse().face(face))
    }

    /// The warp as a map from the *canonical* cube: orientation and corners in one.
    pub fn canonical_warp(&self) -> Hexahedron {
        Hexahedron {
            corners: std::array::from_fn(|k| {
                let turned = self.orientation.point(Hexahedron::unit_corner(k));
                self.warp.corners[corner_index(turned)]
            }),
        }
    }
}

/// Index of a corner of the unit cube: x is bit 0, y bit 1, z bit 2.
pub(crate) fn corner_index(unit: DVec3) -> usize {
    (0..3)
        .filter(|&axis| unit[axis] > 0.5)
        .map(|axis| 1 << axis)
        .sum()
}

impl Level {
    /// One unit block a cell [x, x+1] x [y, y+1] x [z, z+1]; cells that share a face are joined.
    ///
    /// # Errors
    /// [`CellsError`] when a cell is given twice.
    pub fn from_cells(cells: &[[i32; 3]], albedo: Vec3) -> Result<Level, CellsError> {
        Self::from_joined_cells(cells, albedo, |_, _| true)
    }

    /// As [`Level::from_cells`], with a wall between cells of which `is_joined(first, second)` is false; it must say
    /// the same for both orders.
    ///
    /// # Errors
    /// [`CellsError`].
    pub fn from_joined_cells(
        cells: &[[i32; 3]],
        albedo: Vec3,
        is_joined: impl Fn(usize, usize) -> bool,
    ) -> Result<Level, CellsError> {
        let mut index = std::collections::HashMap::new();
        for (block, &cell) in cells.iter().enumerate() {
            if let Some(first) = index.insert(cell, block) {
                return Err(CellsError::Twice {
                    cell,
                    first,
                    second: block,
                });
            }
        }
        let mut level = Level::default();
        for (block, &cell) in cells.iter().enumerate() {
            let neighbour = |face: Face| {
                let step = face.outward().as_ivec3().to_array();
                let next = std::array::from_fn(|axis| cell[axis].checked_add(step[axis]));
                match next {
                    [Some(x), Some(y), Some(z)] => index
                        .get(&[x, y, z])
                        .copied()
                        .filter(|&next| is_joined(block, next)),
                    _ => None,
                }
            };
            let open: Vec<Face> = Face::ALL
                .into_iter()
                .filter(|&face| neighbour(face).is_some())
                .collect();
            let (shape, orientation) =
                shape_with_openings(&open).ok_or_else(|| CellsError::NoShape {
                    cell,
                    openings: open.iter().map(|face| face.name()).collect(),
                })?;
            let min = DVec3::from_array(cell.map(f64::from));
            let warp = Hexahedron::cell(min);
            level
                .blocks
                .push(Block::new(shape, orientation, warp, albedo));
            for &face in open.iter().filter(|face| face.is_positive()) {
                if let Some(other) = neighbour(face) {
                    level.connections.push(Connection {
                        a: Opening { block, face },
                        b: Opening {
                            block: other,
                            face: face.opposite(),
                        },
                    });
                }
            }
        }
        Ok(level)
    }

    /// The opening that each face of each block is connected to, as `[block][face]`.
    ///
    /// Connections must be in range; [`Level::check`] says so.
    pub fn neighbours(&self) -> Vec<[Option<Opening>; 6]> {
        let mut neighbours = vec![[None; 6]; self.blocks.len()];
        for connection in &self.connections {
            let (a, b) = (connection.a, connection.b);
            neighbours[a.block][a.face.index()] = Some(b);
            neighbours[b.block][b.face.index()] = Some(a);
        }
        neighbours
    }

    /// Checks everything that assembly and the frame rely on.
    ///
    /// # Errors
    /// The first [`LevelError`] found, blocks before connections before overlaps.
    pub fn check(&self) -> Result<(), LevelError> {
        let count = self.blocks.len();
        if count == 0 {
            return Err(LevelError::Empty);
        }
        if count > MAX_BLOCKS {
            return Err(LevelError::TooManyBlocks {
                expected: MAX_BLOCKS,
                found: count,
            });
        }
        for (index, block) in self.blocks.iter().enumerate() {
            block.warp.check().map_err(|source| LevelError::Warp {
                block: index,
                source,
            })?;
            let (min, max) = block.warp.bounds();
            let found = min.abs().max(max.abs()).max_element();
            let expected = FAR_LIMIT * block.warp.diagonal();
            if found > expected {
                return Err(LevelError::TooFar {
                    block: index,
                    expected,
                    found,
                });
            }
            for face in Face::ALL {
                let albedo = block.albedo[face.index()];
                let legal = albedo.to_array().iter().all(|a| (0.0..=1.0).contains(a));
                if !legal {
                    return Err(LevelError::Albedo {
                        block: index,
                        face,
                        found: albedo,
                    });
                }
                let emission = block.emission[face.index()];
                let legal = emission
                    .to_array()
                    .iter()
                    .all(|e| (0.0..=MAX_LIGHT_VALUE).contains(e));
                if !legal {
                    return Err(LevelError::Emission {
                        block: index,
                        face,
                        found: emission,
                    });
                }
            }
        }
        self.check_connections()?;
        crate::level::overlap::check(self)
    }

    fn check_connections(&self) -> Result<(), LevelError> {
        let mut uses = vec![[0usize; 6]; self.blocks.len()];
        for (connection, ends) in self.connections.iter().enumerate() {
            for end in [ends.a, ends.b] {
                let block = self.blocks.get(end.block).ok_or(LevelError::NoSuchBlock {
                    connection,
                    expected: self.blocks.len(),
                    found: end.block,
                })?;
                if block.opening(end.face).is_none() {
                    return Err(LevelError::NotAnOpening {
                        connection,
                        block: end.block,
                        face: end.face,
                        shape: block.shape.name,
                    });
                }
                let uses = &mut uses[end.block][end.face.index()];
                *uses += 1;
                if *uses > 1 {
                    return Err(LevelError::ConnectedTwice {
                        block: end.block,
                        face: end.face,
                        found: *uses,
                    });
                }
            }
            self.check_outlines(ends)?;
            self.check_interface(ends)?;
        }
        let mut has_door = vec![false; self.connections.len()];
        for (index, door) in self.doors.iter().enumerate() {
            let is_first = has_door
                .get_mut(door.connection)
                .is_some_and(|has| !std::mem::replace(has, true));
            if !is_first || !(0.0..=1.0).contains(&door.value) {
                return Err(LevelError::Door {
                    door: index,
                    connection: door.connection,
                    count: self.connections.len(),
                    found: door.value,
                });
            }
        }
        Ok(())
    }

    /// Joined openings have the same outline.
    fn check_outlines(&self, ends: &Connection) -> Result<(), LevelError> {
        let outline = |end: Opening| {
            let opening = self.blocks[end.block].opening(end.face);
            opening.map_or(Outline::Whole, |opening| opening.outline)
        };
        let (ours, theirs) = (outline(ends.a), outline(ends.b));
        if ours == theirs {
            return Ok(());
        }
        Err(LevelError::OutlineMismatch {
            block: ends.a.block,
            face: ends.a.face,
            other: ends.b.block,
            other_face: ends.b.face,
            expected: theirs.to_string(),
            found: ours.to_string(),
        })
    }

    /// The door in each face of each block's turned cube, as an index into [`Level::doors`].
    ///
    /// Doors and connections must be in range; [`Level::check`] says so.
    pub fn door_of_openings(&self) -> Vec<[Option<u32>; 6]> {
        let mut doors = vec![[None; 6]; self.blocks.len()];
        for (index, door) in self.doors.iter().enumerate() {
            let connection = self.connections[door.connection];
            for end in [connection.a, connection.b] {
                doors[end.block][end.face.index()] = Some(index as u32);
            }
        }
        doors
    }

    /// Each corner of one face must be near a corner of the other.
    fn check_interface(&self, ends: &Connection) -> Result<(), LevelError> {
        let warp = |end: Opening| &self.blocks[end.block].warp;
        let corners = |end: Opening| warp(end).face_corners(end.face);
        let (ours, theirs) = (corners(ends.a), corners(ends.b));
        let gap = |from: &[DVec3; 4], to: &[DVec3; 4]| {
            from.iter()
                .map(|&p| to.iter().map(|&q| p.distance(q)).fold(f64::MAX, f64::min))
                .fold(0.0, f64::max)
        };
        let found = gap(&ours, &theirs).max(gap(&theirs, &ours));
        let size = warp(ends.a).diagonal().min(warp(ends.b).diagonal());
        let expected = JOIN_TOLERANCE * size;
        if found > expected {
            return Err(LevelError::InterfaceMismatch {
                block: ends.a.block,
                face: ends.a.face,
                other: ends.b.block,
                other_face: ends.b.face,
                expected,
                found,
            });
        }
        Ok(())
    }
}

/// Why cells are not a level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CellsError {
    /// The same cell twice.
    #[error("cell {cell:?} stands at positions {first} and {second}; expected once")]
    Twice {
        /// The cell.
        cell: [i32; 3],
        /// First position.
        first: usize,
        /// Second position.
        second: usize,
    },
    /// No shape has these openings.
    #[error("cell {cell:?} opens towards {openings:?}; expected the openings of a shape")]
    NoShape {
        /// The cell.
        cell: [i32; 3],
        /// Faces shared with other cells.
        openings: Vec<&'static str>,
    },
}

/// The shape and the rotation that leave exactly these faces open, about +Y where that is enough.
pub fn shape_with_openings(open: &[Face]) -> Option<(&'static Shape, CubeRotation)> {
    let upright = (0..4).map(CubeRotation::about_y);
    upright.chain(CubeRotation::all()).find_map(|rotation| {
        crate::level::shape::SHAPES.iter().find_map(|shape| {
            let fits = shape.openings.len() == open.len()
                && shape.openings.iter().all(|opening| {
                    opening.outline == Outline::Whole && open.contains(&rotation.face(opening.face))
                });
            fits.then_some((shape, rotation))
        })
    })
}
