//! Direct light: only for blocks whose light may have changed.

use super::pass::{CutPlanes, part_of, span};
use super::{Bounces, Frame, FrameWork};
use crate::executor::{run_parts, task_count};
use crate::light::beam::{Beam, BeamTracer};
use crate::light::direct_light::{TexelPlanes, add_beam, add_exact, irradiance};
use crate::light::placed::PlacedLight;
use crate::light::visibility::{Receiver, Visibility};
use crate::modular::scene::Scene;
use glam::Vec3;
use mrt_core::simd::{Aligned, Kernel, Lanes, SimdLevel};
use std::collections::VecDeque;
use std::ops::Range;

/// Beams that frames of a scene have room for: this many a block, and [`SPARE_BEAMS`] more, up to [`MAX_BEAMS`]. A light
/// in a maze has about one a block that it reaches, one in an open hall of 30 x 30 blocks twelve. Where lights have more,
/// texels ask for each light by itself: the same light, more slowly.
const BEAMS_PER_BLOCK: usize = 12;
/// See [`BEAMS_PER_BLOCK`].
const SPARE_BEAMS: usize = 256;
/// See [`BEAMS_PER_BLOCK`]; 19 MB.
const MAX_BEAMS: usize = 1 << 16;

/// What the direct light that a frame holds was computed from, and what is still to be done.
#[derive(Debug)]
pub(super) struct DirectStage {
    /// Lights of the frame that begins.
    pub next: Vec<PlacedLight>,
    /// Lights whose light there is, once no block waits.
    now: Vec<PlacedLight>,
    doors: Vec<f32>,
    tracer: BeamTracer,
    /// Beams of the lights of `now`, light after light, and of each light where.
    beams: Vec<Beam>,
    beams_of: Vec<Range<usize>>,
    /// The same of the frame that begins.
    next_beams: Vec<Beam>,
    next_beams_of: Vec<Range<usize>>,
    /// There was no room for all beams.
    overflow: bool,
    /// (block, beam) of the blocks in `list`, ascending.
    hits: Vec<(u32, u32)>,
    is_listed: Vec<bool>,
    /// [`Visibility::version`] of the one asked last.
    version: Option<u64>,
    source: Source,
    /// Blocks that wait for direct light, oldest first.
    waiting: VecDeque<u32>,
    is_waiting: Vec<bool>,
    /// Blocks of this frame, ascending.
    list: Vec<u32>,
    found: Vec<Found>,
    /// New irradiance of a block, by task.
    scratch: Vec<Aligned<f32>>,
}

/// Where direct light came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Nowhere,
    Openings,
    CallersRays,
    Caller,
}

/// What was found out about a block's direct light.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    change: f32,
    peak: f32,
}

impl DirectStage {
    pub(super) fn new(scene: &Scene, tasks: usize, slots: usize) -> Self {
        let blocks = scene.blocks.len();
        let room = (BEAMS_PER_BLOCK * blocks + SPARE_BEAMS).min(MAX_BEAMS);
        Self {
            next: Vec::with_capacity(super::MAX_LIGHTS),
            now: Vec::with_capacity(super::MAX_LIGHTS),
            doors: scene.doors.clone(),
            tracer: BeamTracer::new(scene),
            beams: Vec::with_capacity(room),
            beams_of: Vec::with_capacity(super::MAX_LIGHTS),
            next_beams: Vec::with_capacity(room),
            next_beams_of: Vec::with_capacity(super::MAX_LIGHTS),
            overflow: false,
            hits: Vec::with_capacity(room),
            is_listed: vec![false; blocks],
            version: None,
            source: Source::Nowhere,
            waiting: VecDeque::with_capacity(blocks),
            is_waiting: vec![false; blocks],
            list: Vec::with_capacity(blocks),
            found: vec![Found::default(); blocks],
            scratch: vec![Aligned::zeroed(3 * slots); tasks],
        }
    }

    /// Slots that a block may have.
    pub(super) fn slots(&self) -> usize {
        self.scratch.first().map_or(0, |scratch| scratch.len() / 3)
    }

