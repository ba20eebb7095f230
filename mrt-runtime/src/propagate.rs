//! Carries each block's light through openings to all others: `T_b->r` (Loos et al. 2011,
//! section 6.3).
//!
//! A straight ray through a grid uses at most one of each pair of opposite headings, so a sequence of
//! openings that turns back carries nothing and is left out; the paper follows all sequences breadth
//! first. Sequences that reach an opening with the same set of headings behind them are summed before they
//! go on, since open rooms have binomially many.

use crate::assemble::{AssembleConfig, AssembleError, entering_frame};
use crate::dictionary::Dictionary;
use crate::scene::{Beyond, Scene, SceneBlock};
use mrt_core::block_sparse::BlockSparse;
use mrt_core::cube::{CubeRotation, Face};
use mrt_core::matrix::{Matrix, multiply};
use std::collections::BTreeMap;

/// Light of one source block about to enter a block.
struct Wave {
    /// Takes the entered block's canonical directions to the source's.
    source_from_here: CubeRotation,
    /// Lightfield modes x source modes.
    lightfield: Matrix<f32>,
}

/// Which waves are summed: (block entered, its canonical face, headings used so far as bits of
/// [`Face::index`] in the source's frame, image of +x in that frame).
type WaveKey = (usize, Face, u8, Face);

/// Assembles the operator from all blocks' coefficients to all interfaces' responses.
pub(crate) fn response_from_coefficients(
    scene: &Scene,
    dictionary: &Dictionary,
    used_shapes: &[usize],
    config: &AssembleConfig,
    max_bytes: usize,
) -> Result<BlockSparse<f32>, AssembleError> {
    let mut interface_index = BTreeMap::new();
    let mut row_sizes = Vec::new();
    for (block, placed) in scene.blocks.iter().enumerate() {
        for interface in &placed.interfaces {
            let face = placed.shape.openings[interface.opening];
            interface_index.insert((block, face), row_sizes.len());
            row_sizes.push(interface.responses.len());
        }
    }
    let column_sizes: Vec<usize> = scene.blocks.iter().map(|b| b.coefficients.len()).collect();
    let response = &dictionary.interface.response_from_lightfield;
    let mut blocks = Vec::new();
    let mut bytes = 0;
    for (source, placed) in scene.blocks.iter().enumerate() {
        let emission = &dictionary.shapes[used_shapes[placed.shape_index]];
        let arrived = follow(
            scene,
            dictionary,
            placed,
            &emission.lightfield_from_coefficients,
            config.max_depth,
        );
        for (entered, lightfield) in arrived {
            let row = interface_index[&entered];
            let block = multiply(response.view(), lightfield.view());
            bytes += std::mem::size_of_val(block.data());
            if bytes > max_bytes {
                return Err(AssembleError::TooLarge {
                    expected: config.max_bytes,
                    found: config.max_bytes - max_bytes + bytes,
                });
            }
            blocks.push((row, source, block));
        }
    }
    Ok(BlockSparse::from_blocks(&row_sizes, &column_sizes, blocks))
}

/// The sum of all light of `source` that enters each (block, face).
fn follow(
    scene: &Scene,
    dictionary: &Dictionary,
    source: &SceneBlock,
    emission: &[Matrix<f32>],
    max_depth: usize,
) -> BTreeMap<(usize, Face), Matrix<f32>> {
    let mut front: BTreeMap<WaveKey, Wave> = BTreeMap::new();
    for (&face, lightfield) in source.shape.openings.iter().zip(emission) {
        let sent = Wave {
            source_from_here: CubeRotation::IDENTITY,
            lightfield: lightfield.clone(),
        };
        cross(&mut front, source, face, 0, sent);
    }
    let mut arrived: BTreeMap<(usize, Face), Matrix<f32>> = BTreeMap::new();
    for depth in 1..=max_depth {
        if front.is_empty() {
            break;
        }
        let mut next = BTreeMap::new();
        for ((block, face, headings, _), wave) in front {
            let here = &scene.blocks[block];
            for &exit in here.shape.openings.iter().filter(|&&exit| exit != face) {
                let heading = wave.source_from_here.face(exit);
                let turns_back = headings >> heading.opposite().index() & 1 == 1;
                let leads_on = matches!(here.beyond[exit.index()], Beyond::Block { .. });
                if depth == max_depth || turns_back || !leads_on {
                    continue;
                }
                let through = match entering_frame(face).inverse().face(exit) {
                    Face::PosZ => &dictionary.interface.straight,
                    Face::PosX => &dictionary.interface.left,
                    Face::NegX => &dictionary.interface.right,
                    // Assembly refuses interfaces whose up directions differ, and no shape opens
                    // upwards or downwards.
                    _ => continue,
                };
                let sent = Wave {
                    source_from_here: wave.source_from_here,
                    lightfield: multiply(through.view(), wave.lightfield.view()),
                };
                cross(&mut next, here, exit, headings, sent);
            }
            add(&mut arrived, (block, face), wave.lightfield);
        }
        front = next;
    }
    arrived
}

/// Passes a wave through a face of `here` into the block beyond, if there is one.
fn cross(
    front: &mut BTreeMap<WaveKey, Wave>,
    here: &SceneBlock,
    face: Face,
    headings: u8,
    wave: Wave,
) {
    let Beyond::Block {
        block,
        face: entered,
        here_from_there,
    } = here.beyond[face.index()]
    else {
        return;
    };
    let heading = wave.source_from_here.face(face);
    let turn = |direction: Face| wave.source_from_here.face(here_from_there.face(direction));
    let Some(source_from_here) = CubeRotation::from_images(turn(Face::PosX), turn(Face::PosY))
    else {
        return;
    };
    let headings = headings | 1 << heading.index();
    let key = (block, entered, headings, turn(Face::PosX));
    match front.get_mut(&key) {
        Some(there) => add_into(&mut there.lightfield, &wave.lightfield),
        None => {
            let there = Wave {
                source_from_here,
                lightfield: wave.lightfield,
            };
            front.insert(key, there);
        }
    }
}

fn add(
    sums: &mut BTreeMap<(usize, Face), Matrix<f32>>,
    key: (usize, Face),
    lightfield: Matrix<f32>,
) {
    match sums.get_mut(&key) {
        Some(sum) => add_into(sum, &lightfield),
        None => {
            sums.insert(key, lightfield);
        }
    }
}

fn add_into(sum: &mut Matrix<f32>, term: &Matrix<f32>) {
    for (s, &t) in sum.data_mut().iter_mut().zip(term.data()) {
        *s += t;
    }
}
