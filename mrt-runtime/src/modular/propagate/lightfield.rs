//! Transport by lightfields that are passed on from opening to opening, as in the paper (Loos et al. 2011, section
//! 6.3).
//!
//! Open rooms have binomially many sequences of openings. So sequences that reach an opening with the same set of
//! headings are summed before they go on.

use crate::level::block_index::BlockIndex;
use crate::level::placed::Beyond;
use crate::modular::dictionary::{LightfieldOperators, OperatorMatrix};
use crate::modular::path::{Roll, frame_of_heading, hole_of};
use crate::modular::propagate::arrivals::{Arrivals, Arriving, arrive, compose, with_door};
use crate::modular::propagate::context::PropagationContext;
use crate::modular::scene::SceneData;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::{Matrix, multiply};
use std::collections::BTreeMap;

/// Light of one source block that is about to enter another block.
struct Wave {
    /// Rotation from the canonical cube of the entered block to that of the source.
    source_from_here: CubeRotation,
    /// Lightfield modes x source modes, in `frame`.
    lightfield: Matrix<f32>,
}

/// Waves with the same key are summed.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct WaveKey {
    block: BlockIndex,
    entered: Face,
    /// Headings so far, as bits of [`Face::index`] in the source's frame.
    headings: u8,
    /// From the canonical interface to the source's directions. It has no mirrors, so that light of mirrored paths is
    /// summed.
    frame: CubeSymmetry,
    /// Directions of +x and +y of the entered block in the source's frame.
    turn: [Face; 2],
    /// Number of holes passed so far; 2 stands for two or more.
    holes: usize,
    doors: Vec<u32>,
}

type Front = BTreeMap<WaveKey, Wave>;

/// Follows light by lightfields, along the paths that the table does not have.
pub(super) struct LightfieldWalk<'a, M> {
    pub context: &'a PropagationContext<'a, M>,
    /// The dictionary's lightfields, decoded.
    pub fields: &'a LightfieldOperators,
    /// Openings of the longest paths in the table, by the number of holes on the way; 2 stands for two or more.
    pub covered: [usize; 3],
}

impl<M: OperatorMatrix> LightfieldWalk<'_, M> {
    /// The sum of all light of a block that enters other blocks.
    pub(super) fn follow(&self, source: BlockIndex) -> Arrivals {
        let mut front = self.emitted(source);
        let mut arrivals = Arrivals::new();
        let max_depth = self.context.config.max_depth;
        for depth in 1..=max_depth {
            let mut next = Front::new();
            for (key, wave) in front {
                if depth > self.covered[key.holes] {
                    self.enter(&mut arrivals, &key, &wave);
                }
                if depth < max_depth {
                    self.pass_on(&mut next, &key, &wave);
                }
            }
            front = next;
        }
        arrivals
    }

    /// The light that leaves the source through its own openings.
    fn emitted(&self, source: BlockIndex) -> Front {
        let (scene, fields) = (self.context.scene, self.fields);
        let openings = scene.level.blocks[source.get()].shape.openings;
        let emission = &self.context.operators(source.get()).openings;
        let mut front = Front::new();
        for (aperture, operators) in openings.iter().zip(emission) {
            let sent = Sent {
                block: source,
                exit: aperture.face,
                source_from_here: CubeRotation::IDENTITY,
                frame: frame_of_heading(aperture.face),
                headings: 0,
                holes: 0,
                doors: &[],
                lightfield: multiply(
                    fields.from_emission.view(),
                    operators.emission_from_coefficients[0].decode().view(),
                ),
            };
            cross(&mut front, scene, fields, sent);
        }
        front
    }

    /// Adds the responses to a wave in the block that it enters.
    fn enter(&self, arrivals: &mut Arrivals, key: &WaveKey, wave: &Wave) {
        let responses = multiply(
            self.fields.response_from_lightfield.view(),
            wave.lightfield.view(),
        );
        let arriving = Arriving {
            doors: &key.doors,
            block: key.block,
            face: key.entered,
            frame: CubeSymmetry::from(wave.source_from_here.inverse()).after(key.frame),
            parity: &self.context.dictionary.paths.response_parity,
            responses: &responses,
            factor: 1.0,
        };
        arrive(arrivals, arriving);
    }

    /// Passes a wave on through every other opening of its block that leads on and does not turn back.
    fn pass_on(&self, next: &mut Front, key: &WaveKey, wave: &Wave) {
        let (scene, fields) = (self.context.scene, self.fields);
        let here = &scene.level.blocks[key.block.get()];
        for aperture in here.shape.openings {
            let heading = wave.source_from_here.face(aperture.face);
            let turns_back = key.headings >> heading.opposite().index() & 1 == 1;
            let leads_on = matches!(here.beyond[aperture.face.index()], Beyond::Block { .. });
            if turns_back || !leads_on || aperture.face == key.entered {
                continue;
            }
            let (frame, mut lightfield) = through(fields, key.frame, &wave.lightfield, heading);
            let shape = scene.blocks[key.block.get()].shape_index;
            let transits = &self.context.transits;
            let factor = transits.factor(shape, key.entered, aperture.face);
            if factor != 1.0 {
                lightfield.data_mut().iter_mut().for_each(|x| *x *= factor);
            }
            let sent = Sent {
                block: key.block,
                exit: aperture.face,
                source_from_here: wave.source_from_here,
                frame,
                headings: key.headings,
                holes: key.holes,
                doors: &key.doors,
                lightfield,
            };
            cross(next, scene, fields, sent);
        }
    }
}

