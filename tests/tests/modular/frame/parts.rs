//! Frames that are cut into parts, by slices or threads or the order of blocks, show the same light.

use glam::Vec3;
use mrt_runtime::blocks::{Block, maze};
use mrt_runtime::executor::Executor;
use mrt_runtime::{Bounces, Frame, FrameConfig, Level, Light, Outputs, ProbeOrder, Scene};
use mrt_tests::{
    FrameForTests, Random, by_texel, corridor, difference, floor_plan, largest_apart,
    largest_difference, mobile, random_level, random_lights, random_position, relative_difference,
    solved, with_outputs,
};
use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

const CONVERGED: Bounces = Bounces::Converged {
    tolerance: 1e-4,
    limit: 50,
};

fn sliced(scene: &Scene, slice: usize) -> Frame {
    let config = FrameConfig {
        slice: NonZero::new(slice),
        ..FrameConfig::default()
    };
    Frame::new(scene, config)
}

/// A lamp of about a watt at a random place: not bright enough for a channel to be scaled down.
fn lamp(random: &mut Random, level: &Level) -> Light {
    let position = random_position(random, level, 0.0);
    Light::sphere(position, 0.3, Vec3::new(1.0, 0.5, 0.25))
}

/// Once lights stand still, direct light is complete after `blocks / slice` frames, and one bounce after as many frames
/// again. If there was more light before, light was scaled down meanwhile, and a third round corrects this.
#[test]
fn slices_show_the_same_light_after_as_many_frames_as_stated() {
    for seed in 0..20 {
        let mut random = Random(seed);
        let blocks = 1 + random.below(40);
        let level = maze(blocks, Vec3::new(0.7, 0.5, 0.9), seed);
        let scene = mobile(&level);
        for slice in [1, 3, 16, 1000] {
            let mut frame = sliced(&scene, slice);
            // Some light that was there before.
            for _ in 0..random.below(6) {
                let lights = [lamp(&mut random, &level), lamp(&mut random, &level)];
                frame.light_with(&lights, Bounces::Count(1));
            }
            let lights = [lamp(&mut random, &level)];
            let expected = solved(&scene, &lights, Bounces::Count(1));
            let mut needed = 0;
            let mut frames = 0;
            let mut limited = 0;
            while frames < 3 * blocks.div_ceil(slice) {
                frame.light_with(&lights, Bounces::Count(1));
                assert!(frame.work().targets <= slice && frame.work().direct <= slice);
                frames += 1;
                limited += usize::from(frame.work().limited > 0);
                if difference(&frame, &expected).is_some() {
                    needed = frames + 1;
                }
            }
            let apart = difference(&frame, &expected);
            println!("{blocks} blocks, slices of {slice}: {needed} frames, {limited} scaled");
            assert_eq!(
                apart, None,
                "seed {seed}, {blocks} blocks, slices of {slice}"
            );
            if limited == 0 {
                assert!(needed <= 2 * blocks.div_ceil(slice) + 1);
            }
        }
    }
}

/// In slices, a block shows light that it showed without slices in one of the last `blocks / slice` frames, however light
/// changes. Direct light is the caller's here, so that only bounces wait.
#[test]
fn no_block_waits_longer_than_stated() {
    for (blocks, slice) in [(12, 1), (12, 5), (30, 4), (30, 29)] {
        let scene = mobile(&maze(blocks, Vec3::splat(0.5), 3));
        let stated = blocks.div_ceil(slice);
        let mut random = Random(blocks as u64);
        let mut frame = sliced(&scene, slice);
        let mut unsliced = Frame::new(&scene, FrameConfig::default());
        let mut history: Vec<Vec<f32>> = Vec::new();
        let mut oldest = 0;
        for step in 0..120 {
            // The amount of light hardly changes between frames; otherwise blocks that wait would be scaled down.
            let light = |_| 1.0 + 0.05 * random.unit() as f32;
            let direct: Vec<f32> = (0..3 * scene.texel_count()).map(light).collect();
            for frame in [&mut frame, &mut unsliced] {
                frame.light_from(&direct, Bounces::Count(1));
            }
            history.push(unsliced.indirect());
            let shown = frame.indirect();
            for block in &scene.level.blocks {
                let range = 3 * block.texels.start..3 * block.texels.end;
                let shown = &shown[range.clone()];
                let age = (0..history.len())
                    .find(|age| history[history.len() - 1 - age][range.clone()] == *shown);
                // A block is dark until its first turn.
                let first = step < stated && shown.iter().all(|&e| e == 0.0);
                match age {
                    Some(age) => oldest = oldest.max(age),
                    None => assert!(first, "{blocks}/{slice}, frame {step}: no such light"),
                }
            }
        }
        println!("{blocks} blocks, slices of {slice}: {oldest} frames old, stated {stated}");
        assert!(oldest < stated, "{oldest} of {stated}");
    }
}

