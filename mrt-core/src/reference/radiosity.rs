//! The exact reference solver: radiosity in levels of convex blocks joined through whole faces.
//!
//! Nothing is sampled between surfaces. Visibility is carried through openings as a cone
//! ([`transport`]), form factors are Lambert's polygon formula, and the only approximation is that
//! each texel sends out one radiosity. Texels lie on wall faces only, block by block, faces in the
//! order of [`Face::ALL`], then row v, then column u.
//!
//! Faces that are not planar: visibility takes a block as the convex hull of its eight corners. A
//! texel is its loop of four corners, which needs neither a plane nor two triangles: a bilinear
//! face has straight grid lines, and Lambert's formula sees only the outline, so the loop is exact
//! wherever the face does not hide a part of itself. What it hides of itself is neglected.

pub mod direct;
mod krylov;
pub mod solve;
pub mod transport;

use std::collections::HashMap;

use crate::geometry::cube::Face;
use crate::geometry::form_factor::HalfSpace;
use crate::geometry::hexahedron::{Hexahedron, HexahedronError};
use glam::DVec3;

use crate::reference::error_measure::neighbour_cell;

/// Texels a level may have. The transport between them is stored: a maze sees about a tenth of all
/// pairs at 4 bytes each (1.7 GB at this limit), one open hall nearly all.
pub const MAX_TEXELS: usize = 1 << 16;

/// Fraction of a block's diagonal by which corners may miss each other, or a face its plane.
const CORNER_TOLERANCE: f64 = 1e-9;

/// What lies behind a block's face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// A diffuse wall, divided into texels.
    Wall,
    /// Nothing: light that gets there is gone and none comes back.
    Sky,
    /// A face of another block, wide open.
    Opening(usize, Face),
}

/// A wall face and where its texels start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// Index of the block.
    pub block: usize,
    /// Which of its faces.
    pub face: Face,
    /// Index of texel (0, 0); the wall's `resolution`² texels follow each other.
    pub first_texel: usize,
}

/// A planar piece of a block's convex hull.
#[derive(Clone, Debug)]
struct Facet {
    /// Unit normal, into the block.
    plane: HalfSpace,
    polygon: Vec<DVec3>,
}

/// A level to be solved: geometry and connectivity, checked.
#[derive(Clone, Debug)]
pub struct ExactScene {
    blocks: Vec<Hexahedron>,
    sides: Vec<[Side; 6]>,
    resolution: usize,
    walls: Vec<Wall>,
    /// Per block and face: one facet if planar, else two.
    facets: Vec<[Vec<Facet>; 6]>,
    centers: Vec<DVec3>,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
}

/// Why a level cannot be solved exactly.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExactError {
    /// Blocks and their sides are not equally many.
    #[error("there are {found} sets of sides; expected {expected}, one for each block")]
    SideCount {
        /// Number of blocks.
        expected: usize,
        /// Number of sets of sides.
        found: usize,
    },
    /// The level is too large, empty of texels, or the texel grid is.
    #[error("the level has {found} texels; expected 1 to {expected}")]
    TexelCount {
        /// Most accepted.
        expected: usize,
        /// Resolution squared times the number of walls.
        found: usize,
    },
    /// A block is no image of a cube.
    #[error("block {block}: {source}")]
    Warp {
        /// Index of the block.
        block: usize,
        /// What is wrong with it.
        source: HexahedronError,
    },
    /// Two cells are the same.
    #[error("cell {cell:?} is listed twice; expected each cell once")]
    DuplicateCell {
        /// Its coordinates.
        cell: [i32; 3],
    },
    /// An opening names a block that does not exist, or is not named back by it.
    #[error(
        "block {block} opens at {face} to face {other_face} of block {other}; expected that face to \
         open back to it"
    )]
    OneWayOpening {
        /// Index of the block.
        block: usize,
        /// Its face.
        face: Face,
        /// The block it names.
        other: usize,
        /// The face it names.
        other_face: Face,
    },
    /// Two joined faces are not the same quadrilateral.
    #[error(
        "block {block} at {face} and block {other} miss each other by {found:.3e}; expected the same \
         four corners"
    )]
    CornersApart {
        /// Index of the block.
        block: usize,
        /// Its face.
        face: Face,
        /// The block behind the opening.
        other: usize,
        /// Largest distance from a corner to the nearest corner of the other face.
        found: f64,
    },
    /// An input vector has the wrong length.
    #[error("{what} has {found} values; expected {expected}")]
    Length {
        /// Which input.
        what: &'static str,
        /// Values needed.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// An albedo is NaN, negative, above 1, or, with all bounces, not below 1.
    #[error("the albedo of {at} is {found}; expected at least 0 and {bound}")]
    Albedo {
        /// "texel 17".
        at: String,
        /// "at most 1" or "below 1 for all bounces".
        bound: &'static str,
        /// Value given.
        found: f64,
    },
    /// The solution of all bounces did not reach its tolerance.
    #[error("all bounces converged to {found:.1e} in {steps} steps; expected {expected:.1e}")]
    NotConverged {
        /// Relative residual asked for.
        expected: f64,
        /// Relative residual reached.
        found: f64,
        /// Products with the operator that were spent.
        steps: usize,
    },
}

