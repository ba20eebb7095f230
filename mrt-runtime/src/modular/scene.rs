//! What the frame reads: a level joined with a dictionary, packed and immutable.

use crate::level::shape::{Aperture, Shape};
use crate::level::wall::UnitFromWorld;
use crate::light::placed::MAX_LIGHT_VALUE;
use crate::modular::packed::{PackedShape, PackedTransport};
use crate::output::lightmap_atlas::AtlasLayout;
use glam::{DMat3, DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::simd::Aligned;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A level ready for frames. Made by [`assemble`](crate::modular::assemble::assemble).
///
/// Everything inside a block is in its canonical frame: faces, texels and warps already contain the
/// orientation.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// In the order of the level's blocks.
    pub blocks: Vec<SceneBlock>,
    /// Operators of each shape that the level uses, as kernels read them.
    pub shapes: Vec<PackedShape>,
    /// Where everything about the blocks is kept in a frame.
    pub layout: Arc<Layout>,
    /// Positions, normals and colours of texels, by slot.
    pub surface: Surface,
    /// `T_b->r`: from the coefficients b of all blocks to the joint coefficients of all blocks.
    pub transport: PackedTransport,
    /// Doors in the order of the level's, with the value that each has at first.
    pub doors: Vec<f32>,
    /// Probes along an edge of a block; 0 if the dictionary has none.
    pub probes: usize,
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
    /// The way back.
    pub unit_from_world: UnitFromWorld,
    /// What lies beyond each canonical face.
    pub beyond: [Beyond; 6],
    /// Its part of the scene's texels.
    pub texels: Range<usize>,
    /// Its part of the coefficients b.
    pub coefficients: Range<usize>,
    /// Its part of the joint coefficients; the first of them take its own coefficients b.
    pub joint: Range<usize>,
    /// Takes the axes of the block's probes to the world's: an orthogonal matrix.
    pub world_from_probe: DMat3,
    /// Index into [`Scene::doors`] of the door in each canonical face.
    pub doors: [Option<u32>; 6],
    /// All openings as loops in the world, in the order of the shape's list.
    pub portals: Vec<Portal>,
    /// Axis-aligned bounds (smallest, largest), metres.
    pub bounds: (DVec3, DVec3),
}

/// An opening's outline in the world.
#[derive(Clone, Debug)]
pub struct Portal {
    /// The canonical face.
    pub face: Face,
    /// Corners in a loop that runs clockwise seen from inside the block, metres: four, or those of a polygon
    /// around a disc.
    pub corners: Vec<DVec3>,
    /// Out of the block, at the first corner; not of unit length.
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

    /// Where a line passes the plane of the opening; the origin if it runs along it.
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
        /// Its index.
        block: usize,
        /// The canonical face of it that is joined to this one.
        face: Face,
        /// Takes directions of its canonical cube to directions of this block's.
        here_from_there: CubeRotation,
    },
}

/// Why the surface of a block was not changed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// No such block.
    #[error("block {found}; expected an index below {expected}")]
    Block {
        /// Number of blocks.
        expected: usize,
        /// The index given.
        found: usize,
    },
    /// Not one value a texel.
    #[error("block {block}: {found} values of {what}; expected {expected}, one a texel")]
    Length {
        /// Which block.
        block: usize,
        /// What was to be set.
        what: &'static str,
        /// Texels of the block.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value that is negative, too large or NaN.
    #[error(
        "block {block}, texel {texel}: {what} {found}; expected three values in [0, {largest:e}]"
    )]
    Value {
        /// Which block.
        block: usize,
        /// Which texel of it.
        texel: usize,
        /// What was to be set.
        what: &'static str,
        /// Largest accepted.
        largest: f32,
        /// The value given.
        found: Vec3,
    },
}

/// How frames keep what they know about blocks: those of one shape one after another, each texel in a slot
/// ([`Folding`](crate::modular::packed::Folding)), channels apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// The block of the level at each place.
    pub order: Vec<u32>,
    /// The place of each block of the level.
    pub rank: Vec<u32>,
    /// By place: its slots.
    pub slots: Vec<Range<usize>>,
    /// By place: index into [`Scene::shapes`].
    pub shapes: Vec<u32>,
    /// By shape: the slot of each texel, within the block.
    pub slot_of_texel: Vec<Vec<u32>>,
    /// Coefficients that there is place for in every block, a channel: those of the shape with the most
    /// [`rows`](crate::modular::packed::PackedShape::rows), and some more that are zero.
    pub rows: usize,
    /// By shape: the row of each coefficient b.
    pub row_of_mode: Vec<Vec<u16>>,
}

impl Layout {
    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.order.len()
    }

    /// Number of slots.
    pub fn slot_count(&self) -> usize {
        self.slots.last().map_or(0, |range| range.end)
    }

    /// Number of texels.
    pub fn texel_count(&self) -> usize {
        let texels = |&shape: &u32| self.slot_of_texel[shape as usize].len();
        self.shapes.iter().map(texels).sum()
    }

    /// A signal by slot in the level's order: block by block, channel by channel, in a channel texel by texel.
    pub(crate) fn by_texel(&self, signal: &Planes) -> Vec<f32> {
        let mut out = Vec::with_capacity(3 * self.texel_count());
        for &rank in &self.rank {
            let rank = rank as usize;
            let map = &self.slot_of_texel[self.shapes[rank] as usize];
            for channel in signal.block(self.slots[rank].clone()) {
                out.extend(map.iter().map(|&slot| channel[slot as usize]));
            }
        }
        out
    }
}