/// Two lamps are at the two ends of a long corridor, and only one of them moves.
#[test]
fn in_slices_light_that_stands_still_is_not_dimmed() {
    let scene = mobile(&floor_plan(&corridor(30), 0.5));
    let lamp = |x: f32| Light::sphere(Vec3::new(x, 0.5, 0.5), 0.3, Vec3::ONE);
    let mut frame = sliced(&scene, 4);
    let of_first = 0..3 * scene.level.blocks[0].texels.end;
    let mut still = None;
    for step in 0..60 {
        let x = if step < 30 { 20.5 } else { 26.5 };
        frame.light_with(&[lamp(0.5), lamp(x)], Bounces::Count(1));
        let now = frame.indirect()[of_first.clone()].to_vec();
        if step == 29 {
            still = Some(now);
        } else if let Some(still) = &still {
            // The lamp that moves makes 1e-4 of this light. Without care, frames in slices would dim it by a quarter.
            let apart = largest_apart(&now, still);
            let brightest = still.iter().fold(0.0f32, |m, &e| m.max(e));
            assert!(
                apart < 1e-3 * brightest,
                "frame {step}: {apart} of {brightest}"
            );
        }
    }
}

/// Rounding keeps both frames in motion. Measured: 7e-8 apart.
#[test]
fn feedback_in_slices_converges_to_the_same_light() {
    const BOUND: f64 = 1e-6;
    for (blocks, slice) in [(9, 1), (25, 4), (25, 24)] {
        let level = maze(blocks, Vec3::splat(0.6), 11);
        let scene = mobile(&level);
        let lights = [lamp(&mut Random(4), &level)];
        let mut expected = Frame::new(&scene, FrameConfig::default());
        let limit = 200;
        for _ in 0..limit {
            expected.light_with(&lights, Bounces::Feedback);
        }
        let mut frame = sliced(&scene, slice);
        for _ in 0..limit * blocks.div_ceil(slice) {
            frame.light_with(&lights, Bounces::Feedback);
            assert!(frame.work().targets <= slice);
        }
        let apart = relative_difference(&frame.indirect(), &expected.indirect());
        println!("{blocks} blocks, slices of {slice}: {apart:.1e} apart");
        assert!(apart < BOUND, "{apart}");
    }
}

/// Runs tasks in reverse order: on threads that each take the last task that is left, or on the caller's thread if there are
/// no others.
#[derive(Debug)]
struct Backwards {
    threads: usize,
    /// Tasks so far.
    tasks: AtomicUsize,
}

impl Executor for Backwards {
    fn workers(&self) -> usize {
        self.threads.max(2)
    }

    fn run(&self, tasks: usize, task: &(dyn Fn(usize) + Sync)) {
        self.tasks.fetch_add(tasks, Ordering::Relaxed);
        if self.threads == 0 {
            (0..tasks).rev().for_each(task);
            return;
        }
        let left = AtomicUsize::new(tasks);
        let take_last = |k: usize| k.checked_sub(1);
        std::thread::scope(|scope| {
            for _ in 0..self.threads {
                scope.spawn(|| {
                    while let Ok(k) =
                        left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take_last)
                    {
                        task(k - 1);
                    }
                });
            }
        });
    }
}

const ALL_OUTPUTS: Outputs = Outputs {
    lightmap: true,
    probes: Some(ProbeOrder::L1),
    vector: false,
};

