//! Albedo and emission of walls, which a game may change while it runs.

use crate::level::block_index::BlockIndex;
use crate::light::limits::MAX_LIGHT_VALUE;
use crate::modular::scene::SceneData;
use crate::output::texel_layout::{BlockRank, Planes};
use glam::Vec3;
use mrt_core::geometry::cube::Face;

/// Colours of the texels of a level, by slot. Slots without a texel and texels in holes are black.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Linear RGB albedo.
    pub albedo: Planes,
    /// By rank: the albedo of the block's texels, if it is the same for all.
    pub uniform: Vec<Option<Vec3>>,
    /// Radiosity that texels emit, linear RGB, W/m².
    pub emission: Planes,
}

/// Why the surface of a block was not changed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// There is no such block.
    #[error("block {found}; expected an index below {expected}")]
    Block {
        /// Number of blocks.
        expected: usize,
        /// The index given.
        found: BlockIndex,
    },
    /// The number of values is not the number of texels.
    #[error("block {block}: {found} values of {what}; expected {expected}, one a texel")]
    Length {
        /// Which block.
        block: BlockIndex,
        /// Property that was to be set.
        what: &'static str,
        /// Number of texels of the block.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// A value is negative, too large or NaN.
    #[error(
        "block {block}, texel {texel}: {what} {found}; expected three values in [0, {largest:e}]"
    )]
    Value {
        /// Which block.
        block: BlockIndex,
        /// Which texel of the block.
        texel: usize,
        /// Property that was to be set.
        what: &'static str,
        /// Largest value accepted.
        largest: f32,
        /// The value given.
        found: Vec3,
    },
}

impl Surface {
    /// The colours that the level gives its faces; and, by rank, whether each block emits.
    pub(super) fn new(scene: &SceneData) -> (Self, Vec<bool>) {
        let layout = &scene.layout;
        let mut surface = Self {
            albedo: Planes::new(layout.slot_count()),
            uniform: vec![None; layout.block_count()],
            emission: Planes::new(layout.slot_count()),
        };
        let mut emits = vec![false; layout.block_count()];
        for rank in layout.ranks() {
            let placed = &scene.level.blocks[layout.order[rank.get()].get()];
            for (slot, _, face) in wall_slots(scene, rank) {
                let emission = placed.emission[face.index()];
                surface.albedo.set(slot, placed.albedo[face.index()]);
                surface.emission.set(slot, emission);
                emits[rank.get()] |= emission != Vec3::ZERO;
            }
            surface.find_uniform(scene, rank);
        }
        (surface, emits)
    }

    /// Gives each texel of a block an albedo of its own.
    pub(super) fn set_albedo(
        &mut self,
        scene: &SceneData,
        block: BlockIndex,
        albedo: &[Vec3],
    ) -> Result<BlockRank, SurfaceError> {
        check(scene, block, albedo, Allowed::ALBEDO)?;
        let rank = write(scene, block, albedo, &mut self.albedo);
        self.find_uniform(scene, rank);
        Ok(rank)
    }

    /// Gives each texel of a block an emission of its own.
    pub(super) fn set_emission(
        &mut self,
        scene: &SceneData,
        block: BlockIndex,
        emission: &[Vec3],
    ) -> Result<BlockRank, SurfaceError> {
        check(scene, block, emission, Allowed::EMISSION)?;
        Ok(write(scene, block, emission, &mut self.emission))
    }

    fn find_uniform(&mut self, scene: &SceneData, rank: BlockRank) {
        let layout = &scene.layout;
        let texels = &layout.texel_of_slot[layout.shape(rank)];
        self.uniform[rank.get()] = self.albedo.uniform(layout.slots(rank), texels);
    }
}

/// Writes colours of the texels that are not in holes; the caller has checked the block and the number of values.
fn write(scene: &SceneData, block: BlockIndex, values: &[Vec3], plane: &mut Planes) -> BlockRank {
    let rank = scene.layout.rank[block.get()];
    for (slot, texel, _) in wall_slots(scene, rank) {
        plane.set(slot, values[texel]);
    }
    rank
}

/// Slots of a block whose texel is on a wall, with the texel and its face. A texel on the plane of a mirror has several
/// slots. Texels in holes are left out: they neither reflect nor emit.
fn wall_slots(
    scene: &SceneData,
    rank: BlockRank,
) -> impl Iterator<Item = (usize, usize, Face)> + '_ {
    let layout = &scene.layout;
    let shape = scene.level.blocks[layout.order[rank.get()].get()].shape;
    let resolution = scene.level.resolution;
    let slots = layout.slots(rank);
    let with_texels = slots.zip(&layout.texel_of_slot[layout.shape(rank)]);
    with_texels.filter_map(move |(slot, &texel)| {
        let texel = texel as usize;
        let (wall, place) = (texel / resolution.pow(2), texel % resolution.pow(2));
        let face = shape.walls().nth(wall)?;
        // Only cubes have holes, so the centre is that of a flat wall.
        let center = face.texel_center(resolution, place / resolution, place % resolution);
        (!shape.is_in_hole(face, center)).then_some((slot, texel, face))
    })
}

/// A property of texels, each channel of which is in [0, `largest`].
#[derive(Clone, Copy)]
struct Allowed {
    what: &'static str,
    largest: f32,
}

impl Allowed {
    const ALBEDO: Self = Self {
        what: "albedo",
        largest: 1.0,
    };
    const EMISSION: Self = Self {
        what: "emission",
        largest: MAX_LIGHT_VALUE,
    };
}

/// Checks that a block exists, and that it can have these values.
fn check(
    scene: &SceneData,
    block: BlockIndex,
    values: &[Vec3],
    Allowed { what, largest }: Allowed,
) -> Result<(), SurfaceError> {
    let placed = scene.level.block(block).ok_or(SurfaceError::Block {
        found: block,
        expected: scene.level.blocks.len(),
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
