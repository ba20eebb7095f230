//! Compares frames with each instruction set of this machine with the scalar reference, and with recorded bits. It depends
//! on few crates, so that it can run under emulation too.

use glam::{Vec3, vec3};
use mrt_core::simd::SimdLevel;
use mrt_core::storage::Storage;
use mrt_runtime::blocks::{Door, maze};
use mrt_runtime::{
    AssembleConfig, Bounces, Dictionary, Frame, FrameConfig, Light, Outputs, ProbeOrder, Scene,
};

/// Largest difference between instruction sets, as a share of the brightest texel: sums of some hundred products in another
/// order, in `f32`.
const ROUNDING: f32 = 1e-5;

fn dictionary() -> Dictionary {
    let bytes = include_bytes!("../../assets/versions/2.mrt");
    Dictionary::from_bytes(bytes).expect("sound")
}

#[test]
fn every_level_gives_the_light_of_the_scalar_reference() {
    let dictionary = dictionary();
    let level = maze(9, vec3(0.7, 0.5, 0.3), 3);
    let lamp = |block: usize, intensity: Vec3| Light::Sphere {
        // No line from the lamp to a texel meets an edge of an opening, so rounding does not decide whether a texel is lit.
        position: level.blocks[block].warp.center().as_vec3() + vec3(0.113, 0.207, -0.154),
        radius: 0.1,
        intensity,
    };
    let lights = [lamp(0, vec3(1.0, 2.0, 3.0)), lamp(7, Vec3::ONE)];
    for storage in Storage::ALL {
        let config = AssembleConfig {
            shape_storage: storage,
            transport_storage: storage,
            ..AssembleConfig::default()
        };
        let scene = Scene::assemble(&level, &dictionary, &config).expect("it fits");
        let lit = |simd: SimdLevel, bounces: Bounces| {
            let config = FrameConfig {
                simd,
                ..FrameConfig::default()
            };
            let mut frame = Frame::new(&scene, config);
            frame.set_lights(&lights);
            frame.set_bounces(bounces);
            for _ in 0..3 {
                let report = frame.solve();
                assert_eq!(report.skipped_lights(), [], "the lights are sound");
            }
            let (mut direct, mut indirect) = (Vec::new(), Vec::new());
            frame.copy_direct_to(&mut direct);
            frame.copy_indirect_to(&mut indirect);
            [direct, indirect].concat()
        };
        for bounces in [Bounces::Count(1), Bounces::Count(3), Bounces::Feedback] {
            let expected = lit(SimdLevel::Scalar, bounces);
            let brightest = expected.iter().fold(0.0f32, |m, &e| m.max(e));
            assert!(brightest > 0.0);
            for simd in SimdLevel::available() {
                let found = lit(simd, bounces);
                let apart = expected
                    .iter()
                    .zip(&found)
                    .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
                println!(
                    "{}, {}, {bounces:?}: {:.1e}",
                    simd.name(),
                    storage.name(),
                    apart / brightest
                );
                assert!(
                    apart <= ROUNDING * brightest,
                    "{simd:?}, {storage:?}, {bounces:?}: {apart}"
                );
            }
        }
    }
}

/// For each instruction set, a hash of all bits that frames compute with `f32`, `f16` and `int8`. It is the same in every
/// build and on every machine. Replace it when kernels change the order of their sums on purpose.
const HASHES: [(SimdLevel, u64); 5] = [
    (SimdLevel::Scalar, 0x6f90_eaaf_d940_b854),
    (SimdLevel::Sse2, 0x812c_453b_4262_f985),
    (SimdLevel::Avx2, 0xd709_67c2_72fb_f231),
    (SimdLevel::Avx512, 0x50e2_7b9c_5596_241e),
    (SimdLevel::Neon, 0x86dd_6f00_8711_7f07),
];

/// The hash FNV-1a of Fowler, Noll and Vo, continued over more values.
fn hash(hash: u64, values: &[f32]) -> u64 {
    let bytes = values.iter().flat_map(|x| x.to_bits().to_le_bytes());
    bytes.fold(hash, |h, byte| {
        (h ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    })
}

fn hash_of(dictionary: &Dictionary, simd: SimdLevel) -> u64 {
    let mut level = maze(13, vec3(0.9, 0.5, 0.2), 5);
    level.doors.push(Door {
        connection: 3,
        value: 0.4,
    });
    let mut sum = 0xcbf2_9ce4_8422_2325;
    for storage in Storage::ALL {
        let config = AssembleConfig {
            shape_storage: storage,
            transport_storage: storage,
            ..AssembleConfig::default()
        };
        let scene = Scene::assemble(&level, dictionary, &config).expect("it fits");
        let config = FrameConfig {
            simd,
            outputs: Outputs {
                probes: Some(ProbeOrder::L2),
                ..Outputs::default()
            },
            ..FrameConfig::default()
        };
        let mut frame = Frame::new(&scene, config);
        // Direct light from the caller, so that no library's square root takes part.
        let light = |k: usize| ((k * 7919 + 13) % 2048) as f32 / 2048.0;
        let direct: Vec<f32> = (0..3 * scene.texel_count()).map(light).collect();
        for bounces in [Bounces::Count(1), Bounces::Feedback, Bounces::Count(4)] {
            frame.set_bounces(bounces);
            let solved = frame.solve_from_direct(&direct);
            solved.expect("the direct light is sound");
            let mut copy = Vec::new();
            frame.copy_coefficients_to(&mut copy);
            sum = hash(sum, &copy);
            frame.copy_indirect_to(&mut copy);
            sum = hash(sum, &copy);
            sum = hash(sum, frame.lightmap().pixels().as_flattened());
            sum = hash(sum, frame.probes().expect("baked").values().as_flattened());
        }
    }
    sum
}

#[test]
fn the_bits_of_each_level_stay_as_they_are() {
    let dictionary = dictionary();
    let mut wrong = Vec::new();
    for simd in SimdLevel::available() {
        let found = hash_of(&dictionary, simd);
        let expected = HASHES
            .iter()
            .find(|known| known.0 == simd)
            .map(|known| known.1);
        if expected != Some(found) {
            wrong.push(format!("{}: {found:#018x}", simd.name()));
        }
    }
    assert!(wrong.is_empty(), "other bits than recorded: {wrong:?}");
}
