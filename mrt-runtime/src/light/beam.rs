//! Where a light's direct light goes: beams through the level's openings, followed outwards from the light.
//!
//! A beam is a light seen through one sequence of openings. An opening lets a cone of light through, whose sides are
//! the planes of the light and the opening's edges. A sequence of openings lets the intersection of their cones
//! through: Luebke and Georges, "Portals and mirrors", I3D 1995, with exact polygons in place of their rectangles. The
//! sign conditions are those of [`Openings`](crate::light::visibility::Openings), which tests the same from the
//! receiver's end.
//!
//! The cones of different sequences do not overlap, so a block's direct light is the sum over its beams.

mod cone;

use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedBlock, PlacedLevel};
use crate::light::placed::PlacedLight;

use cone::{Cone, MAX_PLANES, ON_PLANE, Passing, Scratch, Source};
use glam::Vec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::TubeForm;

/// Most beams that wait to be followed further. One waits for each opening beside the path of the beam that is
/// followed: a straight corridor of any length needs one, an open hall of 300 x 300 blocks a few hundred.
const MAX_PENDING: usize = 1024;

/// A light's direct light in a block, through one sequence of openings.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// The block that the beam lights.
    pub block: BlockIndex,
    /// Index of the light, as given to [`BeamTracer::trace`].
    pub light: u32,
    /// Fraction of light, in (0, 1], that the doors on the way let through: the product of their values.
    pub fraction: f32,
    /// Origin of the planes, metres: the light, or a corner of the block for directional lights. Far from the world's
    /// origin, differences from it keep more digits than positions do.
    pub origin: Vec3,
    /// Only the first `plane_count` entries are valid.
    planes: [[f32; 4]; MAX_PLANES],
    plane_count: u32,
    /// True if the planes do not tell which points are lit, because of a bend or too many planes on the way. All of the
    /// light's beams in this block are then replaced by [`add_exact`](crate::light::direct_light::add_exact).
    pub exact: bool,
}

impl Beam {
    /// `[x, y, z, w]` of each plane: a point p of the block is lit if `(p - origin) · xyz + w >= 0`, metres, for all
    /// planes. Planes that the whole block is inside of are left out.
    ///
    /// Evaluated in `f32` with w added last, a point in the plane where two beams of a light meet is in exactly one of
    /// them.
    pub fn planes(&self) -> &[[f32; 4]] {
        &self.planes[..self.plane_count as usize]
    }
}

impl PartialEq for Beam {
    fn eq(&self, other: &Self) -> bool {
        (self.block, self.light, self.exact) == (other.block, other.light, other.exact)
            && (self.fraction, self.origin) == (other.fraction, other.origin)
            && self.planes() == other.planes()
    }
}

/// Follows lights through the openings of one level. Make it once; tracing allocates nothing.
#[derive(Debug)]
pub struct BeamTracer {
    /// Openings that lead outside: the block, and the position in its list of portals.
    outside: Vec<(BlockIndex, u32)>,
    /// Beams to follow further. Only the first `waiting` entries are valid; the others keep their memory for later.
    pending: Vec<Node>,
    waiting: usize,
    /// The beam that is being followed, that beam beyond the present opening, and its light in the block there.
    node: Node,
    next: Node,
    beam: Beam,
    scratch: Scratch,
    /// For each block, the number of the trace that last gave it an exact beam.
    exact: Vec<u32>,
    /// Number of the present trace.
    trace: u32,
}

/// A beam on its way.
#[derive(Clone, Debug)]
struct Node {
    block: BlockIndex,
    entered: Option<Face>,
    /// Openings passed.
    depth: u32,
    fraction: f32,
    cone: Cone,
}

impl Node {
    const NEW: Node = Node {
        block: BlockIndex::new(0),
        entered: None,
        depth: 0,
        fraction: 1.0,
        cone: Cone::EVERYWHERE,
    };