/// Three numbers a slot, channels apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    values: Aligned<f32>,
    slots: usize,
}

impl Planes {
    /// Zeros.
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            values: Aligned::zeroed(3 * slots),
            slots,
        }
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// All three channels.
    pub(crate) fn channels(&self) -> [&[f32]; 3] {
        self.block(0..self.slots)
    }

    /// The three channels of a block.
    pub fn block(&self, slots: Range<usize>) -> [&[f32]; 3] {
        std::array::from_fn(|c| &self.values[c * self.slots..(c + 1) * self.slots][slots.clone()])
    }

    /// Zeros everywhere.
    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// All three channels, to write.
    pub(crate) fn channels_mut(&mut self) -> [&mut [f32]; 3] {
        let (first, rest) = self.values.split_at_mut(self.slots);
        let (second, third) = rest.split_at_mut(self.slots);
        [first, second, third]
    }

    pub(crate) fn block_mut(&mut self, slots: Range<usize>) -> [&mut [f32]; 3] {
        self.channels_mut()
            .map(|channel| &mut channel[slots.clone()])
    }

    pub(crate) fn get(&self, slot: usize) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|c| self.values[c * self.slots + slot]))
    }

    /// The value of all slots that have a texel, if they have the same.
    pub(crate) fn uniform(&self, slots: Range<usize>, texel_of_slot: &[u32]) -> Option<Vec3> {
        let texels = slots
            .zip(texel_of_slot)
            .filter(|&(_, &texel)| texel != u32::MAX);
        let mut values = texels.map(|(slot, _)| self.get(slot));
        let first = values.next()?;
        values.all(|value| value == first).then_some(first)
    }

    pub(crate) fn set(&mut self, slot: usize, value: Vec3) {
        for (c, x) in value.to_array().into_iter().enumerate() {
            self.values[c * self.slots + slot] = x;
        }
    }
}

/// What a scene's texels are, by slot; [`Scene::set_texel_albedo`] and [`Scene::set_texel_emission`] change it.
///
/// Slots without a texel have no normal and no colour.
#[derive(Clone, Debug)]
pub struct Surface {
    /// World positions, metres.
    pub(crate) positions: Planes,
    /// Unit normals into the blocks.
    pub(crate) normals: Planes,
    /// Linear RGB albedo.
    pub(crate) albedo: Planes,
    /// By place: the albedo of all texels, where they have the same.
    pub(crate) uniform: Vec<Option<Vec3>>,
    /// Radiosity that texels emit of themselves, linear RGB, W/m².
    pub(crate) emission: Planes,
    /// Places of blocks some texel of which emits, ascending.
    pub(crate) emitting: Vec<u32>,
    /// Another for every scene and every change of one.
    pub(crate) revision: u64,
}

impl Surface {
    /// World positions, metres.
    pub fn positions(&self) -> &Planes {
        &self.positions
    }

    /// Unit normals into the blocks.
    pub fn normals(&self) -> &Planes {
        &self.normals
    }

    /// A number that no other scene, and no other state of this one, has.
    pub(crate) fn next_revision() -> u64 {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        NEXT.fetch_add(1, Ordering::Relaxed)
    }
}

impl SceneBlock {
    /// True unless a point of the block's cube is outside the round wall in it by more than `tolerance`, in block
    /// widths.
    fn is_inside_walls(&self, point: DVec3, tolerance: f64) -> bool {
        self.shape.tube().is_none()
            || self
                .shape
                .is_inside_walls(self.unit_from_world.point(point), tolerance)
    }
}

impl Scene {
    /// Gives each texel of a block an albedo of its own, linear RGB, in the order of the canonical shape's texels;
    /// texels in holes keep none. The next frame sees it.
    ///
    /// # Errors
    /// [`SurfaceError`], if there is no such block, not as many values as texels, or one outside [0, 1]; the scene
    /// is then as it was.
    pub fn set_texel_albedo(&mut self, block: usize, albedo: &[Vec3]) -> Result<(), SurfaceError> {
        self.check_surface(block, albedo, "albedo", 1.0)?;
        self.write_surface(block, albedo, |surface| &mut surface.albedo);
        let place = self.layout.rank[block] as usize;
        let texels = &self.shapes[self.blocks[block].shape_index]
            .folding
            .texel_of_slot;
        let slots = self.layout.slots[place].clone();
        self.surface.uniform[place] = self.surface.albedo.uniform(slots, texels);
        Ok(())
    }

