//! Levels as readable text (TOML), for people, scripts and version control.
//!
//! ```toml
//! format = "mrt-level"
//! version = 1
//! connections = [[0, "+x", 1, "-x"]]
//! doors = [[0, 1.0]]           # connection 0 can be closed; at first all its light passes
//!
//! [mesh]                       # how the mesh that the level was made for is read; may be missing
//! scale = 0.05                 # metres per unit of its file
//! up = "z"                     # or "y"
//! origin = [2000.0, 0.0, 0.0]  # metres from the mesh's origin to the level's, if they differ
//! skip_materials = ["fog*"]    # left out; only_materials names those that are read
//! keep_tool_materials = true   # helper faces of level editors are read too
//!
//! [[block]]
//! shape = "dead_end"
//! cell = [0, 0, 0]             # or box = [[0, 0, 0], [2, 1, 1]], or corners = [eight points]
//! albedo = [0.7, 0.7, 0.7]
//!
//! [[block]]
//! shape = "dead_end"
//! orientation = "-x+y"         # where the canonical +x and +y point
//! cell = [1, 0, 0]
//! albedo = [0.7, 0.7, 0.7]
//! face_albedo = { "-y" = [0.4, 0.2, 0.1] }
//! face_emission = { "+y" = [3.0, 3.0, 2.5] }   # W/m², a panel that is lit
//! transport = "regathered"     # or "rebuilt": operators made for this warp
//! ```

mod pieces;
mod whole;
mod read;

pub use pieces::MAX_PIECE_BYTES;

use crate::level::block::{Block, Level, MAX_BLOCKS};
use crate::level::error::LevelError;
use crate::level::mesh_reading::{MeshReading, UpAxis};
use crate::level::shape::{SHAPES, Shape};
use crate::level::warp_transport::WarpTransport;
use glam::{DVec3, Vec3};
use mrt_core::excerpt::excerpt;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The version that [`Level::to_text`] writes.
pub const LEVEL_VERSION: u32 = 1;

const FORMAT: &str = "mrt-level";

/// Most bytes of text that [`Level::from_text`] accepts: a block takes under 1,000.
pub const MAX_TEXT_BYTES: usize = MAX_BLOCKS * 1_000;

/// Why text is not a level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevelTextError {
    /// The text is longer than [`MAX_TEXT_BYTES`].
    #[error("the level text has {found} bytes; expected at most {expected}")]
    TooLong {
        /// Most bytes accepted.
        expected: usize,
        /// Bytes of the text.
        found: usize,
    },
    /// A part of the text is longer than [`MAX_PIECE_BYTES`].
    #[error("the level text has {found} bytes in {place}; expected at most {expected}")]
    PartTooLong {
        /// Which part: a block, an element of a list, or what stands before the first block.
        place: String,
        /// Most bytes accepted.
        expected: usize,
        /// Bytes of the part.
        found: usize,
    },
    /// The text is not TOML, or a key is missing, unknown or of the wrong type.
    #[error("the level text is malformed: {0}")]
    Malformed(String),
    /// The text describes something other than a level.
    #[error("the level text has format `{found}`; expected `{FORMAT}`")]
    NotALevel {
        /// Value of the key `format`.
        found: String,
    },
    /// The text has a version that this release does not read.
    #[error("the level text has version {found}; this release reads version {LEVEL_VERSION}")]
    UnsupportedVersion {
        /// Value of the key `version`.
        found: u32,
    },
    /// A block names a shape that does not exist.
    #[error("block {block}: shape `{found}`; expected one of {expected}")]
    UnknownShape {
        /// Which block.
        block: usize,
        /// Names of all shapes.
        expected: String,
        /// The name given.
        found: String,
    },
    /// A block has an orientation that is not one of the 24 rotations.
    #[error(
        "block {block}: orientation `{found}`; expected two perpendicular directions such as `+x+y`"
    )]
    UnknownOrientation {
        /// Which block.
        block: usize,
        /// The text given.
        found: String,
    },
    /// A block has none or several of `cell`, `box` and `corners`.
    #[error("block {block}: {found} of `cell`, `box` and `corners` given; expected exactly one")]
    Placement {
        /// Which block.
        block: usize,
        /// How many were given.
        found: usize,
    },
    /// A block names a transport that does not exist.
    #[error(
        "block {block}: transport `{found}`; expected one of {}",
        WarpTransport::ALL.map(WarpTransport::name).join(", ")
    )]
    UnknownTransport {
        /// Which block.
        block: usize,
        /// The text given.
        found: String,
    },
    /// The mesh has an upward axis that is neither y nor z.
    #[error("mesh: up `{found}`; expected y or z")]
    UnknownAxis {
        /// The text given.
        found: String,
    },
    /// A name is not that of a face.
    #[error("{place}: face `{found}`; expected -x, +x, -y, +y, -z or +z")]
    UnknownFace {
        /// Which block or connection.
        place: String,
        /// The text given.
        found: String,
    },
    /// The text is readable, but the level in it is refused.
    #[error(transparent)]
    Level(#[from] LevelError),
}

