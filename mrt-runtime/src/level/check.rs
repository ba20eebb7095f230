//! Checks, once, what assembly and frames rely on.

use crate::level::block::{Block, Connection, Level, MAX_BLOCKS, Opening};
use crate::level::error::{FAR_LIMIT, JOIN_TOLERANCE, LevelError};
use crate::level::overlap;
use crate::level::shape::Outline;
use crate::light::limits::MAX_LIGHT_VALUE;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;

impl Level {
    /// Checks everything that assembly and the frame rely on.
    ///
    /// # Errors
    /// The first [`LevelError`] found: of blocks, of the mesh, of connections, then of doors, then of overlaps.
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
            check_warp(index, block)?;
            check_colours(index, block)?;
        }
        if let Some(mesh) = &self.mesh {
            mesh.check()?;
        }
        self.check_connections()?;
        self.check_doors()?;
        overlap::check(self)
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
        Ok(())
    }

    /// Each door closes a connection of its own, by a fraction.
    fn check_doors(&self) -> Result<(), LevelError> {
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

fn check_warp(index: usize, block: &Block) -> Result<(), LevelError> {
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
    Ok(())
}

fn check_colours(index: usize, block: &Block) -> Result<(), LevelError> {
    let is_within = |colour: Vec3, largest: f32| {
        let mut channels = colour.to_array().into_iter();
        channels.all(|x| (0.0..=largest).contains(&x))
    };
    for face in Face::ALL {
        let albedo = block.albedo[face.index()];
        if !is_within(albedo, 1.0) {
            return Err(LevelError::Albedo {
                block: index,
                face,
                found: albedo,
            });
        }
        let emission = block.emission[face.index()];
        if !is_within(emission, MAX_LIGHT_VALUE) {
            return Err(LevelError::Emission {
                block: index,
                face,
                found: emission,
            });
        }
    }
    Ok(())
}
