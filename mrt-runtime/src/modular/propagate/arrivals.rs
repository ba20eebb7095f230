//! The light of one block where it enters other blocks.

use crate::level::block_index::BlockIndex;
use crate::modular::path::Roll;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::Matrix;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Responses to the light of one source, summed for each way of entering a block.
pub(crate) type Arrivals = BTreeMap<ArrivalKey, Matrix<f32>>;

/// Where and how light enters a block.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ArrivalKey {
    /// Doors on the way, ascending.
    pub doors: Vec<u32>,
    /// The block that light enters.
    pub block: BlockIndex,
    /// The canonical face that light enters by.
    pub face: Face,
    /// True if the response's frame has x and y exchanged.
    pub exchanged: bool,
}

/// Adds responses to those with the same key.
pub(super) fn add(arrivals: &mut Arrivals, key: ArrivalKey, responses: Matrix<f32>) {
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

/// Responses that enter a block, in the frame of their path.
pub(super) struct Arriving<'a> {
    /// Doors on the way, ascending.
    pub doors: &'a [u32],
    /// The block that light enters.
    pub block: BlockIndex,
    /// The canonical face that light enters by.
    pub face: Face,
    /// The frame of the responses in the canonical cube of that block.
    pub frame: CubeSymmetry,
    /// Parity of each response mode: bit 0 set if odd in x, bit 1 if odd in y.
    pub parity: &'a [u8],
    /// Response modes x coefficients b of the source.
    pub responses: &'a Matrix<f32>,
    /// A factor that multiplies the responses.
    pub factor: f32,
}

/// Brings responses to the frame without mirrors, and adds them to those that enter a block the same way.
pub(super) fn arrive(arrivals: &mut Arrivals, arriving: Arriving<'_>) {
    let roll = Roll::of(arriving.frame);
    let key = ArrivalKey {
        doors: arriving.doors.to_vec(),
        block: arriving.block,
        face: arriving.face,
        exchanged: roll.exchanged,
    };
    let responses = arriving.responses;
    let sum = arrivals
        .entry(key)
        .or_insert_with(|| Matrix::zeros(responses.rows(), responses.columns()));
    let rows = responses.rows().max(1);
    let columns = sum.data_mut().chunks_exact_mut(rows);
    for (to, from) in columns.zip(responses.data().chunks_exact(rows)) {
        for ((to, &from), &parity) in to.iter_mut().zip(from).zip(arriving.parity) {
            *to += arriving.factor * roll.sign(parity) * from;
        }
    }
}

/// A list of doors, ascending, with `door` added if it is new.
pub(super) fn with_door(doors: &[u32], door: Option<u32>) -> Vec<u32> {
    let mut doors = doors.to_vec();
    if let Some(door) = door
        && let Err(at) = doors.binary_search(&door)
    {
        doors.insert(at, door);
    }
    doors
}

/// The rotation that applies `first`, then `second`.
pub(super) fn compose(second: CubeRotation, first: CubeRotation) -> CubeRotation {
    let image = |face: Face| second.face(first.face(face));
    CubeRotation::from_images(image(Face::PosX), image(Face::PosY)).unwrap_or(first)
}