    /// Dark, whatever the scene.
    pub(super) fn restart(&mut self, scene: &Scene) {
        self.forget();
        self.waiting.clear();
        self.is_waiting.fill(false);
        self.tracer.restart(scene);
    }

    /// The next frame computes all direct light anew.
    pub(super) fn forget(&mut self) {
        self.now.clear();
        self.beams.clear();
        self.beams_of.clear();
        self.source = Source::Nowhere;
    }

    /// Traces lights that are not what they were, and lets blocks wait that those light, or did.
    fn trace(&mut self, scene: &Scene, doors: &[f32], kept: bool) {
        let layout = &scene.layout;
        self.next_beams.clear();
        self.next_beams_of.clear();
        let had_overflow = std::mem::take(&mut self.overflow);
        for k in 0..self.next.len() {
            let start = self.next_beams.len();
            let known = kept && !had_overflow && self.now.get(k) == Some(&self.next[k]);
            if known {
                let range = self.beams_of[k].clone();
                self.overflow |= range.len() > self.next_beams.capacity() - start;
                if !self.overflow {
                    self.next_beams.extend_from_slice(&self.beams[range]);
                }
            } else {
                let (beams, overflow) = (&mut self.next_beams, &mut self.overflow);
                let emit = &mut |beam: &Beam| {
                    *overflow |= beams.len() == beams.capacity();
                    if !*overflow {
                        beams.push(*beam);
                    }
                };
                self.tracer
                    .trace(scene, k as u32, &self.next[k], doors, emit);
            }
            if self.overflow {
                break;
            }
            self.next_beams_of.push(start..self.next_beams.len());
            if !known {
                for at in start..self.next_beams.len() {
                    let block = self.next_beams[at].block as usize;
                    self.wait_for(layout.rank[block]);
                }
            }
        }
        if self.overflow || had_overflow {
            if self.overflow {
                self.next_beams.clear();
                self.next_beams_of.clear();
            }
            for block in 0..layout.block_count() as u32 {
                self.wait_for(block);
            }
        }
        for k in 0..self.beams_of.len() {
            if !kept || self.next.get(k) != self.now.get(k) {
                for at in self.beams_of[k].clone() {
                    let block = self.beams[at].block as usize;
                    self.wait_for(layout.rank[block]);
                }
            }
        }
        std::mem::swap(&mut self.beams, &mut self.next_beams);
        std::mem::swap(&mut self.beams_of, &mut self.next_beams_of);
    }

    /// Finds the beams that light the listed blocks.
    fn find_hits(&mut self, scene: &Scene) {
        self.hits.clear();
        for &block in &self.list {
            self.is_listed[block as usize] = true;
        }
        for (beam, at) in self.beams.iter().zip(0..) {
            let place = scene.layout.rank[beam.block as usize];
            if self.is_listed[place as usize] {
                self.hits.push((place, at));
            }
        }
        for &block in &self.list {
            self.is_listed[block as usize] = false;
        }
        self.hits.sort_unstable();
    }

    /// Whether some blocks wait for direct light.
    pub(super) fn has_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    fn wait_for(&mut self, block: u32) {
        if !self.is_waiting[block as usize] {
            self.is_waiting[block as usize] = true;
            self.waiting.push_back(block);
        }
    }

    /// Lists the blocks whose turn it is.
    fn take(&mut self, most: usize) {
        self.list.clear();
        let count = most.min(self.waiting.len());
        for block in self.waiting.drain(..count) {
            self.is_waiting[block as usize] = false;
            self.list.push(block);
        }
        self.list.sort_unstable();
    }
}