    /// Same as a clone of `other`, but copies only the planes in use.
    fn copy_from(&mut self, other: &Node) {
        (self.block, self.entered) = (other.block, other.entered);
        (self.depth, self.fraction) = (other.depth, other.fraction);
        self.cone.copy_from(&other.cone);
    }
}

/// The input and output of one trace.
struct Trace<'a> {
    level: &'a PlacedLevel,
    doors: &'a [f32],
    light: u32,
    /// The light's block.
    home: Option<BlockIndex>,
    source: Source,
    emit: &'a mut dyn FnMut(&Beam),
}

impl Trace<'_> {
    /// Fraction of light that passes the door in a face; 1 without a door.
    fn door_value(&self, block: &PlacedBlock, face: Face) -> f32 {
        block.doors[face.index()].map_or(1.0, |door| self.doors[door as usize])
    }
}

impl BeamTracer {
    /// Finds the level's openings to the outside, and allocates the memory of tracing: 0.6 kB for each of up to 1024
    /// beams, fewer in small scenes.
    pub fn new(level: &PlacedLevel) -> Self {
        let openings = level.blocks.iter().map(|block| block.portals.len()).sum();
        let mut tracer = Self {
            outside: Vec::with_capacity(openings),
            // A cube has five openings besides the one that the beam entered by, and the light's block has six.
            pending: Vec::with_capacity(MAX_PENDING.min(5 * level.blocks.len() + 1)),
            waiting: 0,
            node: Node::NEW,
            next: Node::NEW,
            beam: Beam {
                block: BlockIndex::new(0),
                light: 0,
                fraction: 0.0,
                origin: Vec3::ZERO,
                planes: [[0.0; 4]; MAX_PLANES],
                plane_count: 0,
                exact: false,
            },
            scratch: Scratch::NEW,
            exact: vec![0; level.blocks.len()],
            trace: 0,
        };
        tracer.restart(level);
        tracer
    }

    /// Switches to another level with the same numbers of blocks and openings; allocates nothing.
    pub(crate) fn restart(&mut self, level: &PlacedLevel) {
        self.outside.clear();
        for (index, block) in level.blocks.iter().enumerate() {
            for (k, portal) in block.portals.iter().enumerate() {
                if block.beyond[portal.face.index()] == Beyond::Outside {
                    self.outside.push((BlockIndex::new(index), k as u32));
                }
            }
        }
    }

    /// Calls `emit` for each beam of a light; beams name it by the index `light`.
    ///
    /// Each block gets at most one [exact](Beam::exact) beam. It may come after other beams of its block, which it
    /// replaces; no beam of the block comes after it. A light without intensity has no beams, and closed doors let no
    /// beam through.
    ///
    /// Cost: half a microsecond for each block that a beam enters; for a directional light, also a test of each opening
    /// to the outside.
    ///
    /// # Panics
    /// If the level has another number of blocks than the tracer's, or `doors` has another length than the level's
    /// doors.
    pub fn trace(
        &mut self,
        level: &PlacedLevel,
        light: u32,
        placed: &PlacedLight,
        doors: &[f32],
        emit: &mut dyn FnMut(&Beam),
    ) {
        assert_eq!(self.exact.len(), level.blocks.len(), "blocks of the level");
        assert_eq!(doors.len(), level.doors.len(), "doors of the level");
        self.start_marks();
        let (source, power) = Source::new(&placed.light);
        if power == Vec3::ZERO {
            return;
        }
        let mut trace = Trace {
            level,
            doors,
            light,
            home: placed.block,
            source,
            emit,
        };
        match placed.block {
            Some(block) => {
                self.next.copy_from(&Node::NEW);
                self.next.block = block;
                self.enter(&mut trace);
                self.follow(&mut trace);
            }
            None => {
                for k in 0..self.outside.len() {
                    let (block, portal) = self.outside[k];
                    self.enter_from_outside(&mut trace, block, portal);
                    self.follow(&mut trace);
                }
            }
        }
    }

    fn start_marks(&mut self) {
        self.waiting = 0;
        self.trace = self.trace.wrapping_add(1);
        if self.trace == 0 {
            self.exact.fill(0);
            self.trace = 1;
        }
    }

