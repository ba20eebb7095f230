//! What frames read: a level joined with a dictionary, packed and immutable.

use crate::level::block_index::BlockIndex;
use crate::level::placed::PlacedLevel;
use crate::modular::packed::{PackedShape, PackedTransport};
use crate::output::lightmap_atlas::LightmapAtlas;
use crate::output::texel_layout::{BlockRank, TexelGeometry, TexelLayout};
use glam::{DMat3, Vec3};
use mrt_core::geometry::cube::Face;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A level ready for frames. Made by [`Scene::assemble`]; never changes afterwards.
///
/// Clones share one set of data, so a scene costs nothing to hand to another thread or to a second frame.
#[derive(Clone, Debug)]
pub struct Scene(Arc<SceneData>);

impl Scene {
    pub(crate) fn new(data: SceneData) -> Self {
        Self(Arc::new(data))
    }

    /// True if both are the same scene, not merely equal ones.
    pub fn is_same(&self, other: &Scene) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Texels along an edge of a wall.
    pub fn resolution(&self) -> usize {
        self.level.resolution
    }

    /// Index within a block of the texel at (row along v, column along u) of a face of the turned cube, as
    /// [`Frame::indirect_at`](crate::modular::frame::Frame::indirect_at) takes it; `None` for openings, and for blocks and
    /// texels that do not exist.
    pub fn texel(&self, block: BlockIndex, face: Face, row: usize, column: usize) -> Option<usize> {
        self.level.level_texel(block, face, row, column)
    }
}

impl Deref for Scene {
    type Target = SceneData;

    fn deref(&self) -> &SceneData {
        &self.0
    }
}

/// The data of a [`Scene`].
///
/// Everything inside a block is in its canonical frame: faces, texels and warps already contain the orientation.
#[derive(Clone, Debug)]
pub struct SceneData {
    /// Blocks, openings and doors.
    pub level: PlacedLevel,
    /// What modular transport adds to each block, in the level's order.
    pub blocks: Vec<SceneBlock>,
    /// Operators of each shape that the level uses, as kernels read them.
    pub shapes: Vec<PackedShape>,
    /// Where frames keep texels.
    pub layout: TexelLayout,
    /// Where frames keep coefficients.
    pub rows: CoefficientLayout,
    /// Where texels are.
    pub texels: TexelGeometry,
    /// `T_b->r`: from the coefficients b of all blocks to the joint coefficients of all blocks.
    pub transport: PackedTransport,
    /// Probes along an edge of a block; 0 if the dictionary has none.
    pub probes: usize,
    /// Where each wall's texels go in the lightmap.
    pub atlas: LightmapAtlas,
}

/// What modular transport knows of a block.
#[derive(Clone, Debug)]
pub struct SceneBlock {
    /// Index into [`SceneData::shapes`].
    pub shape_index: usize,
    /// Its part of the coefficients b.
    pub coefficients: Range<usize>,
    /// Its part of the joint coefficients; the first of them take its own coefficients b.
    pub joint: Range<usize>,
    /// Takes the axes of the block's probes to the world's: an orthogonal matrix.
    pub world_from_probe: DMat3,
}

/// How frames keep coefficients: as many rows for every block, channel by channel.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientLayout {
    /// Coefficients that each block has room for, a channel: those of the shape with the most
    /// [`rows`](PackedShape::rows), and padding that stays zero.
    pub count: usize,
    /// By shape: the row of each coefficient b.
    pub row_of_mode: Vec<Vec<u16>>,
}

impl CoefficientLayout {
    /// Coefficients of a block, three channels.
    pub fn per_block(&self) -> usize {
        3 * self.count
    }

    /// Where a block's coefficients are among those of all blocks.
    pub fn of_block(&self, rank: BlockRank) -> Range<usize> {
        rank.get() * self.per_block()..(rank.get() + 1) * self.per_block()
    }
}

impl SceneData {
    /// True if every shape has vector irradiance.
    pub fn has_vector(&self) -> bool {
        self.level
            .blocks
            .iter()
            .zip(&self.blocks)
            .all(|(placed, block)| {
                let rows = self.shapes[block.shape_index].vector.rows;
                rows == 4 * placed.texels.len()
            })
    }

    /// Number of texels over all blocks.
    pub fn texel_count(&self) -> usize {
        self.level.texel_count()
    }

    /// The slot of a texel, counted over all blocks; `None` if there is no such texel.
    pub fn slot(&self, texel: usize) -> Option<usize> {
        let blocks = &self.level.blocks;
        let block = blocks.partition_point(|block| block.texels.end <= texel);
        let first = blocks.get(block)?.texels.start;
        self.layout.slot(BlockIndex::new(block), texel - first)
    }

    /// World position, metres, of a texel, counted over all blocks; `None` if there is no such texel.
    pub fn texel_position(&self, texel: usize) -> Option<Vec3> {
        Some(self.texels.positions.get(self.slot(texel)?))
    }

    /// Unit normal into the block of a texel, counted over all blocks; `None` if there is no such texel.
    pub fn texel_normal(&self, texel: usize) -> Option<Vec3> {
        Some(self.texels.normals.get(self.slot(texel)?))
    }

    /// Bytes of the operators that frames read.
    pub fn operator_bytes(&self) -> usize {
        let of_shapes: usize = self.shapes.iter().map(PackedShape::bytes).sum();
        of_shapes + self.transport.bytes()
    }
}
