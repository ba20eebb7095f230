//! Direct light: only for blocks whose light may have changed.

use crate::executor::run_parts;
use crate::light::beam::{Beam, BeamTracer};
use crate::light::direct_light::add_beam::{TexelPlanes, add_beam};
use crate::light::direct_light::{Shadows, add_exact, irradiance};
use crate::light::limits::MAX_LIGHTS;
use crate::light::placed::PlacedLight;
use crate::light::visibility::{Openings, Receiver, Visibility};
use crate::modular::frame::config::FrameConfig;
use crate::modular::frame::schedule::Schedule;
use crate::modular::frame::split::{Cut, CutPlanes, parts_of};
use crate::modular::scene::SceneData;
use crate::output::texel_layout::{BlockRank, Planes};
use glam::Vec3;
use mrt_core::simd::{Aligned, Kernel, Lanes, SimdLevel};
use std::collections::VecDeque;
use std::ops::Range;

/// A frame has room for `BEAMS_PER_BLOCK` beams for each block and [`SPARE_BEAMS`] more, up to [`MAX_BEAMS`]. A light
/// has about one beam in each block that it reaches in a maze, and twelve in an open hall of 30 x 30 blocks. If the
/// lights of a frame have more beams than fit, every texel tests each light: the same result, more slowly.
const BEAMS_PER_BLOCK: usize = 12;
/// See [`BEAMS_PER_BLOCK`].
const SPARE_BEAMS: usize = 256;
/// See [`BEAMS_PER_BLOCK`]. This many beams take 19 MB.
const MAX_BEAMS: usize = 1 << 16;

/// What the direct light of a frame was computed from, and which blocks still wait for theirs.
#[derive(Debug)]
pub(super) struct DirectStage {
    /// The lights that direct light is computed from. It is up to date in blocks that do not wait.
    now: Vec<PlacedLight>,
    doors: Vec<f32>,
    tracer: BeamTracer,
    /// Beams of the lights in `now`, light after light, and the range of each light.
    beams: Vec<Beam>,
    beams_of: Vec<Range<usize>>,
    /// The same for the frame that begins.
    next_beams: Vec<Beam>,
    next_beams_of: Vec<Range<usize>>,
    /// Whether there was no room for all beams.
    overflow: bool,
    /// The beams in each block of `list`, ascending.
    hits: Vec<Hit>,
    is_listed: Vec<bool>,
    /// [`Visibility::version`] in the last frame.
    version: Option<u64>,
    source: Source,
    /// Blocks that wait for direct light, oldest first.
    waiting: VecDeque<BlockRank>,
    is_waiting: Vec<bool>,
    /// Blocks whose direct light this frame computes, ascending.
    list: Vec<BlockRank>,
    found: Vec<Found>,
    /// For each task: new irradiance of one block.
    scratch: Vec<Aligned<f32>>,
}

/// What computed the direct light of the last frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Nowhere,
    Openings,
    CallersRays,
    Caller,
}

/// What a frame found about a block's direct light.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// Largest change of irradiance, W/m².
    change: f32,
    /// Largest irradiance, W/m².
    peak: f32,
}

/// A beam that lights a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Hit {
    block: BlockRank,
    /// Index of the beam.
    beam: u32,
}