impl Frame {
    /// Brings direct light up to date.
    pub(super) fn update_direct<V: Visibility>(
        &mut self,
        scene: &Scene,
        visibility: &V,
        bounces: Bounces,
    ) {
        let stage = &mut self.lights;
        let source = if visibility.is_by_openings() {
            Source::Openings
        } else {
            Source::CallersRays
        };
        let version = visibility.version();
        let same_source = stage.source == source;
        let same_shadows = same_source
            && version.is_some()
            && version == stage.version
            && stage.doors == self.doors;
        let by_beams = source == Source::Openings;
        if !same_source {
            // Wherever there is light of another kind.
            stage.beams_of.clear();
            for k in 0..self.blocks.alive.len() {
                let block = self.blocks.alive[k];
                if self.blocks.state[block as usize].has_fresh {
                    stage.wait_for(block);
                }
            }
        }
        if !same_shadows || stage.next != stage.now {
            if by_beams {
                stage.trace(scene, &self.doors, same_shadows);
            } else {
                for block in 0..scene.blocks.len() as u32 {
                    stage.wait_for(block);
                }
            }
        }
        (stage.source, stage.version) = (source, version);
        stage.doors.copy_from_slice(&self.doors);
        stage.now.clear();
        stage.now.extend_from_slice(&stage.next);
        let most = match (self.config.slice, bounces) {
            (Some(slice), Bounces::Count(1) | Bounces::Feedback) => slice.get(),
            _ => usize::MAX,
        };
        stage.take(most);
        self.work = FrameWork {
            direct: stage.list.len(),
            ..FrameWork::default()
        };
        if by_beams && !stage.overflow {
            stage.find_hits(scene);
        }
        let by_beams = by_beams && !stage.overflow;
        let level = self.config.simd;
        let executor = &*self.config.executor;
        let tasks = task_count(executor, stage.list.len()).min(stage.scratch.len());
        let mut planes = CutPlanes::new(&mut self.direct);
        let mut found = &mut stage.found[..];
        let mut gone = 0;
        let mut scratch = stage.scratch.iter_mut();
        let (list, lights, doors) = (&stage.list, &stage.now, &self.doors);
        let (beams, hits) = (&stage.beams, &stage.hits);
        let layout = &scene.layout;
        let parts = (0..tasks)
            .map_while(|k| part_of(list, tasks, k).filter(|list| !list.is_empty()))
            .filter_map(|list| {
                let span = span(list);
                let slots = layout.slots[span.start].start..layout.slots[span.end - 1].end;
                let (_, rest) = std::mem::take(&mut found).split_at_mut(span.start - gone);
                let (taken, rest) = rest.split_at_mut(span.len());
                (found, gone) = (rest, span.end);
                Some((list, taken, planes.take(slots), scratch.next()?))
            });
        run_parts(executor, parts, |(list, found, mut planes, scratch)| {
            let span = span(list);
            let first_slot = layout.slots[span.start].start;
            for &block in list {
                let place = block as usize;
                let slots = layout.slots[place].clone();
                let count = slots.len();
                let new = &mut scratch[..3 * count];
                if by_beams {
                    let start = hits.partition_point(|hit| hit.0 < block);
                    let end = start + hits[start..].partition_point(|hit| hit.0 == block);
                    let hits = &hits[start..end];
                    by_beam(scene, place, level, lights, doors, (beams, hits), new);
                } else {
                    by_asking(scene, place, lights, doors, visibility, new);
                }
                let slots = slots.start - first_slot..slots.end - first_slot;
                let mut result = Found::default();
                for (plane, new) in planes.iter_mut().zip(new.chunks_exact(count)) {
                    let old = &mut plane[slots.clone()];
                    let channel = level.run(Replace { old, new });
                    result.change = result.change.max(channel.change);
                    result.peak = result.peak.max(channel.peak);
                }
                found[place - span.start] = result;
            }
        });
        for &block in &stage.list {
            let found = stage.found[block as usize];
            let emits = scene.surface.emitting.binary_search(&block).is_ok();
            self.blocks.state[block as usize].has_fresh = emits || found.peak > 0.0;
            if found.change > 0.0 {
                self.blocks.touch(block, found.change);
            }
        }
    }

