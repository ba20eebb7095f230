//! What a game relies on in the facade of the runtime: ids of lights, reports, tiles, queries, and scenes that change.

use glam::{DVec3, Vec2, Vec3, vec3};
use mrt_core::storage::f16;
use mrt_runtime::blocks::Shape;
use mrt_runtime::{
    BlockIndex, Bounces, Frame, FrameConfig, FrameReport, Level, Light, LightError, Outputs,
    ProbeOrder, Scene, Tile,
};
use mrt_tests::{
    FrameForTests, Random, assembled, corridor, floor_plan, mobile, random_level,
    relative_difference, with_outputs,
};
use std::collections::BTreeSet;

fn scene_of_corridor(blocks: i32) -> Scene {
    assembled(&floor_plan(&corridor(blocks), 0.5))
}

fn lamp(x: f32) -> Light {
    Light::sphere(vec3(x, 0.6, 0.4), 0.1, Vec3::ONE)
}

/// A light outside all blocks.
fn outside() -> Light {
    Light::sphere(vec3(0.5, 5.0, 0.5), 0.1, Vec3::ONE)
}

/// A new frame with one bounce and without feedback.
fn one_bounce(scene: &Scene) -> Frame {
    let config = FrameConfig {
        bounces: Bounces::Count(1),
        ..FrameConfig::default()
    };
    Frame::new(scene, config)
}

#[test]
fn scenes_and_reports_are_shared_between_threads_and_frames_are_sent() {
    fn shared<T: Send + Sync>() {}
    fn sent<T: Send>() {}
    shared::<Scene>();
    shared::<FrameReport>();
    sent::<Frame>();
    let scene = scene_of_corridor(2);
    assert!(scene.is_same(&scene.clone()));
    assert!(!scene.is_same(&scene_of_corridor(2)));
}

#[test]
fn removing_a_light_disturbs_no_other() {
    // Two corridors that are not connected, each with a lamp.
    let cells: Vec<[i32; 3]> = [0, 1, 2, 9, 10, 11].map(|x| [x, 0, 0]).to_vec();
    let level = Level::from_cells(&cells, Vec3::splat(0.5)).expect("cells in rows");
    let scene = assembled(&level);
    let mut frame = one_bounce(&scene);
    let [first, second] = [lamp(0.5), lamp(10.5)].map(|light| frame.add_light(light));
    frame.solve();
    let before = frame.indirect();
    assert_eq!(frame.remove_light(first), Some(lamp(0.5)));
    let report = frame.solve();
    assert!(report.work().direct <= 3, "{:?}", report.work());
    let (left, right) = (3 * scene.level.blocks[3].texels.start, before.len());
    let after = frame.indirect();
    assert!(after[..left].iter().all(|&e| e == 0.0));
    assert!(after[left..right] == before[left..right]);
    // The id of a removed light never names another light.
    let third = frame.add_light(lamp(1.5));
    assert_eq!(frame.light(first), None);
    assert!(!frame.set_light(first, lamp(2.5)) && frame.remove_light(first).is_none());
    assert_eq!(frame.light(second), Some(lamp(10.5)));
    let ids: BTreeSet<_> = frame.light_ids().collect();
    assert_eq!(ids, BTreeSet::from([second, third]));
}

#[test]
fn a_torch_that_clips_a_wall_is_skipped_and_comes_back() {
    let scene = scene_of_corridor(3);
    let mut frame = one_bounce(&scene);
    let torch = frame.add_light(lamp(0.5));
    let other = frame.add_light(lamp(2.5));
    frame.solve();
    let both = frame.indirect();
    frame.set_light(torch, outside());
    let report = frame.solve();
    let [skipped] = report.skipped_lights() else {
        panic!("{:?}", report.skipped_lights());
    };
    assert_eq!(skipped.id, torch);
    assert!(matches!(skipped.reason, LightError::OutsideBlocks { .. }));
    assert!(report.require_all_lights().is_err());
    let mut alone = one_bounce(&scene);
    alone.add_light(lamp(2.5));
    alone.solve();
    assert!(
        frame.indirect() == alone.indirect(),
        "the other lamp still shines"
    );
    frame.set_light(torch, lamp(0.5));
    assert_eq!(frame.solve().skipped_lights(), []);
    assert!(frame.indirect() == both);
    assert!(frame.light(other).is_some());
}

/// A report stays as it is when the frame is solved again.
#[test]
fn reports_are_snapshots() {
    let scene = scene_of_corridor(2);
    let mut frame = one_bounce(&scene);
    let torch = frame.add_light(outside());
    let first = frame.solve();
    frame.set_light(torch, lamp(0.5));
    let second = frame.solve();
    assert_eq!(first.skipped_lights().len(), 1);
    assert_eq!(second.skipped_lights(), []);
    assert!(first.changed_tiles().len() == 0 && second.changed_tiles().len() > 0);
}