impl ExactScene {
    /// A level of warped blocks; `sides[b]` says what lies behind each face of block b, in the order
    /// of [`Face::ALL`], and `resolution`² texels lie on each wall.
    ///
    /// The blocks must not overlap: then a straight ray meets each at most once.
    ///
    /// # Errors
    /// [`ExactError`] for folded blocks, openings that do not match, and levels with no texel or
    /// more than [`MAX_TEXELS`].
    pub fn new(
        blocks: Vec<Hexahedron>,
        sides: Vec<[Side; 6]>,
        resolution: usize,
    ) -> Result<Self, ExactError> {
        Self::with_at_most(blocks, sides, resolution, MAX_TEXELS)
    }

    /// As [`ExactScene::new`], for a level of up to `max_texels`: for callers that store no [`transport::Transport`] but
    /// take single rows of it ([`transport::irradiance_at`]).
    ///
    /// # Errors
    /// As [`ExactScene::new`].
    pub fn with_at_most(
        blocks: Vec<Hexahedron>,
        sides: Vec<[Side; 6]>,
        resolution: usize,
        max_texels: usize,
    ) -> Result<Self, ExactError> {
        if sides.len() != blocks.len() {
            return Err(ExactError::SideCount {
                expected: blocks.len(),
                found: sides.len(),
            });
        }
        for (block, warp) in blocks.iter().enumerate() {
            let check = warp.check();
            check.map_err(|source| ExactError::Warp { block, source })?;
        }
        check_openings(&blocks, &sides)?;
        let walls = list_walls(&sides, resolution, max_texels)?;
        let facets = blocks.iter().map(block_facets).collect();
        let mut scene = Self {
            blocks,
            sides,
            resolution,
            walls,
            facets,
            centers: Vec::new(),
            normals: Vec::new(),
            areas: Vec::new(),
        };
        scene.place_texels();
        Ok(scene)
    }

    /// A level of unit cells: cells that share a face are open to each other, other faces are walls.
    ///
    /// # Errors
    /// [`ExactError`] for repeated cells and levels with no texel or more than [`MAX_TEXELS`].
    pub fn from_cells(cells: &[[i32; 3]], resolution: usize) -> Result<Self, ExactError> {
        let mut index_of = HashMap::new();
        for (block, &cell) in cells.iter().enumerate() {
            if index_of.insert(cell, block).is_some() {
                return Err(ExactError::DuplicateCell { cell });
            }
        }
        let side = |cell: [i32; 3], face: Face| {
            let across = neighbour_cell(cell, face).and_then(|cell| index_of.get(&cell));
            across.map_or(Side::Wall, |&block| Side::Opening(block, face.opposite()))
        };
        let sides = cells
            .iter()
            .map(|&cell| Face::ALL.map(|face| side(cell, face)))
            .collect();
        let blocks = cells
            .iter()
            .map(|cell| Hexahedron::cell(DVec3::from_array(cell.map(f64::from))))
            .collect();
        Self::new(blocks, sides, resolution)
    }

    /// The blocks, in the order given.
    pub fn blocks(&self) -> &[Hexahedron] {
        &self.blocks
    }
    /// Texels along each side of a wall.
    pub fn resolution(&self) -> usize {
        self.resolution
    }
    /// The walls, in texel order.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }
    /// Number of texels: length of every irradiance vector.
    pub fn texel_count(&self) -> usize {
        self.centers.len()
    }
    /// World positions of the texel centres.
    pub fn centers(&self) -> &[DVec3] {
        &self.centers
    }
    /// Unit normals into the block, at the texel centres.
    pub fn normals(&self) -> &[DVec3] {
        &self.normals
    }
    /// Texel areas, square metres.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// One value for each wall spread over its texels.
    ///
    /// # Errors
    /// [`ExactError::Length`] if there is not one value for each wall.
    pub fn spread_over_texels<T: Copy>(&self, per_wall: &[T]) -> Result<Vec<T>, ExactError> {
        check_length("the list of walls", self.walls.len(), per_wall.len())?;
        let texels = self.resolution * self.resolution;
        Ok(per_wall
            .iter()
            .flat_map(|&value| std::iter::repeat_n(value, texels))
            .collect())
    }

