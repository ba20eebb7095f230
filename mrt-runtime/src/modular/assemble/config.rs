//! Settings of assembly.

use mrt_core::storage::Storage;

/// Settings of [`Scene::assemble`](crate::modular::scene::Scene::assemble).
#[derive(Clone, Debug, PartialEq)]
pub struct AssembleConfig {
    /// How light is carried from block to block.
    pub coupling: Coupling,
    /// Most openings that light crosses, `d_max`. Blocks further from a source get none of its light in one bounce.
    pub max_depth: usize,
    /// Most bytes of texels and `T_b->r` together.
    pub max_bytes: usize,
    /// Number format of the operators of shapes. There are few of them, so `f32`, the fastest format, takes little
    /// memory.
    pub shape_storage: Storage,
    /// Number format of `T_b->r`, the largest part of a large level. With `f16`, the error of light is 0.02 %.
    pub transport_storage: Storage,
    /// Share in L2, in [0, 1), of the light from one block to another that may be left out to save work.
    ///
    /// `None` chooses by the number of modes `k` of the source block, since few modes have a larger error anyway: 2 %
    /// from 32 modes on, `0.02 (32 / k)²` below, 15 % at most. Measured with four lights in a maze of 41 blocks: a
    /// standard dictionary saves three tenths of the products, with an error of 0.16 % beside the 2 % of its modes. A
    /// mobile dictionary saves half of the products, and its mean error over six levels is 6.68 % instead of 6.64 %.
    pub negligible: Option<f32>,
}

/// How light is carried from block to block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Coupling {
    /// By the dictionary's table, which has an operator for each whole path of openings, and by lightfields beyond its
    /// longest paths. If the dictionary was baked without paths, as dictionaries of tubes are, by lightfields only.
    #[default]
    Table,
    /// By lightfields passed on from opening to opening, as in the paper.
    Lightfield,
}

/// Largest [`AssembleConfig::max_depth`]. Without a limit, light would be followed around rings of blocks for ever.
pub const MAX_DEPTH: usize = 64;

impl Default for AssembleConfig {
    /// Eight openings, 2 GiB, `f32` for shapes and `f16` for transport. Less than 0.1 % of one-bounce light arrives
    /// beyond eight openings.
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
