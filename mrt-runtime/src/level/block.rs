//! What a designer edits: warped blocks and the openings through which they are joined.

use crate::level::mesh_reading::MeshReading;
use crate::level::shape::{Aperture, Shape};
use crate::level::warp_transport::WarpTransport;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;

/// Most blocks of a level: a larger one is a mistake or an attack.
pub const MAX_BLOCKS: usize = 100_000;

/// A level: blocks and their connections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Level {
    /// Blocks; results come in this order.
    pub blocks: Vec<Block>,
    /// Pairs of openings that lead into one another. An opening without a connection leads outside: light leaves
    /// through it, and directional lights shine in.
    pub connections: Vec<Connection>,
    /// Connections that can be closed while the game runs; frames name a door by its position in this list.
    pub doors: Vec<Door>,
    /// How the mesh that the level was made for is read; `None` if nothing is known of a mesh.
    pub mesh: Option<MeshReading>,
}

/// A connection that can be closed at run time, partly or wholly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Door {
    /// Index into [`Level::connections`].
    pub connection: usize,
    /// Fraction of light, in [0, 1], that passes at first.
    pub value: f32,
}

/// One instance of a canonical shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The canonical shape.
    pub shape: &'static Shape,
    /// Turns the canonical shape in the unit cube before it is warped.
    pub orientation: CubeRotation,
    /// Corners of the unit cube in the world, metres.
    pub warp: Hexahedron,
    /// Linear RGB albedo in [0, 1] of each face of the turned cube, in the order of [`Face::ALL`];
    /// entries of openings have no meaning.
    pub albedo: [Vec3; 6],
    /// Radiosity that each face emits, linear RGB, W/m², in the order of [`Face::ALL`].
    pub emission: [Vec3; 6],
    /// Which operators light the block: those of the canonical shape, or those made for its warp.
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

/// Two openings that lead into one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Connection {
    /// One side.
    pub a: Opening,
    /// The other side.
    pub b: Opening,
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

    /// The opening in a face of the turned cube, named by its canonical face.
    pub fn opening(&self, face: Face) -> Option<&'static Aperture> {
        self.shape.opening(self.orientation.inverse().face(face))
    }

    /// The map from the *canonical* cube to the world: the orientation, then the warp.
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
    /// The opening that each face of each block is connected to, as `[block][face]`.
    ///
    /// # Panics
    /// If a connection names a block that does not exist; [`Level::check`] refuses such levels.
    pub fn neighbours(&self) -> Vec<[Option<Opening>; 6]> {
        let mut neighbours = vec![[None; 6]; self.blocks.len()];
        for connection in &self.connections {
            let (a, b) = (connection.a, connection.b);
            neighbours[a.block][a.face.index()] = Some(b);
            neighbours[b.block][b.face.index()] = Some(a);
        }
        neighbours
    }

    /// The door in each face of each block's turned cube, as an index into [`Level::doors`].
    ///
    /// # Panics
    /// If a door or a connection is out of range; [`Level::check`] refuses such levels.
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
}
