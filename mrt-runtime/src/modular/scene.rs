//! A scene: a level joined with a dictionary, packed for frames and immutable.

use crate::level::block_index::BlockIndex;
use crate::level::placed::PlacedLevel;
use crate::modular::packed::{PackedShape, PackedTransport};
use crate::output::lightmap_atlas::LightmapAtlas;
use crate::output::texel_layout::{BlockRank, TexelGeometry, TexelLayout};
use glam::{DMat3, Vec3};
use mrt_core::geometry::cube::Face;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A level joined with a dictionary, ready for frames. Made by [`Scene::assemble`]; it never changes.
///
/// A clone shares the data, so giving a scene to another thread or a second frame costs nothing.
#[derive(Clone, Debug)]
pub struct Scene(Arc<SceneData>);

impl Scene {
    pub(crate) fn new(data: SceneData) -> Self {
        Self(Arc::new(data))
    }

    /// True if both share their data: one is a clone of the other.
    pub fn is_same(&self, other: &Scene) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Texels along an edge of a wall.
    pub fn resolution(&self) -> usize {
        self.level.resolution
    }

    /// Index within a block of the texel at (row along v, column along u) of a face of the turned cube, as
    /// [`Frame::indirect_at`](crate::modular::frame::Frame::indirect_at) takes it; `None` for openings, and for blocks
    /// and texels that do not exist.
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
/// Faces, texels and warps of a block are in its canonical frame: the orientation is part of the warp.
#[derive(Clone, Debug)]
pub struct SceneData {
    /// Blocks, openings and doors.
    pub level: PlacedLevel,
    /// Data of modular transport for each block, in the level's order.
    pub blocks: Vec<SceneBlock>,
    /// Packed operators of each shape that the level uses.
    pub shapes: Vec<PackedShape>,
    /// Layout of texels in frames.
    pub layout: TexelLayout,
    /// Layout of coefficients in frames.
    pub rows: CoefficientLayout,
    /// Positions and normals of texels.
    pub texels: TexelGeometry,
    /// `T_b->r`: from the coefficients b of all blocks to the joint coefficients of all blocks.
    pub transport: PackedTransport,
    /// Probes along an edge of a block; 0 if the dictionary has none.
    pub probes: usize,
    /// Layout of the lightmap.
    pub atlas: LightmapAtlas,
}

/// Data of modular transport for a block.
#[derive(Clone, Debug)]
pub struct SceneBlock {
    /// Index into [`SceneData::shapes`].
    pub shape_index: usize,
    /// Range of the block's coefficients b among those of all blocks.
    pub coefficients: Range<usize>,
    /// Range of the block's joint coefficients among those of all blocks. The first of them take the block's own
    /// coefficients b.
    pub joint: Range<usize>,
    /// Orthogonal matrix from the axes of the block's probes to those of the world.
    pub world_from_probe: DMat3,
}

/// The layout of coefficients in a frame's memory: the same number of rows for every block, channel by channel.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientLayout {
    /// Rows of a block in each channel: at least the [`rows`](PackedShape::rows) of every shape, with padding that
    /// stays zero.
    pub count: usize,
    /// By shape: for each coefficient b, its row.
    pub row_of_mode: Vec<Vec<u16>>,
}

impl CoefficientLayout {
    /// Number of rows of a block in all three channels.
    pub fn per_block(&self) -> usize {
        3 * self.count
    }

    /// Range of a block's rows among those of all blocks.
    pub fn of_block(&self, rank: BlockRank) -> Range<usize> {
        rank.get() * self.per_block()..(rank.get() + 1) * self.per_block()
    }
}

impl SceneData {
    /// True if all blocks have vector irradiance.
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

    /// The slot of texel number `texel`, counted over all blocks; `None` if there is no such texel.
    pub fn slot(&self, texel: usize) -> Option<usize> {
        let blocks = &self.level.blocks;
        let block = blocks.partition_point(|block| block.texels.end <= texel);
        let first = blocks.get(block)?.texels.start;
        self.layout.slot(BlockIndex::new(block), texel - first)
    }

    /// World position, metres, of texel number `texel`, counted over all blocks; `None` if there is no such texel.
    pub fn texel_position(&self, texel: usize) -> Option<Vec3> {
        Some(self.texels.positions.get(self.slot(texel)?))
    }

    /// Unit normal, into its block, of texel number `texel`, counted over all blocks; `None` if there is no such texel.
    pub fn texel_normal(&self, texel: usize) -> Option<Vec3> {
        Some(self.texels.normals.get(self.slot(texel)?))
    }

    /// Bytes of the operators that frames read.
    pub fn operator_bytes(&self) -> usize {
        let of_shapes: usize = self.shapes.iter().map(PackedShape::bytes).sum();
        of_shapes + self.transport.bytes()
    }
}
