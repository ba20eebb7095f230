//! What the frame reads: a level joined with a dictionary, packed and immutable.

use crate::atlas::AtlasLayout;
use crate::shape::Shape;
use glam::{DVec3, Vec3};
use mrt_core::block_sparse::BlockSparse;
use mrt_core::cube::{CubeRotation, Face};
use mrt_core::hexahedron::Hexahedron;
use mrt_core::matrix::Matrix;
use std::ops::Range;

/// A level ready for frames. Made by [`assemble`](crate::assemble::assemble).
///
/// Everything inside a block is in its canonical frame: faces, texels and warps already contain the
/// orientation.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// In the order of the level's blocks.
    pub blocks: Vec<SceneBlock>,
    /// Operators of each shape that the level uses.
    pub shapes: Vec<SceneShape>,
    /// World positions of all texels, metres, block by block.
    pub texel_positions: Vec<Vec3>,
    /// Unit normals into the blocks.
    pub texel_normals: Vec<Vec3>,
    /// Linear RGB albedo of all texels.
    pub texel_albedo: Vec<Vec3>,
    /// `T_b->r`: row parts are interfaces, column parts blocks.
    pub response_from_coefficients: BlockSparse<f32>,
    /// Number of coefficients b over all blocks.
    pub coefficient_count: usize,
    /// Number of response coefficients r over all interfaces.
    pub response_count: usize,
    /// Where each wall's texels go in the lightmap.
    pub atlas: AtlasLayout,
}

/// A block of the scene.
#[derive(Clone, Debug)]
pub struct SceneBlock {
    /// Index into [`Scene::shapes`].
    pub shape_index: usize,
    /// Its canonical shape.
    pub shape: &'static Shape,
    /// Takes the canonical shape to the level's turned cube.
    pub orientation: CubeRotation,
    /// From the canonical cube to the world, metres.
    pub warp: Hexahedron,
    /// What lies beyond each canonical face.
    pub beyond: [Beyond; 6],
    /// Its part of the scene's texels.
    pub texels: Range<usize>,
    /// Its part of the coefficients b.
    pub coefficients: Range<usize>,
    /// Connected openings, through which light of other blocks comes in.
    pub interfaces: Vec<Interface>,
    /// All openings as loops in the world, in the order of the shape's list.
    pub portals: Vec<Portal>,
    /// Axis-aligned bounds (smallest, largest), metres.
    pub bounds: (DVec3, DVec3),
}

/// An opening's outline in the world.
#[derive(Clone, Copy, Debug)]
pub struct Portal {
    /// The canonical face.
    pub face: Face,
    /// Four corners in a loop that runs clockwise seen from inside the block, metres.
    pub corners: [DVec3; 4],
    /// Out of the block, at the first corner; not of unit length.
    pub outward: DVec3,
}

impl Portal {
    /// The outline of a canonical face of a warped cube.
    pub(crate) fn new(warp: &Hexahedron, face: Face) -> Self {
        let mut corners = warp.face_corners(face);
        let turn = |c: &[DVec3; 4]| (c[1] - c[0]).cross(c[3] - c[0]);
        let middle = corners.iter().copied().sum::<DVec3>() / 4.0;
        if turn(&corners).dot(middle - warp.center()) < 0.0 {
            corners.reverse();
        }
        Self {
            face,
            corners,
            outward: turn(&corners),
        }
    }
}

/// A connected opening seen from inside.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Position of the opening in the shape's list.
    pub opening: usize,
    /// Its part of the response coefficients r.
    pub responses: Range<usize>,
}

/// What lies beyond a face of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beyond {
    /// A wall.
    Wall,
    /// The outside of the level.
    Outside,
    /// Another block.
    Block {
        /// Its index.
        block: usize,
        /// The canonical face of it that is joined to this one.
        face: Face,
        /// Takes directions of its canonical cube to directions of this block's.
        here_from_there: CubeRotation,
    },
}

/// Operators of a shape that frames use.
#[derive(Clone, Debug)]
pub struct SceneShape {
    /// `T_d->b`, modes x texels.
    pub coefficients_from_direct: Matrix<f32>,
    /// `U_b`, texels x modes.
    pub indirect_basis: Matrix<f32>,
    /// `U_r` brought to each opening of the shape, texels x response modes.
    pub response_bases: Vec<Matrix<f32>>,
}

impl Scene {
    /// Number of texels over all blocks.
    pub fn texel_count(&self) -> usize {
        self.texel_positions.len()
    }

    /// The first block that contains a point, else the first that it lies within `tolerance` (in block
    /// widths) of.
    pub fn block_at(&self, point: DVec3, tolerance: f64) -> Option<usize> {
        let containing = |slack: f64| {
            self.blocks.iter().position(|block| {
                // Most blocks are far away, and this is asked in every frame.
                let (min, max) = block.bounds;
                let margin = DVec3::splat(slack) * (max - min).length();
                point.cmpge(min - margin).all()
                    && point.cmple(max + margin).all()
                    && block.warp.contains(point, slack)
            })
        };
        containing(0.0).or_else(|| containing(tolerance))
    }

    /// Index within a block of the texel at (row, column) of a face *as the level names it*, after
    /// orientation; `None` for openings and texels that do not exist.
    pub fn level_texel(
        &self,
        block: usize,
        face: Face,
        row: usize,
        column: usize,
    ) -> Option<usize> {
        let resolution = self.resolution;
        let placed = self.blocks.get(block)?;
        if row >= resolution || column >= resolution {
            return None;
        }
        let canonical = placed.orientation.inverse();
        let center = canonical.point(face.texel_center(resolution, row, column));
        let face = canonical.face(face);
        let offset = placed.shape.wall_offset(face, resolution)?;
        Some(offset + face.texel_index(center, resolution))
    }

    /// Bytes of the operators that frames read.
    pub fn operator_bytes(&self) -> usize {
        let of_shapes: usize = self
            .shapes
            .iter()
            .flat_map(|shape| {
                [&shape.coefficients_from_direct, &shape.indirect_basis]
                    .into_iter()
                    .chain(&shape.response_bases)
            })
            .map(|matrix| std::mem::size_of_val(matrix.data()))
            .sum();
        of_shapes + self.response_from_coefficients.bytes()
    }
}
