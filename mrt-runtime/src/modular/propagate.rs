//! Carries each block's light through openings to all others: `T_b->r` (Loos et al. 2011,
//! section 6.3).
//!
//! A straight ray through a grid uses at most one of each pair of opposite headings, so a sequence of
//! openings that turns back carries nothing and is left out; the paper follows all sequences. Either the
//! dictionary's table has the operator of a whole sequence ([`table`]), or lightfields are passed on from opening
//! to opening as in the paper ([`lightfield`]); sequences longer than the table's take the second way, if the
//! dictionary has lightfields. Both give responses at the openings that light enters through, and those are projected
//! on the joint basis of the block behind, where the paper keeps a basis for each opening.

mod lightfield;
mod table;
mod transit;

pub(crate) use table::used_paths;

use crate::level::shape::Aperture;
use crate::modular::assemble::{AssembleConfig, AssembleError, Coupling};
use crate::modular::dictionary::{Dictionary, OperatorMatrix, ShapeOperators};
use crate::modular::opening_responses::OpeningResponses;
use crate::modular::packed::{PackedTransport, TransportPacker};
use crate::modular::path::{Roll, hole_of};
use crate::modular::scene::Scene;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::{Matrix, multiply, multiply_add};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use transit::Transits;

/// Responses of one source, summed by where they enter.
type Arrivals = BTreeMap<ArrivalKey, Matrix<f32>>;

/// Where and how light enters a block.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct ArrivalKey {
    /// Doors on the way, ascending.
    doors: Vec<u32>,
    block: usize,
    /// The canonical face entered.
    face: Face,
    /// True if the response's frame has x and y exchanged.
    exchanged: bool,
}

/// Assembles the operator from all blocks' coefficients b to all blocks' joint coefficients.
pub(crate) fn joint_from_coefficients<M: OperatorMatrix>(
    scene: &Scene,
    dictionary: &Dictionary<M>,
    used_shapes: &[&ShapeOperators<M>],
    config: &AssembleConfig,
    max_bytes: usize,
) -> Result<PackedTransport, AssembleError> {
    let layout = &scene.layout;
    let mut packer = TransportPacker::new(
        &scene.shapes,
        layout,
        config.transport_storage,
        config.negligible,
    );
    follow_all(
        scene,
        dictionary,
        used_shapes,
        config,
        |source, arrivals| {
            for (doors, block, joint) in project(scene, used_shapes, arrivals) {
                let place = |block: usize| layout.rank[block] as usize;
                packer.add(&doors, place(block), place(source), &joint);
                let bytes = packer.bytes();
                if bytes > max_bytes {
                    return Err(AssembleError::TooLarge {
                        expected: config.max_bytes,
                        found: config.max_bytes - max_bytes + bytes,
                    });
                }
            }
            Ok(())
        },
    )?;
    Ok(packer.finish())
}

/// Gives `visit` each block with what its light becomes at the openings that it enters others by.
fn follow_all<M: OperatorMatrix>(
    scene: &Scene,
    dictionary: &Dictionary<M>,
    used_shapes: &[&ShapeOperators<M>],
    config: &AssembleConfig,
    mut visit: impl FnMut(usize, Arrivals) -> Result<(), AssembleError>,
) -> Result<(), AssembleError> {
    let transits = Transits::new(scene, dictionary, used_shapes);
    let mut table = table::Table::new(scene, dictionary, used_shapes, &transits, config.max_depth);
    let covered = match config.coupling {
        Coupling::Table => dictionary.paths.depths(),
        Coupling::Lightfield => [0; 3],
    };
    let has_hole = |opening: &Aperture| hole_of(opening.outline).is_some();
    let openings = || scene.blocks.iter().flat_map(|block| block.shape.openings);
    // Numbers of holes that a path of the scene may have, for the table's depths.
    let holes = if openings().any(has_hole) { 3 } else { 1 };
    let goes_on = covered[..holes].iter().any(|&d| d < config.max_depth);
    // A dictionary that was packed without lightfields ends where its table does.
    let has_fields = !dictionary.lightfields.parity.is_empty();
    let fields = (goes_on && has_fields).then(|| dictionary.lightfields.decode());
    for source in 0..scene.blocks.len() {
        let mut arrivals = match config.coupling {
            Coupling::Table => table.follow(source)?,
            Coupling::Lightfield => Arrivals::new(),
        };
        if let Some(fields) = &fields {
            let depth = config.max_depth;
            let rest = lightfield::follow(
                scene,
                dictionary,
                fields,
                (used_shapes, &transits),
                source,
                depth,
                covered,
            );
            for (key, responses) in rest {
                add(&mut arrivals, key, responses);
            }
        }
        visit(source, arrivals)?;
    }
    Ok(())
}