#[derive(Serialize)]
struct LevelText {
    format: &'static str,
    version: u32,
    connections: Vec<(usize, &'static str, usize, &'static str)>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doors: Vec<(usize, f32)>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<MeshText>,
    #[serde(rename = "block")]
    blocks: Vec<BlockText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshText {
    scale: f64,
    up: String,
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "whole::some_numbers"
    )]
    origin: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    skip_materials: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    only_materials: Vec<String>,
    #[serde(default, skip_serializing_if = "is_false")]
    keep_tool_materials: bool,
}

/// Tells serde when to leave out a flag.
fn is_false(flag: &bool) -> bool {
    !flag
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BlockText {
    shape: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    orientation: Option<String>,
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "whole::some_numbers"
    )]
    cell: Option<[f64; 3]>,
    #[serde(
        default,
        rename = "box",
        skip_serializing_if = "Option::is_none",
        deserialize_with = "whole::some_points"
    )]
    cuboid: Option<[[f64; 3]; 2]>,
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "whole::some_points"
    )]
    corners: Option<[[f64; 3]; 8]>,
    #[serde(deserialize_with = "whole::numbers")]
    albedo: [f32; 3],
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        deserialize_with = "whole::colours"
    )]
    face_albedo: BTreeMap<String, [f32; 3]>,
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        deserialize_with = "whole::colours"
    )]
    face_emission: BTreeMap<String, [f32; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    transport: Option<String>,
}

impl Level {
    /// Reads a level from TOML and checks it.
    ///
    /// # Errors
    /// [`LevelTextError`]; with the line of the text where the parser knows it.
    ///
    /// Memory beyond that of the level stays below a few megabytes, however long the text is.
    pub fn from_text(text: &str) -> Result<Level, LevelTextError> {
        if text.len() > MAX_TEXT_BYTES {
            return Err(LevelTextError::TooLong {
                expected: MAX_TEXT_BYTES,
                found: text.len(),
            });
        }
        let level = read::read(text)?;
        level.check()?;
        Ok(level)
    }

    /// Writes a level as TOML; [`Level::from_text`] returns the same level, to the last bit.
    ///
    /// # Errors
    /// [`LevelTextError::Malformed`], if TOML cannot represent a value.
    pub fn to_text(&self) -> Result<String, LevelTextError> {
        let text = LevelText {
            format: FORMAT,
            version: LEVEL_VERSION,
            connections: self
                .connections
                .iter()
                .map(|c| {
                    let (a, b) = (c.a, c.b);
                    (a.block, a.face.name(), b.block, b.face.name())
                })
                .collect(),
            doors: self
                .doors
                .iter()
                .map(|door| (door.connection, door.value))
                .collect(),
            mesh: self.mesh.as_ref().map(write_mesh),
            blocks: self.blocks.iter().map(write_block).collect(),
        };
        toml::to_string(&text).map_err(|error| LevelTextError::Malformed(error.to_string()))
    }
}

fn read_mesh(text: MeshText) -> Result<MeshReading, LevelTextError> {
    let up = UpAxis::from_name(&text.up);
    Ok(MeshReading {
        scale: text.scale,
        up: up.ok_or(LevelTextError::UnknownAxis { found: text.up })?,
        origin: text.origin.map_or(DVec3::ZERO, DVec3::from_array),
        skip_materials: text.skip_materials,
        only_materials: text.only_materials,
        keeps_tool_materials: text.keep_tool_materials,
    })
}

fn write_mesh(mesh: &MeshReading) -> MeshText {
    MeshText {
        scale: mesh.scale,
        up: mesh.up.name().to_owned(),
        origin: (mesh.origin != DVec3::ZERO).then(|| mesh.origin.to_array()),
        skip_materials: mesh.skip_materials.clone(),
        only_materials: mesh.only_materials.clone(),
        keep_tool_materials: mesh.keeps_tool_materials,
    }
}

