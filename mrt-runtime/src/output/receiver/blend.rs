//! The receivers that one point of a surface shares its light out to.

use crate::level::block_index::BlockIndex;
use crate::output::receiver::wall_receiver::WallReceiver;
use mrt_core::geometry::cube::Face;

/// Blocks that one point takes light from, at most.
pub(super) const MAX_BLOCKS_BLENDED: usize = 4;

/// A receiver and its share of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedReceiver {
    /// Where the light is read.
    pub receiver: WallReceiver,
    /// What it is multiplied by, above 0 and at most 1.
    pub weight: f64,
}

/// Receivers of one point of a surface, with weights.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    parts: [WeightedReceiver; 6 * MAX_BLOCKS_BLENDED],
    count: usize,
}

impl Blend {
    /// No receiver.
    pub(super) const EMPTY: Blend = Blend {
        parts: [WeightedReceiver {
            receiver: WallReceiver {
                block: BlockIndex::new(0),
                face: Face::NegX,
                u: 0.0,
                v: 0.0,
            },
            weight: 0.0,
        }; 6 * MAX_BLOCKS_BLENDED],
        count: 0,
    };

    /// The receivers; at most 24.
    pub fn parts(&self) -> &[WeightedReceiver] {
        &self.parts[..self.count]
    }

    /// Sum of all weights, in [0, 1]; less than 1 where light of the level does not fully reach the surface.
    pub fn total_weight(&self) -> f64 {
        self.parts().iter().map(|part| part.weight).sum()
    }

    /// Adds a receiver, unless its weight is 0.
    pub(super) fn add(&mut self, receiver: WallReceiver, weight: f64) {
        if weight > 0.0
            && let Some(part) = self.parts.get_mut(self.count)
        {
            *part = WeightedReceiver { receiver, weight };
            self.count += 1;
        }
    }
}
