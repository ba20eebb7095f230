//! Direct light: only for blocks whose light may have changed.

use super::pass::{CutPlanes, part_of, span};
use super::{Bounces, Frame};
use crate::direct::irradiance;
use crate::executor::{run_parts, task_count};
use crate::light::PlacedLight;
use crate::scene::Scene;
use crate::visibility::{Receiver, Visibility};
use glam::Vec3;
use std::collections::VecDeque;

/// What the direct light that a frame holds was computed from, and what is still to be done.
#[derive(Debug)]
pub(super) struct DirectStage {
    /// Lights of the frame that begins.
    pub next: Vec<PlacedLight>,
    /// Lights whose light there is, once no block waits.
    now: Vec<PlacedLight>,
    doors: Vec<f32>,
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
    scratch: Vec<Vec<f32>>,
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
        Self {
            next: Vec::with_capacity(super::MAX_LIGHTS),
            now: Vec::with_capacity(super::MAX_LIGHTS),
            doors: scene.doors.clone(),
            version: None,
            source: Source::Nowhere,
            waiting: VecDeque::with_capacity(blocks),
            is_waiting: vec![false; blocks],
            list: Vec::with_capacity(blocks),
            found: vec![Found::default(); blocks],
            scratch: vec![vec![0.0; 3 * slots]; tasks],
        }
    }

    /// Dark, whatever the scene.
    pub(super) fn restart(&mut self, _scene: &Scene) {
        self.now.clear();
        self.source = Source::Nowhere;
        self.waiting.clear();
        self.is_waiting.fill(false);
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
        let same_shadows = stage.source == source
            && version.is_some()
            && version == stage.version
            && (stage.doors == self.doors || source == Source::CallersRays);
        if !same_shadows || stage.next != stage.now {
            for block in 0..scene.blocks.len() as u32 {
                stage.wait_for(block);
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
        let executor = &*self.config.executor;
        let tasks = task_count(executor, stage.list.len());
        let mut planes = CutPlanes::new(&mut self.direct);
        let mut found = &mut stage.found[..];
        let mut gone = 0;
        let mut scratch = stage.scratch.iter_mut();
        let (list, lights, doors) = (&stage.list, &stage.now, &self.doors);
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
                by_asking(scene, place, lights, doors, visibility, new);
                let slots = slots.start - first_slot..slots.end - first_slot;
                let mut result = Found::default();
                for (channel, plane) in planes.iter_mut().enumerate() {
                    let new = &new[channel * count..(channel + 1) * count];
                    for (old, &new) in plane[slots.clone()].iter_mut().zip(new) {
                        result.change = result.change.max((new - *old).abs());
                        result.peak = result.peak.max(new);
                        *old = new;
                    }
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