fn read_block(index: usize, text: &BlockText) -> Result<Block, LevelTextError> {
    let shape = Shape::from_name(&text.shape).ok_or_else(|| LevelTextError::UnknownShape {
        block: index,
        expected: SHAPES.each_ref().map(|shape| shape.name).join(", "),
        found: excerpt(&text.shape),
    })?;
    let orientation = match &text.orientation {
        None => CubeRotation::IDENTITY,
        Some(name) => {
            CubeRotation::from_name(name).ok_or_else(|| LevelTextError::UnknownOrientation {
                block: index,
                found: excerpt(name),
            })?
        }
    };
    let warp = match (text.cell, text.cuboid, text.corners) {
        (Some(min), None, None) => Hexahedron::cell(DVec3::from_array(min)),
        (None, Some([min, max]), None) => {
            Hexahedron::cuboid(DVec3::from_array(min), DVec3::from_array(max))
        }
        (None, None, Some(corners)) => Hexahedron {
            corners: corners.map(DVec3::from_array),
        },
        (cell, cuboid, corners) => {
            return Err(LevelTextError::Placement {
                block: index,
                found: usize::from(cell.is_some())
                    + usize::from(cuboid.is_some())
                    + usize::from(corners.is_some()),
            });
        }
    };
    let mut block = Block::new(shape, orientation, warp, Vec3::from_array(text.albedo));
    for (name, albedo) in &text.face_albedo {
        let face = read_face(name, || format!("block {index}"))?;
        block.albedo[face.index()] = Vec3::from_array(*albedo);
    }
    for (name, emission) in &text.face_emission {
        let face = read_face(name, || format!("block {index}"))?;
        block.emission[face.index()] = Vec3::from_array(*emission);
    }
    if let Some(name) = &text.transport {
        block.transport =
            WarpTransport::from_name(name).ok_or_else(|| LevelTextError::UnknownTransport {
                block: index,
                found: excerpt(name),
            })?;
    }
    Ok(block)
}

fn read_face(name: &str, place: impl FnOnce() -> String) -> Result<Face, LevelTextError> {
    Face::from_name(name).ok_or_else(|| LevelTextError::UnknownFace {
        place: place(),
        found: excerpt(name),
    })
}