#[test]
fn the_number_of_threads_changes_no_bit() {
    for seed in 0..6 {
        let mut random = Random(seed);
        let level = random_level(&mut random, 60);
        let scene = mobile(&level);
        let executors: Vec<Arc<Backwards>> = [0, 1, 2, 3, 7, 64]
            .into_iter()
            .map(|threads| {
                Arc::new(Backwards {
                    threads,
                    tasks: AtomicUsize::new(0),
                })
            })
            .collect();
        let config = |executor: &Arc<Backwards>| FrameConfig {
            outputs: ALL_OUTPUTS,
            executor: executor.clone(),
            ..FrameConfig::default()
        };
        let mut serial = with_outputs(&scene, ALL_OUTPUTS);
        let mut frames: Vec<Frame> = executors
            .iter()
            .map(|executor| Frame::new(&scene, config(executor)))
            .collect();
        for step in 0..10 {
            let lights = random_lights(&mut random, &level, &scene, 4);
            let bounces = [
                Bounces::Count(1),
                Bounces::Count(3),
                Bounces::Feedback,
                Bounces::Feedback,
                CONVERGED,
            ][step % 5];
            serial.light_with(&lights, bounces);
            for (frame, executor) in frames.iter_mut().zip(&executors) {
                frame.light_with(&lights, bounces);
                let apart = difference(frame, &serial);
                assert_eq!(apart, None, "seed {seed}, {bounces:?}, {executor:?}");
                assert_eq!(frame.work(), serial.work());
            }
        }
        for executor in &executors {
            assert!(executor.tasks.load(Ordering::Relaxed) > 0, "{executor:?}");
        }
    }
}

/// Has more workers whenever it is asked, like a pool of threads that grows after the frame was made.
#[derive(Debug, Default)]
struct Growing(AtomicUsize);

impl Executor for Growing {
    fn workers(&self) -> usize {
        1 + self.0.fetch_add(1, Ordering::Relaxed) / 3
    }

    fn run(&self, tasks: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..tasks).for_each(task);
    }
}

#[test]
fn an_executor_that_grows_loses_no_block() {
    let level = maze(40, Vec3::splat(0.5), 1);
    let scene = mobile(&level);
    let config = FrameConfig {
        executor: Arc::new(Growing::default()),
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    let mut serial = Frame::new(&scene, FrameConfig::default());
    let mut random = Random(6);
    for _ in 0..10 {
        let lights: Vec<Light> = (0..5).map(|_| lamp(&mut random, &level)).collect();
        for frame in [&mut frame, &mut serial] {
            frame.light_with(&lights, Bounces::Count(2));
        }
        assert_eq!(difference(&frame, &serial), None);
    }
}

/// Tolerance for sums of `f32` over sources in another order. Measured over twenty bounces: 2e-7.
const REORDERED: f64 = 2e-6;

/// The level with its blocks in another order: block k of the result is block `order[k]`.
fn reordered(level: &Level, order: &[usize]) -> Level {
    let mut place = vec![0; order.len()];
    for (k, &block) in order.iter().enumerate() {
        place[block] = k;
    }
    let blocks: Vec<Block> = order.iter().map(|&k| level.blocks[k].clone()).collect();
    let mut level = level.clone();
    level.blocks = blocks;
    for connection in &mut level.connections {
        connection.a.block = place[connection.a.block];
        connection.b.block = place[connection.b.block];
    }
    level
}

#[test]
fn the_order_of_blocks_does_not_matter() {
    let mut worst = 0.0f64;
    for seed in 0..12 {
        let mut random = Random(seed);
        let blocks = 2 + random.below(40);
        let level = random_level(&mut random, blocks);
        let scene = mobile(&level);
        let lights = random_lights(&mut random, &level, &scene, 5);
        let mut order: Vec<usize> = (0..blocks).collect();
        random.shuffle(&mut order);
        let other = mobile(&reordered(&level, &order));
        for bounces in [Bounces::Count(1), Bounces::Count(20)] {
            let lit = |scene: &Scene| by_texel(scene, &solved(scene, &lights, bounces).indirect());
            let (expected, found) = (lit(&scene), lit(&other));
            let mut in_order = vec![[0.0; 3]; found.len()];
            for (k, &block) in order.iter().enumerate() {
                let (to, from) = (
                    &scene.level.blocks[block].texels,
                    &other.level.blocks[k].texels,
                );
                in_order[to.clone()].copy_from_slice(&found[from.clone()]);
            }
            let apart = largest_difference(&in_order, &expected);
            worst = worst.max(apart);
            assert!(apart < REORDERED, "seed {seed}, {bounces:?}: {apart}");
        }
    }
    println!("{worst:.1e} of the brightest");
}

#[test]
fn a_slice_as_large_as_the_level_is_a_whole_frame() {
    let scene = mobile(&floor_plan(&corridor(1), 0.5));
    let lights = [Light::sphere(Vec3::splat(0.4), 0.1, Vec3::ONE)];
    let mut frame = sliced(&scene, 1);
    frame.light_with(&lights, Bounces::Count(1));
    let expected = solved(&scene, &lights, Bounces::Count(1));
    assert_eq!(difference(&frame, &expected), None);
}
