//! Probes hold the light of the walls in world axes, continuous from block to block.

use glam::{DMat3, DVec3, Vec3, vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::lighting::sh;
use mrt_core::storage::f16;
use mrt_runtime::low_level::output::probes::irradiance_from_probe;
use mrt_runtime::{
    BlockIndex, Bounces, Dictionary, Frame, Level, Light, Outputs, ProbeOrder, Scene,
};
use mrt_tests::{FrameForTests, baked, scene_of, set_lightfields, turned_cells, with_outputs};
use std::sync::OnceLock;

/// Texels along an edge of a wall.
const RESOLUTION: usize = 8;

const CORRIDOR: [[i32; 3]; 3] = [[0, 0, 0], [1, 0, 0], [1, 0, 1]];

const LAMP: Vec3 = vec3(0.5, 0.6, 0.4);

fn dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("standard", "cubes-2d", |config| {
            config.resolution = RESOLUTION;
            config.modes = 64;
            config.coupling.foreign_modes = 64;
            config.coupling.depth = 3;
            set_lightfields(config, 4, 8, 32);
        })
    })
}

fn scene_of_cells(cells: &[[i32; 3]]) -> Scene {
    let level = Level::from_cells(cells, Vec3::splat(0.6)).expect("cells side by side are a level");
    scene_of(&level, dictionary())
}

fn lit(scene: &Scene, position: Vec3, order: ProbeOrder) -> Frame {
    let outputs = Outputs {
        lightmap: true,
        probes: Some(order),
        vector: false,
    };
    let mut frame = with_outputs(scene, outputs);
    let lamp = Light::sphere(position, 0.1, Vec3::new(1.0, 0.5, 0.25));
    frame.light_with(&[lamp], Bounces::Count(8));
    frame
}

/// The nine coefficients of a frame's light at a point.
fn probe_at(frame: &Frame, point: DVec3) -> [[f32; 3]; 9] {
    let probes = frame.probes().expect("the frame was asked for probes");
    let light = probes.at(&frame.scene().level, point);
    light.expect("the point is inside a block")
}

/// Relative error of a wall's mean irradiance. Light between the outermost probes and the wall is not quite linear, and nine
/// coefficients smooth it. Measured over the walls of three blocks: 5.6 % at worst, 2 % on average.
const WALL_BOUND: f64 = 0.07;

#[test]
fn probes_next_to_a_wall_give_its_irradiance() {
    let scene = scene_of_cells(&CORRIDOR);
    let frame = lit(&scene, LAMP, ProbeOrder::L2);
    let n = frame.probes().expect("asked for").per_axis();
    let mut worst = 0.0f64;
    for (index, block) in scene.level.blocks.iter().enumerate() {
        for wall in block.shape.walls() {
            // Compares means over the wall: of the layers of probes along it, and of its texels.
            let normal = block.warp.face_normal(wall, 0.5, 0.5).as_vec3();
            let layer = |depth: f64| {
                let light = |k: usize| {
                    let on_wall = wall.texel_center(n, k / n, k % n);
                    let point = on_wall - wall.outward() * (depth / n as f64);
                    let light = probe_at(&frame, block.warp.point(point));
                    f64::from(irradiance_from_probe(&light, normal).x)
                };
                (0..n * n).map(light).sum::<f64>() / (n * n) as f64
            };
            // Extrapolates from the two nearest layers to the wall.
            let by_probes = 1.5 * layer(0.5) - 0.5 * layer(1.5);
            let first = block.shape.wall_offset(wall, RESOLUTION).expect("a wall");
            let texel = |k: usize| {
                let light = frame.indirect_at(BlockIndex::new(index), first + k);
                f64::from(light.expect("a texel").x)
            };
            let count = RESOLUTION * RESOLUTION;
            let on_wall = (0..count).map(texel).sum::<f64>() / count as f64;
            let error = (by_probes / on_wall - 1.0).abs();
            println!("block {index} {wall}: {by_probes:.4} against {on_wall:.4}");
            worst = worst.max(error);
        }
    }
    assert!(worst <= WALL_BOUND, "{worst}");
}