    /// Takes direct light that the caller computed, in the order of texels.
    pub(super) fn take_direct(&mut self, scene: &Scene, direct: &[f32]) {
        let mut start = 0;
        for &place in &scene.layout.rank {
            let place = place as usize;
            let shape = &scene.shapes[scene.layout.shapes[place] as usize];
            let count = shape.folding.slot_of_texel.len();
            let values = &direct[start..start + 3 * count];
            start += 3 * count;
            let mut found = Found::default();
            let planes = self.direct.block_mut(scene.layout.slots[place].clone());
            for (plane, values) in planes.into_iter().zip(values.chunks_exact(count.max(1))) {
                for (slot, &texel) in plane.iter_mut().zip(&shape.folding.texel_of_slot) {
                    let new = values.get(texel as usize).copied().unwrap_or(0.0);
                    found.change = found.change.max((new - *slot).abs());
                    found.peak = found.peak.max(new);
                    *slot = new;
                }
            }
            let block = place as u32;
            let emits = scene.surface.emitting.binary_search(&block).is_ok();
            self.blocks.state[place].has_fresh = emits || found.peak > 0.0;
            if found.change > 0.0 {
                self.blocks.touch(block, found.change);
            }
        }
        self.lights.restart(scene);
        self.lights.source = Source::Caller;
    }
}

/// Direct light of one block, each texel and light asked for by itself.
fn by_asking<V: Visibility>(
    scene: &Scene,
    place: usize,
    lights: &[PlacedLight],
    doors: &[f32],
    visibility: &V,
    out: &mut [f32],
) {
    let slots = scene.layout.slots[place].clone();
    let count = slots.len();
    let block = scene.layout.order[place] as usize;
    let surface = &scene.surface;
    for slot in 0..count {
        let normal = surface.normals.get(slots.start + slot);
        let mut sum = Vec3::ZERO;
        if normal != Vec3::ZERO {
            let receiver = Receiver {
                block,
                position: surface.positions.get(slots.start + slot).as_dvec3(),
            };
            for light in lights {
                let normal = normal.as_dvec3();
                sum += irradiance(scene, light, doors, receiver, normal, visibility);
            }
        }
        for (channel, x) in sum.to_array().into_iter().enumerate() {
            out[channel * count + slot] = x;
        }
    }
}

/// Direct light of one block, beam by beam.
fn by_beam(
    scene: &Scene,
    place: usize,
    level: SimdLevel,
    lights: &[PlacedLight],
    doors: &[f32],
    (beams, hits): (&[Beam], &[(u32, u32)]),
    out: &mut [f32],
) {
    out.fill(0.0);
    let slots = scene.layout.slots[place].clone();
    let texels = TexelPlanes {
        positions: scene.surface.positions.block(slots.clone()),
        normals: scene.surface.normals.block(slots.clone()),
    };
    let (red, rest) = out.split_at_mut(slots.len());
    let (green, blue) = rest.split_at_mut(slots.len());
    let beam = |hit: &(u32, u32)| &beams[hit.1 as usize];
    for of_light in hits.chunk_by(|a, b| beam(a).light == beam(b).light) {
        let light = &lights[beam(&of_light[0]).light as usize];
        // An exact beam stands for all of its light's.
        if of_light.iter().any(|hit| beam(hit).exact) {
            add_exact(scene, place, light, doors, [red, green, blue]);
            continue;
        }
        for hit in of_light {
            add_beam(level, &texels, light, beam(hit), [red, green, blue]);
        }
    }
}

/// Writes new values over old ones.
struct Replace<'a> {
    old: &'a mut [f32],
    new: &'a [f32],
}

impl Kernel for Replace<'_> {
    type Output = Found;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Found {
        let (mut change, mut peak) = (l.splat(0.0), l.splat(0.0));
        let count = self.new.len();
        let old = &mut self.old[..count];
        assert_eq!(count % L::N, 0, "padding");
        let mut at = 0;
        while at < count {
            let new = l.load(&self.new[at..at + L::N]);
            let old = &mut old[at..at + L::N];
            change = l.max(l.abs(l.sub(new, l.load(old))), change);
            peak = l.max(new, peak);
            l.store(old, new);
            at += L::N;
        }
        Found {
            change: l.largest(change),
            peak: l.largest(peak),
        }
    }
}
