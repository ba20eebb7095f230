//! Carries the light of each block through openings to all other blocks: `T_b->r` (Loos et al. 2011, section 6.3).
//!
//! Departures from the paper:
//! 1. A straight ray through a grid uses at most one of each pair of opposite headings, so a sequence of openings that
//!    turns back carries no light. Such sequences are left out; the paper follows all.
//! 2. The dictionary's table has the operator of a whole sequence ([`table`]). Longer sequences pass lightfields on
//!    from opening to opening as in the paper ([`lightfield`]), if the dictionary has lightfields.
//! 3. Both give responses at the opening that light enters by. They are projected on the joint basis of the block
//!    behind it; the paper keeps a basis for each opening.

pub(crate) mod arrivals;
pub(crate) mod context;
mod lightfield;
pub(crate) mod table;
mod transit;

use crate::level::block_index::BlockIndex;
use crate::level::shape::Aperture;
use crate::modular::assemble::config::{AssembleConfig, Coupling};
use crate::modular::assemble::error::AssembleError;
use crate::modular::dictionary::{Dictionary, OperatorMatrix, ShapeOperators};
use crate::modular::packed::transport::{PackedTransport, TransportPacker};
use crate::modular::path::hole_of;
use crate::modular::propagate::arrivals::{Arrivals, add};
use crate::modular::propagate::context::PropagationContext;
use crate::modular::propagate::lightfield::LightfieldWalk;
use crate::modular::propagate::table::Table;
use crate::modular::scene::SceneData;
use mrt_core::linalg::matrix::{Matrix, multiply, multiply_add};

/// Assembles the operator from the coefficients b of all blocks to the joint coefficients of all blocks, which may take
/// up to `max_bytes`.
pub(crate) fn joint_from_coefficients<M: OperatorMatrix>(
    scene: &SceneData,
    dictionary: &Dictionary<M>,
    used_shapes: &[&ShapeOperators<M>],
    config: &AssembleConfig,
    max_bytes: usize,
) -> Result<PackedTransport, AssembleError> {
    let context = PropagationContext::new(scene, dictionary, used_shapes, config);
    let mut packer = TransportPacker::new(
        &scene.shapes,
        &scene.layout,
        scene.rows.per_block(),
        config.transport_storage,
        config.negligible,
    );
    let rank = |block: BlockIndex| scene.layout.rank[block.get()];
    follow_all(&context, |source, arrivals| {
        for sum in project(&context, arrivals) {
            packer.add(&sum.doors, rank(sum.target), rank(source), &sum.joint);
            let bytes = packer.bytes();
            if bytes > max_bytes {
                return Err(AssembleError::TooLarge {
                    expected: config.max_bytes,
                    found: config.max_bytes - max_bytes + bytes,
                });
            }
        }
        Ok(())
    })?;
    Ok(packer.finish())
}

/// Calls `visit` with each block, and with the responses to its light at the openings that it enters other blocks by.
pub(crate) fn follow_all<M: OperatorMatrix>(
    context: &PropagationContext<'_, M>,
    mut visit: impl FnMut(BlockIndex, Arrivals) -> Result<(), AssembleError>,
) -> Result<(), AssembleError> {
    let (dictionary, config) = (context.dictionary, context.config);
    let mut table = Table::new(context);
    let covered = match config.coupling {
        Coupling::Table => dictionary.paths.depths(),
        Coupling::Lightfield => [0; 3],
    };
    let blocks = &context.scene.level.blocks;
    let has_hole = |opening: &Aperture| hole_of(opening.outline).is_some();
    let mut openings = blocks.iter().flat_map(|block| block.shape.openings);
    // The table has a depth for paths without a hole, with one, and with more; only levels with holes need the last
    // two.
    let holes = if openings.any(has_hole) { 3 } else { 1 };
    let goes_on = covered[..holes].iter().any(|&d| d < config.max_depth);
    // With a dictionary that was packed without lightfields, light ends where the table does.
    let has_fields = !dictionary.lightfields.parity.is_empty();
    let fields = (goes_on && has_fields).then(|| dictionary.lightfields.decode());
    for source in (0..blocks.len()).map(BlockIndex::new) {
        let mut arrivals = match config.coupling {
            Coupling::Table => table.follow(source)?,
            Coupling::Lightfield => Arrivals::new(),
        };
        if let Some(fields) = &fields {
            let walk = LightfieldWalk {
                context,
                fields,
                covered,
            };
            for (key, responses) in walk.follow(source) {
                add(&mut arrivals, key, responses);
            }
        }
        visit(source, arrivals)?;
    }
    Ok(())
}

/// The light of one block in another, for all paths through the same doors.
struct JointArrival {
    /// Doors on the way, ascending.
    doors: Vec<u32>,
    target: BlockIndex,
    /// Joint modes of the target x coefficients b of the source.
    joint: Matrix<f32>,
}

/// Projects responses on joint bases, and sums those that enter the same block through the same doors.
fn project(
    context: &PropagationContext<'_, impl OperatorMatrix>,
    arrivals: Arrivals,
) -> Vec<JointArrival> {
    let mut sums: Vec<JointArrival> = Vec::new();
    for (key, responses) in arrivals {
        let target = key.block.get();
        let openings = context.scene.level.blocks[target].shape.openings;
        let opening = openings.iter().position(|opening| opening.face == key.face);
        let Some(operator) = opening.and_then(|k| {
            context.operators(target).openings[k]
                .joint_from_response
                .get(usize::from(key.exchanged))
        }) else {
            // Assembly refuses rolled interfaces that the dictionary has no operators for.
            continue;
        };
        let operator = operator.decode();
        match sums.last_mut() {
            Some(sum) if sum.target == key.block && sum.doors == key.doors => {
                multiply_add(operator.view(), responses.view(), sum.joint.data_mut());
            }
            _ => sums.push(JointArrival {
                doors: key.doors,
                target: key.block,
                joint: multiply(operator.view(), responses.view()),
            }),
        }
    }
    sums
}
