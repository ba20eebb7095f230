//! A level to be solved: its blocks, what lies behind their faces, and its texels.

use super::error::{ExactError, check_length};
use crate::geometry::cube::Face;
use crate::geometry::form_factor::HalfSpace;
use crate::geometry::hexahedron::Hexahedron;
use crate::reference::cells::neighbour_cell;
use glam::DVec3;
use std::collections::HashMap;

/// Most texels of a level whose transport is stored.
///
/// The transport takes 4 bytes for each pair of texels that see each other. In a maze that is about a
/// tenth of all pairs (1.7 GB at this limit), in one open hall nearly all.
pub const MAX_TEXELS: usize = 1 << 16;

/// How far joined corners may lie apart, and a corner from the plane of its face, in diagonals of the
/// block.
const CORNER_TOLERANCE: f64 = 1e-9;

/// What lies behind a block's face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// A diffuse wall, divided into texels.
    Wall,
    /// Nothing: light that arrives there is lost, and none comes back.
    Sky,
    /// A face of another block, open as a whole.
    Opening(usize, Face),
}

/// A wall face, and where its texels start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// Index of the block.
    pub block: usize,
    /// Which of its faces.
    pub face: Face,
    /// Index of texel (0, 0). The `resolution`² texels of the wall have consecutive indices.
    pub first_texel: usize,
}

/// A planar piece of a block's convex hull.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Its unit normal points into the block.
    pub(super) plane: HalfSpace,
    pub(super) polygon: Vec<DVec3>,
}

/// A level to be solved: checked blocks and openings, and the texels on the walls.
#[derive(Clone, Debug)]
pub struct ExactScene {
    pub(super) blocks: Vec<Hexahedron>,
    pub(super) sides: Vec<[Side; 6]>,
    pub(super) resolution: usize,
    pub(super) walls: Vec<Wall>,
    /// By block and face: one facet if the face is planar, else two.
    pub(super) facets: Vec<[Vec<Facet>; 6]>,
    pub(super) centers: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    pub(super) areas: Vec<f64>,
}

impl ExactScene {
    /// A level of warped blocks, with `resolution`² texels on each wall. `sides[b]` says what lies
    /// behind each face of block b, in the order of [`Face::ALL`].
    ///
    /// The blocks must not overlap, so that a straight ray meets each at most once.
    ///
    /// # Errors
    /// [`ExactError`] for folded blocks, openings that do not match, and levels with no texel or more
    /// than [`MAX_TEXELS`].
    pub fn new(
        blocks: Vec<Hexahedron>,
        sides: Vec<[Side; 6]>,
        resolution: usize,
    ) -> Result<Self, ExactError> {
        Self::with_at_most(blocks, sides, resolution, MAX_TEXELS)
    }

    /// [`ExactScene::new`] with a limit of the caller's choice, for callers that do not store the
    /// transport but compute single rows of it
    /// ([`irradiance_at`](super::transport::irradiance_at)).
    ///
    /// # Errors
    /// As [`ExactScene::new`], for more than `max_texels` texels.
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

    /// A level of unit cells. Cells that share a face are open to each other; all other faces are walls.
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
    /// Number of texels along each side of a wall.
    pub fn resolution(&self) -> usize {
        self.resolution
    }
    /// The walls, in the order of their texels.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }
    /// Number of texels, which is the length of every irradiance vector.
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

    /// Copies one value for each wall to the texels of the wall.
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

    /// Fills centres, normals and areas.
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

/// Checks that openings lead to one another and have the same corners.
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

/// The walls of a level that has at least one texel and at most `expected`.
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

/// +1 if the corners of [`Hexahedron::face_corners`] wind counter-clockwise seen from inside, else -1.
pub(super) fn winding(face: Face) -> f64 {
    let mut u = DVec3::ZERO;
    let mut v = DVec3::ZERO;
    u[face.u_axis()] = 1.0;
    v[face.v_axis()] = 1.0;
    -u.cross(v).dot(face.outward())
}

/// The facets of a block's convex hull, by face. A face that is not planar folds along the diagonal
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
        let triangle =
            |a: DVec3, b: DVec3, c: DVec3| facet(&[a, b, c], (b - a).cross(c - a) * sign);
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
