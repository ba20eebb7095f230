//! What walls reflect and emit, which a game may change while it runs.

use crate::level::block_index::BlockIndex;
use crate::light::limits::MAX_LIGHT_VALUE;
use crate::modular::scene::SceneData;
use crate::output::texel_layout::{BlockRank, Planes};
use glam::Vec3;
use mrt_core::geometry::cube::Face;

/// Colours of the texels of a level, by slot. Slots without a texel, and texels in holes, have none.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Linear RGB albedo.
    pub albedo: Planes,
    /// By rank: the albedo of all texels of a block, if they have the same.
    pub uniform: Vec<Option<Vec3>>,
    /// Radiosity that texels emit of themselves, linear RGB, W/m².
    pub emission: Planes,
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
        found: BlockIndex,
    },
    /// The number of values is not the number of texels.
    #[error("block {block}: {found} values of {what}; expected {expected}, one a texel")]
    Length {
        /// Which block.
        block: BlockIndex,
        /// What was to be set.
        what: &'static str,
        /// Texels of the block.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value is negative, too large or NaN.
    #[error(
        "block {block}, texel {texel}: {what} {found}; expected three values in [0, {largest:e}]"
    )]
    Value {
        /// Which block.
        block: BlockIndex,
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

impl Surface {
    /// The colours that the level gives its faces, and by rank whether a block emits.
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
        check(scene, block, albedo, ("albedo", 1.0))?;
        let rank = write(scene, block, albedo, &mut self.albedo);
        self.find_uniform(scene, rank);
        Ok(rank)
    }

    /// Lets each texel of a block emit radiosity of its own.
    pub(super) fn set_emission(
        &mut self,
        scene: &SceneData,
        block: BlockIndex,
        emission: &[Vec3],
    ) -> Result<BlockRank, SurfaceError> {
        check(scene, block, emission, ("emission", MAX_LIGHT_VALUE))?;
        Ok(write(scene, block, emission, &mut self.emission))
    }

    fn find_uniform(&mut self, scene: &SceneData, rank: BlockRank) {
        let layout = &scene.layout;
        let texels = &layout.texel_of_slot[layout.shape(rank)];
        self.uniform[rank.get()] = self.albedo.uniform(layout.slots(rank), texels);
    }
}

/// Writes colours of the texels that are not in holes; the block and the number of values have been checked.
fn write(scene: &SceneData, block: BlockIndex, values: &[Vec3], plane: &mut Planes) -> BlockRank {
    let rank = scene.layout.rank[block.get()];
    for (slot, texel, _) in wall_slots(scene, rank) {
        plane.set(slot, values[texel]);
    }
    rank
}

/// Slots of a block that show a wall, with the texel and its face. A texel that lies on a mirror has several slots; what is
/// in a hole neither reflects nor emits.
fn wall_slots(
    scene: &SceneData,
    rank: BlockRank,
) -> impl Iterator<Item = (usize, usize, Face)> + '_ {
    let layout = &scene.layout;
    let shape = scene.level.blocks[layout.order[rank.get()].get()].shape;
    let texels: Vec<_> = shape.texels(scene.level.resolution).collect();
    let slots = layout.slots(rank);
    let with_texels = slots.zip(&layout.texel_of_slot[layout.shape(rank)]);
    with_texels.filter_map(move |(slot, &texel)| {
        let &(face, center) = texels.get(texel as usize)?;
        (!shape.is_in_hole(face, center)).then_some((slot, texel as usize, face))
    })
}

/// Checks values named `what`, each channel of which is to be in [0, `largest`].
fn check(
    scene: &SceneData,
    block: BlockIndex,
    values: &[Vec3],
    (what, largest): (&'static str, f32),
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