#[test]
fn all_pixels_that_changed_are_in_changed_tiles() {
    let scene = scene_of_corridor(12);
    let mut frame = one_bounce(&scene);
    let torch = frame.add_light(lamp(0.3));
    let mut mirror = vec![[0.0f32; 3]; frame.lightmap().pixels().len()];
    let mut tiles = 0;
    for step in 0..8 {
        frame.set_light(torch, lamp(0.3 + 0.2 * (step / 2) as f32));
        let report = frame.solve();
        let width = frame.lightmap().width();
        for Tile { x, y, size } in report.changed_tiles() {
            for row in y..y + size {
                let row = row * width + x;
                mirror[row..row + size]
                    .copy_from_slice(&frame.lightmap().pixels()[row..row + size]);
            }
        }
        assert!(mirror == frame.lightmap().pixels(), "step {step}");
        tiles = report.changed_tiles().len();
        if step % 2 == 1 {
            assert_eq!(tiles, 0, "nothing moved");
            assert!(report.changed_blocks().is_empty());
        } else {
            assert!(tiles > 0 && !report.changed_blocks().is_empty());
        }
    }
    assert_eq!(tiles, 0);
}

#[test]
fn tiles_are_written_in_the_formats_of_textures() {
    let scene = scene_of_corridor(2);
    let mut frame = one_bounce(&scene);
    frame.add_light(lamp(0.5));
    let report = frame.solve();
    let (mut halves, mut shared) = (Vec::new(), Vec::new());
    for tile in report.changed_tiles() {
        frame.lightmap().write_rgba16f(tile, &mut halves);
        frame.lightmap().write_rgb9e5(tile, &mut shared);
        assert_eq!(halves.len(), tile.size * tile.size);
        assert_eq!(shared.len(), tile.size * tile.size);
        for (k, (half, shared)) in halves.iter().zip(&shared).enumerate() {
            let at = (tile.y + k / tile.size) * frame.lightmap().width() + tile.x + k % tile.size;
            let exact = frame.lightmap().pixels()[at];
            let most = exact.into_iter().fold(0.0, f32::max);
            let step = f32::from_bits(((shared >> 27) + 127 - 24) << 23);
            for channel in 0..3 {
                let of_half = f16::from_bits(half[channel]).to_f32();
                // Halves have eleven significant bits, and fewer below 2^-14.
                assert!((of_half - exact[channel]).abs() <= exact[channel] / 2048.0 + 3e-8);
                let mantissa = (shared >> (9 * channel)) & 511;
                assert!((mantissa as f32 * step - exact[channel]).abs() <= most / 511.0 + 3e-8);
            }
            assert_eq!(half[3], 0x3c00);
        }
    }
    let beside = Tile {
        x: frame.lightmap().width(),
        y: 0,
        size: 4,
    };
    frame.lightmap().write_rgba16f(beside, &mut halves);
    frame.lightmap().write_rgb9e5(beside, &mut shared);
    assert!(halves.is_empty() && shared.is_empty());
}

#[test]
fn queries_beyond_the_level_are_none() {
    let scene = scene_of_corridor(2);
    let mut frame = one_bounce(&scene);
    frame.add_light(lamp(0.5));
    frame.solve();
    let texels = scene.level.blocks[0].texels.len();
    let (here, beyond) = (BlockIndex::new(0), BlockIndex::new(2));
    assert!(frame.indirect_at(here, texels - 1).is_some());
    for (block, texel) in [
        (here, texels),
        (beyond, 0),
        (BlockIndex::new(usize::MAX), 0),
    ] {
        assert_eq!(frame.indirect_at(block, texel), None);
        assert_eq!(frame.direct_at(block, texel), None);
        assert_eq!(frame.texel_albedo(block, texel), None);
        assert_eq!(frame.texel_emission(block, texel), None);
        assert_eq!(frame.vector_at(block, texel, Vec3::Z), None);
        assert!(frame.set_texel_albedo(beyond, &[Vec3::ONE]).is_err());
    }
    // The frame was not asked for probes.
    assert_eq!(frame.irradiance_at(vec3(0.5, 0.5, 0.5), Vec3::Y), None);
    let outputs = Outputs {
        lightmap: false,
        probes: Some(ProbeOrder::L1),
        vector: true,
    };
    let mut frame = with_outputs(&scene, outputs);
    frame.add_light(lamp(0.5));
    let report = frame.solve();
    assert_eq!(report.changed_tiles().len(), 0);
    assert!(frame.lightmap().pixels().is_empty());
    assert_eq!(frame.lightmap().sample(Vec2::splat(0.5)), [0.0; 3]);
    let inside = frame.irradiance_at(vec3(0.5, 0.5, 0.5), Vec3::Y);
    assert!(inside.expect("inside").min_element() > 0.0);
    for outside in [vec3(0.5, 1.5, 0.5), vec3(-3.0, 0.5, 0.5), Vec3::NAN] {
        assert_eq!(frame.irradiance_at(outside, Vec3::Y), None);
    }
}