#[test]
fn probes_are_continuous_where_blocks_join() {
    let scene = scene_of_cells(&CORRIDOR);
    let frame = lit(&scene, LAMP, ProbeOrder::L2);
    for k in 0..20 {
        let y = 0.05 + 0.045 * f64::from(k);
        let [before, after] =
            [-1e-7, 1e-7].map(|step| probe_at(&frame, DVec3::new(1.0 + step, y, 0.4)));
        for (a, b) in before.iter().flatten().zip(after.iter().flatten()) {
            // Weights of probes are `f32`.
            assert!((a - b).abs() <= 1e-5 * before[0][0], "{a} and {b} at {y}");
        }
    }
}

#[test]
fn turning_a_level_turns_its_probes() {
    let turn = CubeRotation::about_y(1);
    let turned = turned_cells(&CORRIDOR, turn);
    let (here, there) = (scene_of_cells(&CORRIDOR), scene_of_cells(&turned));
    let light = DVec3::new(0.3, 0.6, 0.4);
    // The first cell turns about its own middle.
    let turned_light = turn.point(light);
    let frames = [
        lit(&here, light.as_vec3(), ProbeOrder::L2),
        lit(&there, turned_light.as_vec3(), ProbeOrder::L2),
    ];
    let [x, y, z] = DVec3::AXES.map(|axis| turn.direction(axis));
    let bands = sh::rotation_matrices(3, &DMat3::from_cols(x, y, z));
    for cell in [DVec3::ZERO, DVec3::X] {
        let point = cell + DVec3::new(0.3, 0.55, 0.7);
        let moved = turn.direction(cell) + turn.point(point - cell);
        let (a, b) = (probe_at(&frames[0], point), probe_at(&frames[1], moved));
        let mut expected: Vec<f64> = a.iter().map(|rgb| f64::from(rgb[0])).collect();
        sh::rotate(&bands, &mut expected);
        for (e, b) in expected.iter().zip(&b) {
            // These are sums of 128 products of operators that agree in single precision.
            assert!((e - f64::from(b[0])).abs() <= 1e-4 * f64::from(a[0][0]));
        }
    }
}

#[test]
fn two_bands_are_the_first_of_three_and_half_precision_keeps_them() {
    let scene = scene_of_cells(&CORRIDOR);
    let frames = [ProbeOrder::L2, ProbeOrder::L1].map(|order| lit(&scene, LAMP, order));
    let [three, two] = frames
        .each_ref()
        .map(|frame| frame.probes().expect("asked for"));
    for (a, b) in three.values().chunks(9).zip(two.values().chunks(4)) {
        assert_eq!(&a[..4], b);
    }
    let mut halves = vec![[0u16; 3]; two.values().len()];
    two.write_f16(&mut halves);
    for (half, full) in halves.iter().flatten().zip(two.values().iter().flatten()) {
        let half = f16::from_bits(*half).to_f32();
        // Half a step of eleven bits. Below 6e-5, steps are 6e-8.
        assert!((half - full).abs() <= 4.9e-4 * full.abs() + 3e-8);
    }
}

#[test]
fn an_unconnected_block_has_dark_probes() {
    let mut level = Level::from_cells(&[[0, 0, 0], [2, 0, 0]], Vec3::splat(0.6)).expect("cells");
    level.connections.clear();
    let scene = scene_of(&level, dictionary());
    let frame = lit(&scene, LAMP, ProbeOrder::L2);
    let probes = frame.probes().expect("asked for");
    let half = probes.values().len() / 2;
    assert!(probes.values()[..half].iter().any(|rgb| rgb[0] > 0.0));
    assert!(probes.values()[half..].iter().flatten().all(|&x| x == 0.0));
    assert!(scene.level.blocks[0].shape.opening(Face::PosX).is_none());
}