    /// Lets each texel of a block emit radiosity of its own, linear RGB, W/m², in the same order.
    ///
    /// # Errors
    /// [`SurfaceError`], as for [`Scene::set_texel_albedo`], with values in [0, [`MAX_LIGHT_VALUE`]].
    pub fn set_texel_emission(
        &mut self,
        block: usize,
        emission: &[Vec3],
    ) -> Result<(), SurfaceError> {
        self.check_surface(block, emission, "emission", MAX_LIGHT_VALUE)?;
        self.write_surface(block, emission, |surface| &mut surface.emission);
        let rank = self.layout.rank[block];
        let emits = emission.iter().any(|e| *e != Vec3::ZERO);
        let emitting = &mut self.surface.emitting;
        match (emitting.binary_search(&rank), emits) {
            (Err(at), true) => emitting.insert(at, rank),
            (Ok(at), false) => {
                emitting.remove(at);
            }
            _ => {}
        }
        Ok(())
    }

    /// Writes colours of the texels that are not in holes.
    fn write_surface(
        &mut self,
        block: usize,
        values: &[Vec3],
        plane: impl Fn(&mut Surface) -> &mut Planes,
    ) {
        let shape = self.blocks[block].shape;
        let rank = self.layout.rank[block] as usize;
        let start = self.layout.slots[rank].start;
        let texels = &self.shapes[self.blocks[block].shape_index]
            .folding
            .texel_of_slot;
        let in_hole: Vec<bool> = shape
            .texels(self.resolution)
            .map(|(face, center)| shape.is_in_hole(face, center))
            .collect();
        for (slot, &texel) in texels.iter().enumerate() {
            let texel = texel as usize;
            if in_hole.get(texel) == Some(&false) {
                plane(&mut self.surface).set(start + slot, values[texel]);
            }
        }
        self.surface.revision = Surface::next_revision();
    }

    fn check_surface(
        &self,
        block: usize,
        values: &[Vec3],
        what: &'static str,
        largest: f32,
    ) -> Result<(), SurfaceError> {
        let placed = self.blocks.get(block).ok_or(SurfaceError::Block {
            found: block,
            expected: self.blocks.len(),
        })?;
        if values.len() != placed.texels.len() {
            return Err(SurfaceError::Length {
                block,
                what,
                expected: placed.texels.len(),
                found: values.len(),
            });
        }
        let is_legal = |value: &Vec3| value.to_array().iter().all(|x| (0.0..=largest).contains(x));
        match values.iter().position(|value| !is_legal(value)) {
            Some(texel) => Err(SurfaceError::Value {
                block,
                texel,
                what,
                largest,
                found: values[texel],
            }),
            None => Ok(()),
        }
    }

    /// True if every shape has vector irradiance.
    pub fn has_vector(&self) -> bool {
        self.blocks.iter().all(|block| {
            let rows = self.shapes[block.shape_index].vector.rows;
            rows == 4 * block.texels.len()
        })
    }

    /// Number of texels over all blocks.
    pub fn texel_count(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.texels.end)
    }

    /// The slot of a texel, counted over all blocks.
    ///
    /// # Panics
    /// If there is no such texel.
    pub fn slot(&self, texel: usize) -> usize {
        let block = self
            .blocks
            .partition_point(|block| block.texels.end <= texel);
        self.slot_in(block, texel - self.blocks[block].texels.start)
    }

    /// The slot of a texel of a block.
    pub(crate) fn slot_in(&self, block: usize, texel: usize) -> usize {
        let start = self.layout.slots[self.layout.rank[block] as usize].start;
        let map = &self.shapes[self.blocks[block].shape_index]
            .folding
            .slot_of_texel;
        start + map[texel] as usize
    }

    /// World position of a texel, counted over all blocks, metres.
    ///
    /// # Panics
    /// If there is no such texel; so do the three below.
    pub fn texel_position(&self, texel: usize) -> Vec3 {
        self.surface.positions.get(self.slot(texel))
    }

    /// Its unit normal into the block.
    pub fn texel_normal(&self, texel: usize) -> Vec3 {
        self.surface.normals.get(self.slot(texel))
    }

    /// Its linear RGB albedo.
    pub fn texel_albedo(&self, texel: usize) -> Vec3 {
        self.surface.albedo.get(self.slot(texel))
    }

    /// Radiosity that it emits of itself, linear RGB, W/m².
    pub fn texel_emission(&self, texel: usize) -> Vec3 {
        self.surface.emission.get(self.slot(texel))
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
                    && block.is_inside_walls(point, slack)
            })
        };
        containing(0.0).or_else(|| containing(tolerance))
    }

    /// The first block whose cube contains a point that is outside the round wall in it.
    pub(crate) fn tube_around(&self, point: DVec3) -> Option<usize> {
        let is_around =
            |block: &SceneBlock| block.shape.tube().is_some() && block.warp.contains(point, 0.0);
        self.blocks.iter().position(is_around)
    }

    /// Index within a block of the texel at (row, column) of a face *as the level names it*, after
    /// orientation; `None` for openings and texels that do not exist. Rows and columns of a tube are those of the
    /// flat face that its chart is named by.
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
        let of_shapes: usize = self.shapes.iter().map(PackedShape::bytes).sum();
        of_shapes + self.transport.bytes()
    }
}