/// Passes a lightfield through a cube, from the opening that it entered by to the opening towards `heading`. Returns
/// the new frame and lightfield.
fn through(
    fields: &LightfieldOperators,
    frame: CubeSymmetry,
    lightfield: &Matrix<f32>,
    heading: Face,
) -> (CubeSymmetry, Matrix<f32>) {
    let mut frame = frame;
    let mut lightfield = lightfield.clone();
    let mut ahead = frame.inverse().face(heading);
    if ahead == Face::PosZ {
        return (frame, multiply(fields.straight.view(), lightfield.view()));
    }
    if ahead.axis() == 1 && fields.exchange.rows() > 0 {
        frame = frame.after(CubeSymmetry::exchange(0, 1));
        lightfield = multiply(fields.exchange.view(), lightfield.view());
        ahead = frame.inverse().face(heading);
    }
    if ahead == Face::NegX {
        frame = frame.after(CubeSymmetry::mirror(0));
        change_signs(&mut lightfield, &fields.parity, |parity| parity & 1 == 1);
    }
    let frame = frame.after(frame_of_heading(Face::PosX));
    (frame, multiply(fields.left.view(), lightfield.view()))
}

/// Changes the signs of all modes with parities of which `is_odd` is true.
fn change_signs(lightfield: &mut Matrix<f32>, parity: &[u8], is_odd: impl Fn(u8) -> bool) {
    let rows = lightfield.rows().max(1);
    for column in lightfield.data_mut().chunks_exact_mut(rows) {
        for (value, &parity) in column.iter_mut().zip(parity) {
            if is_odd(parity) {
                *value = -*value;
            }
        }
    }
}

/// A lightfield that leaves a block through an opening.
struct Sent<'a> {
    block: BlockIndex,
    exit: Face,
    source_from_here: CubeRotation,
    frame: CubeSymmetry,
    headings: u8,
    holes: usize,
    doors: &'a [u32],
    lightfield: Matrix<f32>,
}

/// Passes a lightfield into the block beyond, if there is one.
fn cross(front: &mut Front, scene: &SceneData, fields: &LightfieldOperators, sent: Sent) {
    let here = &scene.level.blocks[sent.block.get()];
    let Beyond::Block {
        block,
        face: entered,
        here_from_there,
    } = here.beyond[sent.exit.index()]
    else {
        return;
    };
    let heading = sent.source_from_here.face(sent.exit);
    let source_from_here = compose(sent.source_from_here, here_from_there);
    let mut lightfield = sent.lightfield;
    let roll = Roll::of(sent.frame);
    change_signs(&mut lightfield, &fields.parity, |parity| {
        roll.sign(parity) < 0.0
    });
    let mut frame = frame_of_heading(heading);
    if roll.exchanged {
        frame = frame.after(CubeSymmetry::exchange(0, 1));
    }
    let hole = here
        .shape
        .opening(sent.exit)
        .and_then(|o| hole_of(o.outline));
    if let Some(mask) = hole.and_then(|hole| fields.holes.get(usize::from(hole))) {
        lightfield = multiply(mask.view(), lightfield.view());
    }
    let key = WaveKey {
        block,
        entered,
        headings: sent.headings | 1 << heading.index(),
        frame,
        turn: [Face::PosX, Face::PosY].map(|face| source_from_here.face(face)),
        holes: (sent.holes + usize::from(hole.is_some())).min(2),
        doors: with_door(sent.doors, here.doors[sent.exit.index()]),
    };
    match front.get_mut(&key) {
        Some(there) => {
            for (sum, &x) in there
                .lightfield
                .data_mut()
                .iter_mut()
                .zip(lightfield.data())
            {
                *sum += x;
            }
        }
        None => {
            let wave = Wave {
                source_from_here,
                lightfield,
            };
            front.insert(key, wave);
        }
    }
}