/// [`Arrivals`] of all blocks, for [`responses_by_opening`](crate::modular::opening_responses::responses_by_opening).
pub(crate) fn responses_by_opening<M: OperatorMatrix>(
    scene: &Scene,
    dictionary: &Dictionary<M>,
    used_shapes: &[&ShapeOperators<M>],
    config: &AssembleConfig,
) -> Result<Vec<OpeningResponses>, AssembleError> {
    let mut all = Vec::new();
    follow_all(
        scene,
        dictionary,
        used_shapes,
        config,
        |source, arrivals| {
            for (key, responses) in arrivals {
                let mut openings = scene.blocks[key.block].shape.openings.iter();
                if let Some(opening) = openings.position(|o| o.face == key.face) {
                    all.push(OpeningResponses {
                        target: key.block,
                        opening,
                        exchanged: key.exchanged,
                        source,
                        responses,
                    });
                }
            }
            Ok(())
        },
    )?;
    Ok(all)
}

/// Adds responses to those that enter at the same place.
fn add(arrivals: &mut Arrivals, key: ArrivalKey, responses: Matrix<f32>) {
    match arrivals.entry(key) {
        Entry::Vacant(entry) => {
            entry.insert(responses);
        }
        Entry::Occupied(mut entry) => {
            let sum = entry.get_mut().data_mut();
            for (sum, x) in sum.iter_mut().zip(responses.data()) {
                *sum += x;
            }
        }
    }
}

/// Projects responses on the joint bases, and sums those of one block behind the same doors.
fn project(
    scene: &Scene,
    used_shapes: &[&ShapeOperators<impl OperatorMatrix>],
    arrivals: Arrivals,
) -> Vec<(Vec<u32>, usize, Matrix<f32>)> {
    let mut sums: Vec<(Vec<u32>, usize, Matrix<f32>)> = Vec::new();
    for (key, responses) in arrivals {
        let placed = &scene.blocks[key.block];
        let entry = used_shapes[placed.shape_index];
        let opening = placed
            .shape
            .openings
            .iter()
            .position(|opening| opening.face == key.face);
        let Some(operator) = opening.and_then(|k| {
            entry.openings[k]
                .joint_from_response
                .get(usize::from(key.exchanged))
        }) else {
            // Assembly refuses rolled interfaces that the dictionary has no operators for.
            continue;
        };
        let operator = operator.decode();
        match sums.last_mut() {
            Some((doors, block, sum)) if *block == key.block && *doors == key.doors => {
                multiply_add(operator.view(), responses.view(), sum.data_mut());
            }
            _ => {
                let joint = multiply(operator.view(), responses.view());
                sums.push((key.doors, key.block, joint));
            }
        }
    }
    sums
}

/// Adds responses times a factor, brought to the frame without mirrors, to those that enter at the same place.
fn arrive(
    arrivals: &mut Arrivals,
    doors: &[u32],
    (block, face): (usize, Face),
    target_frame: CubeSymmetry,
    parity: &[u8],
    (responses, factor): (&Matrix<f32>, f32),
) {
    let roll = Roll::of(target_frame);
    let key = ArrivalKey {
        doors: doors.to_vec(),
        block,
        face,
        exchanged: roll.exchanged,
    };
    let sum = arrivals
        .entry(key)
        .or_insert_with(|| Matrix::zeros(responses.rows(), responses.columns()));
    let rows = responses.rows().max(1);
    for (to, from) in sum
        .data_mut()
        .chunks_exact_mut(rows)
        .zip(responses.data().chunks_exact(rows))
    {
        for ((to, &from), &parity) in to.iter_mut().zip(from).zip(parity) {
            *to += factor * roll.sign(parity) * from;
        }
    }
}

/// Doors on the way, with one more if there is one.
fn with_door(doors: &[u32], door: Option<u32>) -> Vec<u32> {
    let mut doors = doors.to_vec();
    if let Some(door) = door
        && let Err(at) = doors.binary_search(&door)
    {
        doors.insert(at, door);
    }
    doors
}

/// `first`, then `second`, both maps of directions.
fn compose(second: CubeRotation, first: CubeRotation) -> CubeRotation {
    let image = |face: Face| second.face(first.face(face));
    CubeRotation::from_images(image(Face::PosX), image(Face::PosY)).unwrap_or(first)
}
