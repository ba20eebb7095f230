//! Settings of assembly.

use mrt_core::storage::Storage;

/// Settings of [`Scene::assemble`](crate::modular::scene::Scene::assemble).
#[derive(Clone, Debug, PartialEq)]
pub struct AssembleConfig {
    /// How light is taken from block to block.
    pub coupling: Coupling,
    /// Openings that light may cross, at most: `d_max`. Further blocks read 0 from the source.
    pub max_depth: usize,
    /// Bytes that texels and `T_b->r` may take together.
    pub max_bytes: usize,
    /// How shapes' operators are kept. They are few, so `f32`, the fastest, costs little.
    pub shape_storage: Storage,
    /// How `T_b->r` is kept, the largest part of a large level. `f16` errs by 0.02 %.
    pub transport_storage: Storage,
    /// Share in L2, in [0, 1), of the light from one block to another that may be left out where that saves work.
    ///
    /// `None` goes by the number of modes `k` of the block that light comes from, since few modes err by more: 2 % from 32
    /// modes on, `0.02 (32 / k)²` below, 15 % at most. With four lights in a maze of 41 blocks that saves three tenths of
    /// the products of a standard dictionary and errs by 0.16 %, where its modes err by 2 %; of a mobile one it saves
    /// half, and the mean error of six levels is 6.68 % instead of 6.64.
    pub negligible: Option<f32>,
}

/// How light is taken from block to block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Coupling {
    /// By the dictionary's operator of each whole path of openings, and by lightfields beyond the longest of them; by
    /// lightfields alone where the dictionary was baked without paths, as that of tubes.
    #[default]
    Table,
    /// By lightfields passed on from opening to opening, as in the paper.
    Lightfield,
}

/// Largest [`AssembleConfig::max_depth`]: rings of blocks would be followed for ever.
pub const MAX_DEPTH: usize = 64;

impl Default for AssembleConfig {
    /// Eight openings and 2 GiB: of what one-bounce light crosses that many, under 0.1 % arrives.
    fn default() -> Self {
        Self {
            coupling: Coupling::default(),
            max_depth: 8,
            max_bytes: 2 << 30,
            shape_storage: Storage::F32,
            transport_storage: Storage::F16,
            negligible: None,
        }
    }
}
