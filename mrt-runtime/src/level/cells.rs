//! Levels of unit cells: the shape and orientation that each cell needs follow from its neighbours.

use crate::level::block::{Block, Connection, Level, Opening};
use crate::level::shape::{Outline, SHAPES, Shape};
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;

impl Level {
    /// One unit block for each cell [x, x+1] x [y, y+1] x [z, z+1]; cells that share a face are joined.
    ///
    /// # Errors
    /// [`CellsError`], when a cell is given twice or no shape has its openings.
    pub fn from_cells(cells: &[[i32; 3]], albedo: Vec3) -> Result<Level, CellsError> {
        Self::from_joined_cells(cells, albedo, |_, _| true)
    }

    /// Same as [`Level::from_cells`], but neighbouring cells have a wall between them where `is_joined` is false. It
    /// gets the positions of both cells, and must return the same for both orders.
    ///
    /// # Errors
    /// [`CellsError`], when a cell is given twice or no shape has its openings.
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
}

/// Why cells are not a level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CellsError {
    /// A cell is given twice.
    #[error("cell {cell:?} stands at positions {first} and {second}; expected once")]
    Twice {
        /// The cell.
        cell: [i32; 3],
        /// First position.
        first: usize,
        /// Second position.
        second: usize,
    },
    /// No shape has exactly the openings of a cell.
    #[error("cell {cell:?} opens towards {openings:?}; expected the openings of a shape")]
    NoShape {
        /// The cell.
        cell: [i32; 3],
        /// Faces shared with other cells.
        openings: Vec<&'static str>,
    },
}

/// The shape and the rotation that leave exactly the faces `open` without a wall; a rotation about +Y where one
/// suffices.
pub fn shape_with_openings(open: &[Face]) -> Option<(&'static Shape, CubeRotation)> {
    let upright = (0..4).map(CubeRotation::about_y);
    upright.chain(CubeRotation::all()).find_map(|rotation| {
        SHAPES.iter().find_map(|shape| {
            let fits = shape.openings.len() == open.len()
                && shape.openings.iter().all(|opening| {
                    opening.outline == Outline::Whole && open.contains(&rotation.face(opening.face))
                });
            fits.then_some((shape, rotation))
        })
    })
}