impl DirectStage {
    pub(super) fn new(scene: &SceneData, tasks: usize) -> Self {
        let blocks = scene.level.blocks.len();
        let room = (BEAMS_PER_BLOCK * blocks + SPARE_BEAMS).min(MAX_BEAMS);
        let slots = scene.layout.most_slots();
        Self {
            now: Vec::with_capacity(MAX_LIGHTS),
            doors: scene.level.doors.clone(),
            tracer: BeamTracer::new(&scene.level),
            beams: Vec::with_capacity(room),
            beams_of: Vec::with_capacity(MAX_LIGHTS),
            next_beams: Vec::with_capacity(room),
            next_beams_of: Vec::with_capacity(MAX_LIGHTS),
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

    /// Makes the next frame compute all direct light again.
    pub(super) fn forget(&mut self) {
        self.now.clear();
        self.beams.clear();
        self.beams_of.clear();
        self.source = Source::Nowhere;
    }

    /// Traces the lights that changed, and makes the blocks wait that such a light reaches or reached before. Beams of
    /// unchanged lights are kept if `keep`; otherwise all lights are traced.
    fn trace(&mut self, scene: &SceneData, next: &[PlacedLight], doors: &[f32], keep: bool) {
        self.next_beams.clear();
        self.next_beams_of.clear();
        let had_overflow = std::mem::take(&mut self.overflow);
        for (k, light) in next.iter().enumerate() {
            let start = self.next_beams.len();
            let is_known = keep && !had_overflow && self.now.get(k) == Some(light);
            if is_known {
                self.keep_beams(k);
            } else {
                self.trace_light(scene, k, light, doors);
            }
            if self.overflow {
                break;
            }
            self.next_beams_of.push(start..self.next_beams.len());
            if !is_known {
                for at in start..self.next_beams.len() {
                    let block = self.next_beams[at].block;
                    self.wait_for(scene.layout.rank[block.get()]);
                }
            }
        }
        if self.overflow || had_overflow {
            if self.overflow {
                self.next_beams.clear();
                self.next_beams_of.clear();
            }
            for block in scene.layout.ranks() {
                self.wait_for(block);
            }
        }
        for k in 0..self.beams_of.len() {
            if !keep || next.get(k) != self.now.get(k) {
                for at in self.beams_of[k].clone() {
                    let block = self.beams[at].block;
                    self.wait_for(scene.layout.rank[block.get()]);
                }
            }
        }
        std::mem::swap(&mut self.beams, &mut self.next_beams);
        std::mem::swap(&mut self.beams_of, &mut self.next_beams_of);
    }

    /// Copies the beams of a light that did not change.
    fn keep_beams(&mut self, light: usize) {
        let range = self.beams_of[light].clone();
        let room = self.next_beams.capacity() - self.next_beams.len();
        self.overflow |= range.len() > room;
        if !self.overflow {
            self.next_beams.extend_from_slice(&self.beams[range]);
        }
    }

    /// Finds the beams of a light; sets `overflow` if there is no room for all.
    fn trace_light(&mut self, scene: &SceneData, index: usize, light: &PlacedLight, doors: &[f32]) {
        let (beams, overflow) = (&mut self.next_beams, &mut self.overflow);
        let emit = &mut |beam: &Beam| {
            *overflow |= beams.len() == beams.capacity();
            if !*overflow {
                beams.push(*beam);
            }
        };
        self.tracer
            .trace(&scene.level, index as u32, light, doors, emit);
    }

    /// Finds the beams that light the listed blocks.
    fn find_hits(&mut self, scene: &SceneData) {
        self.hits.clear();
        for &block in &self.list {
            self.is_listed[block.get()] = true;
        }
        for (beam, at) in self.beams.iter().zip(0..) {
            let rank = scene.layout.rank[beam.block.get()];
            if self.is_listed[rank.get()] {
                self.hits.push(Hit {
                    block: rank,
                    beam: at,
                });
            }
        }
        for &block in &self.list {
            self.is_listed[block.get()] = false;
        }
        self.hits.sort_unstable();
    }

    /// Whether some blocks wait for direct light.
    pub(super) fn has_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Makes a block wait for its direct light to be computed.
    fn wait_for(&mut self, block: BlockRank) {
        if !self.is_waiting[block.get()] {
            self.is_waiting[block.get()] = true;
            self.waiting.push_back(block);
        }
    }

    /// Moves the `most` oldest waiting blocks to the list of this frame.
    fn take(&mut self, most: usize) {
        self.list.clear();
        let count = most.min(self.waiting.len());
        for block in self.waiting.drain(..count) {
            self.is_waiting[block.get()] = false;
            self.list.push(block);
        }
        self.list.sort_unstable();
    }

    /// Finds the blocks whose direct light may have changed since the frame before.
    fn find_changes<V: Visibility>(&mut self, job: &DirectJob<'_, V>, schedule: &Schedule) {
        let visibility = job.shadows.visibility;
        let source = if visibility.is_by_openings() {
            Source::Openings
        } else {
            Source::CallersRays
        };
        let version = visibility.version();
        let same_source = self.source == source;
        let same_shadows = same_source
            && version.is_some()
            && version == self.version
            && self.doors == job.shadows.doors;
        if !same_source {
            // Light of another kind must be replaced wherever there is some.
            self.beams_of.clear();
            for &block in &schedule.alive {
                if schedule.state[block.get()].has_fresh() {
                    self.wait_for(block);
                }
            }
        }
        if !same_shadows || job.lights != self.now {
            if source == Source::Openings {
                self.trace(job.scene, job.lights, job.shadows.doors, same_shadows);
            } else {
                for block in job.scene.layout.ranks() {
                    self.wait_for(block);
                }
            }
        }
        (self.source, self.version) = (source, version);
        self.doors.copy_from_slice(job.shadows.doors);
        self.now.clear();
        self.now.extend_from_slice(job.lights);
    }

    /// Brings the direct light of at most `job.most` blocks up to date. Returns how many blocks were computed.
    pub(super) fn update<V: Visibility>(
        &mut self,
        job: &DirectJob<'_, V>,
        direct: &mut Planes,
        schedule: &mut Schedule,
    ) -> usize {
        self.find_changes(job, schedule);
        self.take(job.most);
        let by_beams = self.source == Source::Openings && !self.overflow;
        if by_beams {
            self.find_hits(job.scene);
        }
        self.compute(job, by_beams, direct);
        for &block in &self.list {
            let found = self.found[block.get()];
            schedule.state[block.get()].has_direct = found.peak > 0.0;
            if found.change > 0.0 {
                schedule.touch(block, found.change);
            }
        }
        self.list.len()
    }

    /// Computes the direct light of the listed blocks.
    fn compute<V: Visibility>(
        &mut self,
        job: &DirectJob<'_, V>,
        by_beams: bool,
        direct: &mut Planes,
    ) {
        let executor = &*job.config.executor;
        let mut planes = CutPlanes::new(direct);
        let mut found = Cut::new(&mut self.found, 1);
        let layout = &job.scene.layout;
        let beams = LitBlocks {
            lights: &self.now,
            beams: &self.beams,
            hits: &self.hits,
        };
        let parts = parts_of(&self.list, executor, &mut self.scratch).map(|part| {
            let planes = planes.take(layout.slots_of_span(&part.span));
            let found = found.take(part.span.clone());
            (part, found, planes)
        });
        run_parts(executor, parts, |(part, found, mut planes)| {
            let first_slot = layout.slots[part.span.start].start;
            for &block in part.list {
                let slots = layout.slots(block);
                let count = slots.len();
                let new = &mut part.scratch[..3 * count];
                if by_beams {
                    beams.light_block(job, block, new);
                } else {
                    ask_for_block(job, block, beams.lights, new);
                }
                let slots = slots.start - first_slot..slots.end - first_slot;
                let mut result = Found::default();
                for (plane, new) in planes.iter_mut().zip(new.chunks_exact(count)) {
                    let old = &mut plane[slots.clone()];
                    let channel = job.config.simd.run(Replace { old, new });
                    result.change = result.change.max(channel.change);
                    result.peak = result.peak.max(channel.peak);
                }
                found[block.get() - part.span.start] = result;
            }
        });
    }

    /// Takes direct light that the caller computed, in the order of texels.
    pub(super) fn take_from_caller(
        &mut self,
        scene: &SceneData,
        values: &[f32],
        direct: &mut Planes,
        schedule: &mut Schedule,
    ) {
        let mut start = 0;
        for &rank in &scene.layout.rank {
            let texel_of_slot = &scene.layout.texel_of_slot[scene.layout.shape(rank)];
            let count = scene.layout.slot_of_texel[scene.layout.shape(rank)].len();
            let values = &values[start..start + 3 * count];
            start += 3 * count;
            let mut found = Found::default();
            let planes = direct.block_mut(scene.layout.slots(rank));
            for (plane, values) in planes.into_iter().zip(values.chunks_exact(count.max(1))) {
                for (slot, &texel) in plane.iter_mut().zip(texel_of_slot) {
                    let new = values.get(texel as usize).copied().unwrap_or(0.0);
                    found.change = found.change.max((new - *slot).abs());
                    found.peak = found.peak.max(new);
                    *slot = new;
                }
            }
            schedule.state[rank.get()].has_direct = found.peak > 0.0;
            if found.change > 0.0 {
                schedule.touch(rank, found.change);
            }
        }
        self.forget();
        self.waiting.clear();
        self.is_waiting.fill(false);
        self.source = Source::Caller;
    }
}

/// What the direct light of a frame depends on.
pub(super) struct DirectJob<'a, V> {
    pub scene: &'a SceneData,
    pub config: &'a FrameConfig,
    pub shadows: Shadows<'a, V>,
    pub lights: &'a [PlacedLight],
    /// Most blocks to compute.
    pub most: usize,
}

/// Texels of a block.
fn texels_of(scene: &SceneData, block: BlockRank) -> TexelPlanes<'_> {
    let slots = scene.layout.slots(block);
    TexelPlanes {
        positions: scene.texels.positions.block(slots.clone()),
        normals: scene.texels.normals.block(slots),
    }
}

