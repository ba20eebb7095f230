//! The input of propagation, whichever way light is followed.

use crate::modular::assemble::config::AssembleConfig;
use crate::modular::dictionary::{Dictionary, OperatorMatrix, ShapeOperators};
use crate::modular::propagate::transit::Transits;
use crate::modular::scene::SceneData;

/// A scene whose light is followed, and the operators that carry it.
pub(crate) struct PropagationContext<'a, M> {
    /// Blocks and openings. Its transport is still empty.
    pub scene: &'a SceneData,
    /// Operators of paths and lightfields.
    pub dictionary: &'a Dictionary<M>,
    /// Operators by [`SceneBlock::shape_index`](crate::modular::scene::SceneBlock::shape_index).
    pub used_shapes: &'a [&'a ShapeOperators<M>],
    /// How far light is followed, and by which of the operators.
    pub config: &'a AssembleConfig,
    /// Factors of light that passes through warped blocks.
    pub transits: Transits,
}

impl<'a, M: OperatorMatrix> PropagationContext<'a, M> {
    /// Computes the transits of warped blocks.
    pub(crate) fn new(
        scene: &'a SceneData,
        dictionary: &'a Dictionary<M>,
        used_shapes: &'a [&'a ShapeOperators<M>],
        config: &'a AssembleConfig,
    ) -> Self {
        Self {
            scene,
            dictionary,
            used_shapes,
            config,
            transits: Transits::new(scene, dictionary, used_shapes),
        }
    }

    /// Operators of a block of the scene.
    pub(super) fn operators(&self, block: usize) -> &'a ShapeOperators<M> {
        self.used_shapes[self.scene.blocks[block].shape_index]
    }
}