fn write_block(block: &Block) -> BlockText {
    let (min, max) = block.warp.bounds();
    let is_cuboid = Hexahedron::cuboid(min, max) == block.warp;
    let is_cell = is_cuboid && max == min + DVec3::ONE;
    // The most frequent albedo becomes the block's; faces with another one are named.
    let uses = |albedo: &Vec3| block.albedo.iter().filter(|&a| a == albedo).count();
    let common = block
        .albedo
        .iter()
        .max_by_key(|albedo| uses(albedo))
        .copied()
        .unwrap_or(Vec3::ZERO);
    let others = Face::ALL
        .into_iter()
        .filter(|face| block.albedo[face.index()] != common)
        .map(|face| {
            let albedo = block.albedo[face.index()].to_array();
            (face.name().to_owned(), albedo)
        });
    BlockText {
        shape: block.shape.name.to_owned(),
        orientation: (block.orientation != CubeRotation::IDENTITY)
            .then(|| block.orientation.name()),
        cell: is_cell.then(|| min.to_array()),
        cuboid: (is_cuboid && !is_cell).then(|| [min.to_array(), max.to_array()]),
        corners: (!is_cuboid).then(|| block.warp.corners.map(|corner| corner.to_array())),
        albedo: common.to_array(),
        face_albedo: others.collect(),
        face_emission: Face::ALL
            .into_iter()
            .filter(|face| block.emission[face.index()] != Vec3::ZERO)
            .map(|face| {
                let emission = block.emission[face.index()].to_array();
                (face.name().to_owned(), emission)
            })
            .collect(),
        transport: (block.transport != WarpTransport::Canonical)
            .then(|| block.transport.name().to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::block::Door;

    fn sample() -> Level {
        let cells = [[0, 0, 0], [1, 0, 0], [1, 0, 1]];
        let mut level = Level::from_cells(&cells, Vec3::splat(0.7)).expect("flat cells");
        level.blocks[1].albedo[Face::NegY.index()] = Vec3::new(0.4, 0.2, 0.1);
        level.blocks[0].emission[Face::PosY.index()] = Vec3::new(3.0, 2.0, 1.0 / 3.0);
        level.doors.push(Door {
            connection: 1,
            value: 0.3,
        });
        level.blocks[1].transport = WarpTransport::Regathered;
        level.blocks[2].transport = WarpTransport::Rebuilt;
        level.blocks[2].warp.corners[7] += DVec3::new(0.1, 0.2, 1.0 / 3.0);
        level.mesh = Some(MeshReading {
            scale: 0.1,
            up: UpAxis::Z,
            origin: DVec3::new(1e7, 0.0, -3.0),
            skip_materials: vec!["a \"b\"*".to_owned()],
            only_materials: Vec::new(),
            keeps_tool_materials: true,
        });
        level
    }

    #[test]
    fn text_keeps_every_bit() {
        let level = sample();
        let text = level.to_text().expect("writes");
        assert_eq!(Level::from_text(&text), Ok(level));
    }

    #[test]
    fn each_fault_has_its_error() {
        let good = sample().to_text().expect("writes");
        let fault = |from: &str, to: &str| {
            assert!(good.contains(from), "{from} is not in the text");
            Level::from_text(&good.replacen(from, to, 1)).expect_err("refused")
        };
        assert!(matches!(
            fault("\"mrt-level\"", "\"bevy-scene\""),
            LevelTextError::NotALevel { .. }
        ));
        assert_eq!(
            fault("version = 1", "version = 7"),
            LevelTextError::UnsupportedVersion { found: 7 }
        );
        assert!(matches!(
            fault("\"corner\"", "\"sphere\""),
            LevelTextError::UnknownShape { block: 1, .. }
        ));
        assert!(matches!(
            fault("orientation = \"+z+y\"", "orientation = \"+z-z\""),
            LevelTextError::UnknownOrientation { .. }
        ));
        assert!(matches!(
            fault("\"rebuilt\"", "\"perfect\""),
            LevelTextError::UnknownTransport { block: 2, .. }
        ));
        assert!(!good.contains("canonical"));
        assert!(matches!(
            fault("\"+x\"", "\"up\""),
            LevelTextError::UnknownFace { .. }
        ));
        assert!(matches!(
            fault("albedo = [0.7", "albedo = [nan"),
            LevelTextError::Level(LevelError::Albedo { .. })
        ));
        for (from, to) in [
            ("albedo = [0.7", "albedo = [0.7, 0.7"),
            ("cell = [0.0", "cell = [0.0, 0.0"),
            ("connections = [[0", "connections = [[0, 0"),
            ("\"-x\"]", "\"-x\", 3]"),
        ] {
            let longer = fault(from, to);
            assert!(
                matches!(longer, LevelTextError::Malformed(_)),
                "{to}: {longer:?}"
            );
        }
        assert!(matches!(
            fault("cell = [0.0, 0.0, 0.0]\n", ""),
            LevelTextError::Placement { found: 0, .. }
        ));
        assert!(matches!(
            fault("cell = [0.0, 0.0, 0.0]", "cell = [0.0, 0.1, 0.0]"),
            LevelTextError::Level(LevelError::InterfaceMismatch { .. })
        ));
        assert!(matches!(
            Level::from_text("format = "),
            Err(LevelTextError::Malformed(_))
        ));
        assert_eq!(
            Level::from_text("format = \"mrt-level\"\nversion = 1"),
            Err(LevelTextError::Level(LevelError::Empty))
        );
    }

    #[test]
    fn faults_of_the_mesh_have_their_errors() {
        let good = sample().to_text().expect("writes");
        let fault = |from: &str, to: &str| {
            assert!(good.contains(from), "{from} is not in the text");
            Level::from_text(&good.replacen(from, to, 1)).expect_err("refused")
        };
        assert_eq!(
            fault("up = \"z\"", "up = \"x\""),
            LevelTextError::UnknownAxis {
                found: "x".to_owned()
            }
        );
        assert_eq!(
            fault("scale = 0.1", "scale = 0.0"),
            LevelTextError::Level(LevelError::MeshScale { found: 0.0 })
        );
        let four = fault("origin = [1", "origin = [0.0, 1");
        assert!(matches!(four, LevelTextError::Malformed(_)), "{four:?}");
        assert!(matches!(
            fault("origin = [10000000.0", "origin = [inf"),
            LevelTextError::Level(LevelError::MeshOrigin { .. })
        ));
        // A level of before has no mesh.
        let start = good.find("[mesh]").expect("a mesh");
        let end = good.find("[[block]]").expect("a block");
        let level = Level::from_text(&[&good[..start], &good[end..]].concat()).expect("reads");
        assert_eq!(level.mesh, None);
    }
}