/// Direct light of one block, with a test of shadow for each texel and light.
fn ask_for_block<V: Visibility>(
    job: &DirectJob<'_, V>,
    block: BlockRank,
    lights: &[PlacedLight],
    out: &mut [f32],
) {
    let slots = job.scene.layout.slots(block);
    let count = slots.len();
    let geometry = &job.scene.texels;
    for slot in 0..count {
        let normal = geometry.normals.get(slots.start + slot);
        let mut sum = Vec3::ZERO;
        if normal != Vec3::ZERO {
            let receiver = Receiver {
                block: job.scene.layout.order[block.get()],
                position: geometry.positions.get(slots.start + slot).as_dvec3(),
            };
            for light in lights {
                sum += irradiance(job.shadows, light, receiver, normal.as_dvec3());
            }
        }
        for (channel, x) in sum.to_array().into_iter().enumerate() {
            out[channel * count + slot] = x;
        }
    }
}

/// All beams, and which of them light each listed block.
struct LitBlocks<'a> {
    lights: &'a [PlacedLight],
    beams: &'a [Beam],
    /// Ascending.
    hits: &'a [Hit],
}

impl LitBlocks<'_> {
    /// Direct light of one block, beam by beam.
    fn light_block<V: Visibility>(
        &self,
        job: &DirectJob<'_, V>,
        block: BlockRank,
        out: &mut [f32],
    ) {
        out.fill(0.0);
        let hits = self.hits;
        let start = hits.partition_point(|hit| hit.block < block);
        let end = start + hits[start..].partition_point(|hit| hit.block == block);
        let texels = texels_of(job.scene, block);
        let count = texels.normals[0].len();
        let (red, rest) = out.split_at_mut(count);
        let (green, blue) = rest.split_at_mut(count);
        let beam = |hit: &Hit| &self.beams[hit.beam as usize];
        let simd: SimdLevel = job.config.simd;
        for of_light in hits[start..end].chunk_by(|a, b| beam(a).light == beam(b).light) {
            let light = &self.lights[beam(&of_light[0]).light as usize];
            let mut out = [&mut *red, &mut *green, &mut *blue];
            // An exact beam replaces all beams of its light in the block.
            if of_light.iter().any(|hit| beam(hit).exact) {
                let shadows = Shadows {
                    level: job.shadows.level,
                    doors: job.shadows.doors,
                    visibility: &Openings,
                };
                let index = job.scene.layout.order[block.get()];
                add_exact(shadows, index, &texels, light, out);
                continue;
            }
            for hit in of_light {
                let out = out.each_mut().map(|channel| &mut **channel);
                add_beam(simd, &texels, light, beam(hit), out);
            }
        }
    }
}

/// Replaces values, and finds the largest value and change.
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