    fn enter_from_outside(&mut self, trace: &mut Trace<'_>, index: BlockIndex, portal: u32) {
        let block = &trace.level.blocks[index.get()];
        let portal = &block.portals[portal as usize];
        if trace
            .source
            .toward
            .is_none_or(|d| d.dot(portal.outward) <= 0.0)
        {
            return;
        }
        let fraction = trace.door_value(block, portal.face);
        let next = &mut self.next;
        let passing = Passing {
            cone: &Cone::EVERYWHERE,
            source: &trace.source,
            portal,
            depth: 0,
        };
        if passing.narrow(&mut self.scratch, &mut next.cone) {
            (next.block, next.entered) = (index, Some(portal.face));
            (next.depth, next.fraction) = (1, fraction);
            self.enter(trace);
        }
    }

    /// Follows all pending beams to their ends.
    fn follow(&mut self, trace: &mut Trace<'_>) {
        let level = trace.level;
        while self.waiting > 0 {
            self.waiting -= 1;
            self.node.copy_from(&self.pending[self.waiting]);
            let block = &level.blocks[self.node.block.get()];
            // A line enters each block at most once, so this is as far as it can get.
            if self.node.depth as usize + 1
                >= level.blocks.len() + usize::from(trace.home.is_none())
            {
                continue;
            }
            for portal in &block.portals {
                let node = &self.node;
                let Beyond::Block {
                    block: next, face, ..
                } = block.beyond[portal.face.index()]
                else {
                    continue;
                };
                if Some(portal.face) == node.entered || Some(next) == trace.home {
                    continue;
                }
                let fraction = node.fraction * trace.door_value(block, portal.face);
                // Receivers beyond the opening test the outline that their own block gives it.
                let beyond = level.blocks[next.get()]
                    .portals
                    .iter()
                    .find(|p| p.face == face);
                let Some(beyond) = beyond.filter(|_| fraction > 0.0) else {
                    continue;
                };
                let to = &mut self.next;
                let passing = Passing {
                    cone: &node.cone,
                    source: &trace.source,
                    portal: beyond,
                    depth: node.depth,
                };
                if passing.narrow(&mut self.scratch, &mut to.cone) {
                    (to.block, to.entered) = (next, Some(face));
                    (to.depth, to.fraction) = (node.depth + 1, fraction);
                    self.enter(trace);
                }
            }
        }
    }

    /// Emits the beam in `next` for the block that it has entered, and makes it pending.
    fn enter(&mut self, trace: &mut Trace<'_>) {
        let node = &mut self.next;
        if node.fraction <= 0.0 {
            return;
        }
        let block = &trace.level.blocks[node.block.get()];
        if trace.source.misses(block) || !beam_in(block, &trace.source, node, &mut self.beam) {
            return;
        }
        // Light that has crossed a bend, or part of one, does not fill a cone.
        if block.shape.tube() == Some(TubeForm::Bend) {
            node.cone.is_exact = false;
            self.beam.exact = true;
        }
        self.beam.light = trace.light;
        self.give(trace);
        if self.waiting < self.pending.len() {
            self.pending[self.waiting].copy_from(&self.next);
            self.waiting += 1;
        } else if self.pending.len() < self.pending.capacity() {
            self.pending.push(self.next.clone());
            self.waiting += 1;
        } else {
            // There is no room to find the other beams. Exact beams let the receivers of every block test their light
            // themselves.
            self.waiting = 0;
            for block in 0..trace.level.blocks.len() {
                self.beam.block = BlockIndex::new(block);
                self.beam.exact = true;
                self.give(trace);
            }
        }
    }

    /// Emits a beam unless its block has an exact beam of this trace.
    fn give(&mut self, trace: &mut Trace<'_>) {
        let beam = &self.beam;
        let mark = &mut self.exact[beam.block.get()];
        if *mark != self.trace {
            if beam.exact {
                *mark = self.trace;
            }
            (trace.emit)(beam);
        }
    }
}

