//! A level ready to be lit: each block in its canonical frame, with its neighbours beyond its openings.
//!
//! All methods share this; it knows nothing of operators.

use crate::level::block_grid::BlockGrid;
use crate::level::block_index::BlockIndex;
use crate::level::shape::{Aperture, Shape};
use crate::level::unit_from_world::UnitFromWorld;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use std::ops::Range;

/// A point outside a block by at most this fraction of the block's width still counts as inside.
pub const BLOCK_TOLERANCE: f64 = 1e-4;

/// The blocks of a level, and its doors.
#[derive(Clone, Debug)]
pub struct PlacedLevel {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// In the order of the level's blocks.
    pub blocks: Vec<PlacedBlock>,
    /// For each door of the level, the fraction of light in [0, 1] that it lets through at first.
    pub doors: Vec<f32>,
    /// Finds the blocks near a point in constant time.
    pub(crate) grid: BlockGrid,
}

/// A block in its canonical frame: faces, texels and warp contain the orientation.
#[derive(Clone, Debug)]
pub struct PlacedBlock {
    /// Canonical shape of the block.
    pub shape: &'static Shape,
    /// Rotation from the canonical cube to the turned cube of the level.
    pub orientation: CubeRotation,
    /// Map from the canonical cube to the world, metres.
    pub warp: Hexahedron,
    /// Inverse of `warp`.
    pub unit_from_world: UnitFromWorld,
    /// What lies beyond each canonical face.
    pub beyond: [Beyond; 6],
    /// Indices of the block's texels among all texels of the level.
    pub texels: Range<usize>,
    /// Index into [`PlacedLevel::doors`] of the door in each canonical face.
    pub doors: [Option<u32>; 6],
    /// Outlines in the world of all openings, in the order of [`Shape::openings`].
    pub portals: Vec<Portal>,
    /// Axis-aligned bounds (smallest, largest), metres.
    pub bounds: (DVec3, DVec3),
    /// Linear RGB albedo of each canonical face at first; frames keep a copy that a game may change.
    pub albedo: [Vec3; 6],
    /// Radiosity that each canonical face emits at first, linear RGB, W/m²; frames keep a copy that a game may change.
    pub emission: [Vec3; 6],
}

/// An opening's outline in the world.
#[derive(Clone, Debug)]
pub struct Portal {
    /// The canonical face.
    pub face: Face,
    /// Corners, metres, in a loop that runs clockwise seen from inside the block: four, or 32 of a polygon around a
    /// disc.
    pub corners: Vec<DVec3>,
    /// Normal out of the block at the first corner, not of unit length.
    pub outward: DVec3,
}

impl Portal {
    /// The outline of an opening of a warped cube.
    pub(crate) fn new(warp: &Hexahedron, opening: &Aperture) -> Self {
        let mut corners: Vec<DVec3> = opening
            .corners()
            .into_iter()
            .map(|corner| warp.point(corner))
            .collect();
        let quarter = corners.len() / 4;
        let turn = |c: &[DVec3]| (c[quarter] - c[0]).cross(c[3 * quarter] - c[0]);
        let middle = corners.iter().copied().sum::<DVec3>() / corners.len() as f64;
        if turn(&corners).dot(middle - warp.center()) < 0.0 {
            corners.reverse();
        }
        Self {
            face: opening.face,
            outward: turn(&corners),
            corners,
        }
    }

    /// The point where a line crosses the plane of the opening; `origin` if the line is parallel to the plane.
    pub(crate) fn crossing(&self, origin: DVec3, direction: DVec3) -> DVec3 {
        let along = direction.dot(self.outward);
        if along == 0.0 {
            return origin;
        }
        origin + direction * ((self.corners[0] - origin).dot(self.outward) / along)
    }
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
        /// Which block.
        block: BlockIndex,
        /// The canonical face of that block that is joined to this one.
        face: Face,
        /// Rotation from the other block's canonical cube to this block's.
        here_from_there: CubeRotation,
    },
}

impl PlacedBlock {
    /// True if a point, metres, is inside the block, or outside by at most `slack` block widths.
    fn contains(&self, point: DVec3, slack: f64) -> bool {
        let (min, max) = self.bounds;
        let margin = DVec3::splat(slack) * (max - min).length();
        point.cmpge(min - margin).all()
            && point.cmple(max + margin).all()
            && self.warp.contains(point, slack)
            && self.is_inside_walls(point, slack)
    }

    /// False if the block is a tube and a point of its cube is outside the round wall by more than `tolerance` block
    /// widths.
    fn is_inside_walls(&self, point: DVec3, tolerance: f64) -> bool {
        self.shape.tube().is_none()
            || self
                .shape
                .is_inside_walls(self.unit_from_world.point(point), tolerance)
    }
}

impl PlacedLevel {
    /// Number of texels over all blocks.
    pub fn texel_count(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.texels.end)
    }

    /// The block at an index; `None` if the level has no such block.
    pub fn block(&self, index: BlockIndex) -> Option<&PlacedBlock> {
        self.blocks.get(index.get())
    }

    /// The first block that contains a point, metres; if none does, the first that contains it within
    /// [`BLOCK_TOLERANCE`].
    ///
    /// Cost: a test of each of the few blocks near the point, however many the level has.
    pub fn block_at(&self, point: DVec3) -> Option<BlockIndex> {
        let near = self.grid.near(point);
        let containing = |slack: f64| {
            let mut near = near.iter().copied();
            near.find(|index| self.blocks[index.get()].contains(point, slack))
        };
        containing(0.0).or_else(|| containing(BLOCK_TOLERANCE))
    }

    /// The first tube whose cube contains a point, inside or outside the round wall.
    pub(crate) fn tube_around(&self, point: DVec3) -> Option<BlockIndex> {
        let is_around = |index: &BlockIndex| {
            let block = &self.blocks[index.get()];
            block.shape.tube().is_some() && block.warp.contains(point, 0.0)
        };
        self.grid.near(point).iter().copied().find(is_around)
    }

    /// Index within a block of the texel at (row, column) of a face *as the level names it*, after orientation. For a
    /// tube, row and column count on the flat face that names the chart. `None` for openings, and for blocks and texels
    /// that do not exist.
    pub fn level_texel(
        &self,
        block: BlockIndex,
        face: Face,
        row: usize,
        column: usize,
    ) -> Option<usize> {
        let resolution = self.resolution;
        let placed = self.block(block)?;
        if row >= resolution || column >= resolution {
            return None;
        }
        let canonical = placed.orientation.inverse();
        let center = canonical.point(face.texel_center(resolution, row, column));
        let face = canonical.face(face);
        let offset = placed.shape.wall_offset(face, resolution)?;
        Some(offset + face.texel_index(center, resolution))
    }
}
