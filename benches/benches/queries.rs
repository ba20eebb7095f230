//! Queries of a frame in levels of ten and of ten thousand blocks, which are to take as long: light at a point for things
//! that move, and moving a light.

use divan::{Bencher, black_box};
use glam::{Vec3, vec3};
use mrt_runtime::blocks::maze;
use mrt_runtime::{
    AssembleConfig, Bounces, Dictionary, Frame, FrameConfig, Light, Outputs, ProbeOrder, Scene,
};
use std::sync::OnceLock;

const BLOCKS: [usize; 2] = [10, 10_000];

/// Points that are asked for in a sample.
const POINTS: usize = 1000;

fn main() {
    divan::main();
}

fn scene(blocks: usize) -> &'static Scene {
    static SCENES: [OnceLock<Scene>; 2] = [const { OnceLock::new() }; 2];
    let which = usize::from(blocks == BLOCKS[1]);
    SCENES[which].get_or_init(|| {
        let bytes = include_bytes!("../../assets/versions/2.mrt");
        let dictionary = Dictionary::from_bytes(bytes).expect("sound");
        // Queries do not depend on how far light is followed.
        let config = AssembleConfig {
            max_depth: 1,
            ..AssembleConfig::default()
        };
        let level = maze(blocks, Vec3::splat(0.5), 7);
        Scene::assemble(&level, &dictionary, &config).expect("a maze fits")
    })
}

fn frame(blocks: usize) -> Frame {
    let config = FrameConfig {
        outputs: Outputs {
            lightmap: false,
            probes: Some(ProbeOrder::L2),
            vector: false,
        },
        bounces: Bounces::Count(1),
        ..FrameConfig::default()
    };
    Frame::new(scene(blocks), config)
}

/// Points all over a level.
fn points(blocks: usize) -> Vec<Vec3> {
    let blocks = &scene(blocks).level.blocks;
    let inside = |k: usize| {
        let block = &blocks[k * 7919 % blocks.len()];
        block.warp.center().as_vec3() + vec3(0.11, -0.2, 0.17)
    };
    (0..POINTS).map(inside).collect()
}

#[divan::bench(args = BLOCKS)]
fn irradiance_at(bencher: Bencher, blocks: usize) {
    let (frame, points) = (frame(blocks), points(blocks));
    assert!(
        points
            .iter()
            .all(|&p| frame.irradiance_at(p, Vec3::Y).is_some())
    );
    let mut next = 0;
    bencher.bench_local(|| {
        next = (next + 1) % POINTS;
        frame.irradiance_at(black_box(points[next]), Vec3::Y)
    });
}

#[divan::bench(args = BLOCKS)]
fn set_light(bencher: Bencher, blocks: usize) {
    let (mut frame, points) = (frame(blocks), points(blocks));
    let torch = frame.add_light(Light::sphere(points[0], 0.1, Vec3::ONE));
    let mut next = 0;
    bencher.bench_local(|| {
        next = (next + 1) % POINTS;
        frame.set_light(
            torch,
            Light::sphere(black_box(points[next]), 0.1, Vec3::ONE),
        )
    });
    assert!(frame.solve().skipped_lights().is_empty());
}