#[test]
fn the_block_of_a_point_is_that_of_a_search_through_all_blocks() {
    for seed in 0..12 {
        let mut random = Random(seed);
        let scene = mobile(&random_level(&mut random, 40));
        let bounds = scene.level.blocks.iter().map(|block| block.bounds);
        let (low, high) = bounds
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            .expect("blocks");
        let mut inside = 0;
        for _ in 0..2000 {
            let unit = DVec3::new(random.unit(), random.unit(), random.unit());
            let point = low - 0.1 + (high - low + 0.2) * unit;
            let contains = |slack: f64| {
                scene.level.blocks.iter().position(|block| {
                    let round = block.shape.tube().is_some();
                    let unit = block.unit_from_world.point(point);
                    block.warp.contains(point, slack)
                        && (!round || Shape::is_inside_walls(block.shape, unit, slack))
                })
            };
            let expected = contains(0.0).or_else(|| contains(1e-4));
            let found = scene.level.block_at(point);
            assert_eq!(found.map(BlockIndex::get), expected, "seed {seed}, {point}");
            inside += usize::from(expected.is_some());
        }
        assert!(inside > 20, "{inside}");
    }
}

/// When blocks are added or removed, other blocks keep their light, and feedback brings it up to date.
#[test]
fn light_goes_on_in_a_scene_with_other_blocks() {
    let (short, long) = (scene_of_corridor(5), scene_of_corridor(6));
    let mut frame = Frame::new(&short, FrameConfig::default());
    let torch = frame.add_light(lamp(2.5));
    for _ in 0..200 {
        frame.solve();
    }
    let middle = |frame: &Frame| {
        let texels = frame.scene().level.blocks[2].texels.clone();
        frame.indirect()[3 * texels.start..3 * texels.end].to_vec()
    };
    let before = middle(&frame);
    let old = |block: BlockIndex| (block.get() < 5).then_some(block);
    frame.change_scene(&long, old);
    assert!(frame.scene().is_same(&long));
    assert_eq!(frame.light(torch), Some(lamp(2.5)));
    let sum = |light: &[f32]| light.iter().sum::<f32>();
    for step in 0..3 {
        assert_eq!(frame.solve().skipped_lights(), []);
        // No block becomes dark meanwhile. The end of the corridor sends back a few percent of this light.
        let now = sum(&middle(&frame)) / sum(&before);
        assert!((0.9..1.1).contains(&now), "frame {step}: {now}");
    }
    for _ in 0..200 {
        frame.solve();
    }
    let mut fresh = Frame::new(&long, FrameConfig::default());
    fresh.add_light(lamp(2.5));
    for _ in 0..200 {
        fresh.solve();
    }
    // Both have converged up to rounding.
    let (now, expected) = (middle(&frame), middle(&fresh));
    assert!(relative_difference(&now, &expected) < 1e-5);
    // And back again, to a scene in which the torch is outside all blocks.
    frame.change_scene(&scene_of_corridor(2), |_| None);
    let report = frame.solve();
    assert_eq!(report.skipped_lights().len(), 1);
    assert!(frame.indirect().iter().all(|&e| e == 0.0));
}

/// When colours change, light continues from the light before. It converges to that of a frame which always had them.
#[test]
fn colours_change_without_a_flash() {
    let scene = scene_of_corridor(4);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    frame.add_light(lamp(1.5));
    for _ in 0..100 {
        frame.solve();
    }
    let sum = |frame: &Frame| frame.indirect().iter().sum::<f32>();
    let before = sum(&frame);
    let block = BlockIndex::new(1);
    let texels = scene.level.blocks[1].texels.len();
    let colours = vec![vec3(0.6, 0.5, 0.4); texels];
    frame.set_texel_albedo(block, &colours).expect("in range");
    frame.solve();
    let change = sum(&frame) / before;
    assert!((0.8..1.2).contains(&change), "{change}");
    for _ in 0..100 {
        frame.solve();
    }
    let mut fresh = Frame::new(&scene, FrameConfig::default());
    fresh.set_texel_albedo(block, &colours).expect("in range");
    fresh.add_light(lamp(1.5));
    for _ in 0..100 {
        fresh.solve();
    }
    let apart = (sum(&frame) / sum(&fresh) - 1.0).abs();
    assert!(apart < 1e-5, "{apart}");
}