    fn place_texels(&mut self) {
        let step = 1.0 / self.resolution as f64;
        for wall in &self.walls {
            let block = &self.blocks[wall.block];
            for j in 0..self.resolution {
                for i in 0..self.resolution {
                    let (u, v) = ((i as f64 + 0.5) * step, (j as f64 + 0.5) * step);
                    self.centers.push(block.point(wall.face.point(u, v)));
                    self.normals.push(block.face_normal(wall.face, u, v));
                    let [a, b, c, d] = wall
                        .face
                        .rectangle(
                            [i as f64 * step, (i + 1) as f64 * step],
                            [j as f64 * step, (j + 1) as f64 * step],
                        )
                        .map(|unit| block.point(unit));
                    self.areas.push((c - a).cross(d - b).length() * 0.5);
                }
            }
        }
    }
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), ExactError> {
    if expected == found {
        Ok(())
    } else {
        Err(ExactError::Length {
            what,
            expected,
            found,
        })
    }
}

fn check_openings(blocks: &[Hexahedron], sides: &[[Side; 6]]) -> Result<(), ExactError> {
    for (block, faces) in sides.iter().enumerate() {
        for face in Face::ALL {
            let Side::Opening(other, other_face) = faces[face.index()] else {
                continue;
            };
            let back = sides.get(other).map(|sides| sides[other_face.index()]);
            if back != Some(Side::Opening(block, face)) || other == block {
                return Err(ExactError::OneWayOpening {
                    block,
                    face,
                    other,
                    other_face,
                });
            }
            let opposite = blocks[other].face_corners(other_face);
            let miss = |corner: DVec3| {
                let distances = opposite.iter().map(|&c| c.distance(corner));
                distances.fold(f64::INFINITY, f64::min)
            };
            let found = blocks[block].face_corners(face).map(miss);
            let found = found.into_iter().fold(0.0, f64::max);
            if found > CORNER_TOLERANCE * blocks[block].diagonal() {
                return Err(ExactError::CornersApart {
                    block,
                    face,
                    other,
                    found,
                });
            }
        }
    }
    Ok(())
}

fn list_walls(
    sides: &[[Side; 6]],
    resolution: usize,
    expected: usize,
) -> Result<Vec<Wall>, ExactError> {
    let walls: Vec<(usize, Face)> = (0..sides.len())
        .flat_map(|block| Face::ALL.map(|face| (block, face)))
        .filter(|&(block, face)| sides[block][face.index()] == Side::Wall)
        .collect();
    let texels = resolution.saturating_mul(resolution);
    let found = texels.saturating_mul(walls.len());
    if found == 0 || found > expected {
        return Err(ExactError::TexelCount { expected, found });
    }
    let indexed = walls.into_iter().enumerate();
    Ok(indexed
        .map(|(index, (block, face))| Wall {
            block,
            face,
            first_texel: index * texels,
        })
        .collect())
}

/// +1 if the corners of [`Hexahedron::face_corners`] wind counter-clockwise seen from inside.
fn winding(face: Face) -> f64 {
    let mut u = DVec3::ZERO;
    let mut v = DVec3::ZERO;
    u[face.u_axis()] = 1.0;
    v[face.v_axis()] = 1.0;
    -u.cross(v).dot(face.outward())
}

/// The facets of a block's convex hull by face. A face that is not planar folds along the diagonal
/// that makes the block convex.
fn block_facets(block: &Hexahedron) -> [Vec<Facet>; 6] {
    Face::ALL.map(|face| {
        let corners = block.face_corners(face);
        let [a, b, c, d] = corners;
        let facet = |polygon: &[DVec3], normal: DVec3| Facet {
            plane: HalfSpace::through(polygon[0], normal.normalize()),
            polygon: polygon.to_vec(),
        };
        let sign = winding(face);
        let triangle = |a: DVec3, b: DVec3, c: DVec3| {
            facet(&[a, b, c], (b - a).cross(c - a) * sign) //
        };
        let first = triangle(a, b, c);
        let lift = first.plane.side(d);
        if lift.abs() <= CORNER_TOLERANCE * block.diagonal() {
            vec![facet(&corners, (c - a).cross(d - b) * sign)]
        } else if lift > 0.0 {
            vec![first, triangle(a, c, d)]
        } else {
            vec![triangle(a, b, d), triangle(b, c, d)]
        }
    })
}