/// Sets all of `beam` but its light: the light of `node` in a block, without the planes that the whole block is inside
/// of. False if the block is outside a plane.
///
/// Only the corners of the block are tested: a warped block is in the hull of its corners, and a tube is in its cube.
fn beam_in(block: &PlacedBlock, source: &Source, node: &Node, beam: &mut Beam) -> bool {
    let origin = match source.toward {
        None => source.origin,
        Some(_) => block.warp.corners[0],
    }
    .as_vec3();
    let shift = origin.as_dvec3() - source.origin;
    (beam.block, beam.fraction, beam.origin) = (node.block, node.fraction, origin);
    (beam.plane_count, beam.exact) = (0, !node.cone.is_exact);
    let (low, high) = block.bounds;
    let slack = ON_PLANE * (high - low).length();
    for plane in node.cone.planes() {
        let (mut smallest, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        for &corner in &block.warp.corners {
            let distance = plane.at(corner - source.origin);
            smallest = smallest.min(distance);
            largest = largest.max(distance);
        }
        if largest <= slack {
            return false;
        }
        if smallest < -slack {
            let n = plane.normal.as_vec3();
            let mut w = plane.at(shift) as f32;
            // Two beams that meet have the same plane with opposite signs, to the bit. Rounding one of them down leaves
            // each texel in the plane to exactly one beam.
            if n.to_array().into_iter().find(|&x| x != 0.0) < Some(0.0) {
                w = w.next_down();
            }
            beam.planes[beam.plane_count as usize] = [n.x, n.y, n.z, w];
            beam.plane_count += 1;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::block::Level;
    use crate::light::placed::place;
    use crate::light::source::Light;
    use crate::modular::assemble::config::AssembleConfig;
    use crate::modular::dictionary::Dictionary;
    use crate::modular::scene::Scene;

    /// A room of `width` by `width` cells.
    fn room(width: i32) -> Scene {
        let bytes = include_bytes!("../../../assets/versions/2.mrt");
        let dictionary = Dictionary::from_bytes(bytes);
        let cells: Vec<[i32; 3]> = (0..width * width)
            .map(|k| [k % width, 0, k / width])
            .collect();
        let level = Level::from_cells(&cells, Vec3::splat(0.5)).expect("cells side by side");
        let config = AssembleConfig {
            max_depth: 1,
            ..AssembleConfig::default()
        };
        Scene::assemble(&level, &dictionary.expect("sound"), &config).expect("the cells' shapes")
    }

    fn lamp(scene: &Scene, position: Vec3) -> PlacedLight {
        let light = Light::Sphere {
            position,
            radius: 0.1,
            intensity: Vec3::ONE,
        };
        place(&scene.level, light).expect("inside")
    }

    #[test]
    fn every_block_gets_an_exact_beam_when_too_many_beams_wait() {
        let scene = room(5);
        let light = lamp(&scene, Vec3::new(0.3, 0.5, 0.4));
        let mut tracer = BeamTracer::new(&scene.level);
        tracer.pending = Vec::with_capacity(1);
        let mut exact = vec![0; 25];
        tracer.trace(&scene.level, 0, &light, &[], &mut |beam| {
            exact[beam.block.get()] += usize::from(beam.exact);
        });
        assert_eq!(exact, [1; 25]);
    }

    #[test]
    fn few_beams_wait_in_an_open_hall() {
        // Along a path, one beam waits for each opening whose light was divided, and far openings are too narrow to be
        // divided often.
        for width in [10, 40] {
            let scene = room(width);
            let light = lamp(&scene, Vec3::new(0.3, 0.5, 0.4));
            let mut tracer = BeamTracer::new(&scene.level);
            let most = 2 * width as usize;
            tracer.pending = Vec::with_capacity(most);
            let mut beams = 0;
            tracer.trace(&scene.level, 0, &light, &[], &mut |beam| {
                assert!(!beam.exact, "more than {most} were waiting");
                beams += 1;
            });
            assert!(beams >= width * width);
        }
    }
}
