//! Instructions and storage: each level against the scalar reference, and kept numbers against `f32`.

use glam::Vec3;
use mrt_core::simd::SimdLevel;
use mrt_core::storage::Storage;
use mrt_runtime::blocks::maze;
use mrt_runtime::{
    AssembleConfig, Bounces, Dictionary, Frame, FrameConfig, Level, Light, Outputs, ProbeOrder,
    Scene,
};
use mrt_tests::FrameForTests;
use mrt_tests::sequences::{
    STORAGES, mobile_dictionary, outputs, random_level, random_lights, stored, vector_dictionary,
};
use mrt_tests::{Random, by_texel, default_dictionary, largest_difference};

const OUTPUTS: Outputs = Outputs {
    lightmap: true,
    probes: Some(ProbeOrder::L2),
    vector: true,
};

fn frame_of(scene: &Scene, simd: SimdLevel) -> Frame {
    let config = FrameConfig {
        outputs: OUTPUTS,
        simd,
        ..FrameConfig::default()
    };
    Frame::new(scene, config)
}

/// Lanes add up in another order: a few roundings of `f32`, of the largest number. Measured: 8e-7 at
/// most, over twelve bounces.
const ROUNDING: f64 = 3e-6;

/// Largest difference of each output from the scalar reference's, over its largest number.
fn apart(frame: &Frame, scalar: &Frame) -> Vec<(&'static str, f64)> {
    let pairs = outputs(frame).into_iter().zip(outputs(scalar));
    pairs
        .map(|((name, a), (_, b))| {
            let triples = |x: &[f32]| x.iter().map(|&x| [x; 3]).collect::<Vec<_>>();
            (name, largest_difference(&triples(&a), &triples(&b)))
        })
        .collect()
}

fn compare_levels(dictionary: &Dictionary, blocks: usize, seeds: u64) {
    let mut worst = [("", 0.0f64); 6];
    for seed in 0..seeds {
        let mut random = Random(seed);
        let level = random_level(&mut random, blocks);
        for storage in STORAGES {
            let scene = stored(&level, dictionary, storage);
            let lights: Vec<Light> = random_lights(&mut random, &level, &scene, 5);
            for bounces in [Bounces::Count(1), Bounces::Count(12)] {
                let mut scalar = frame_of(&scene, SimdLevel::Scalar);
                scalar.light_with(&lights, bounces);
                for simd in SimdLevel::available().filter(|&l| l != SimdLevel::Scalar) {
                    let mut frame = frame_of(&scene, simd);
                    frame.light_with(&lights, bounces);
                    let apart = apart(&frame, &scalar);
                    for (worst, &(name, apart)) in worst.iter_mut().zip(&apart) {
                        *worst = (name, worst.1.max(apart));
                        assert!(
                            apart < ROUNDING,
                            "{name}: {apart:.1e} apart, seed {seed}, {simd:?}, {storage:?}, {bounces:?}"
                        );
                    }
                }
            }
        }
    }
    println!("worst: {worst:?}");
}

#[test]
fn levels_agree_with_the_scalar_reference_on_mobile_operators() {
    compare_levels(mobile_dictionary(), 20, 12);
}

#[test]
fn levels_agree_with_the_scalar_reference_on_standard_operators() {
    compare_levels(default_dictionary(), 9, 2);
}

#[test]
fn levels_agree_with_the_scalar_reference_on_vector_irradiance() {
    compare_levels(vector_dictionary(), 6, 4);
}

/// Relative difference in L2.
fn l2_apart(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let sum = |x: &mut dyn Iterator<Item = f32>| x.map(|x| f64::from(x).powi(2)).sum::<f64>();
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let apart = sum(&mut a.iter().zip(b).map(|(a, b)| a - b));
    (apart / sum(&mut b.iter().copied())).sqrt()
}

/// What is kept of operators, against all of them in `f32`, relative L2 over a maze of 41 blocks with four lamps.
///
/// Bounds are about twice what was measured: `f16` 1.1e-4 for transport and nothing for shapes, which the dictionary has in
/// `f16` already, `int8` 6e-3, `negligible` 2.1e-4 at 3e-3 and 1.6e-3 at 1e-2.
#[test]
fn stored_operators_err_as_stated() {
    let level = maze(41, Vec3::new(0.7, 0.5, 0.3), 7);
    let solved = |shape_storage, transport_storage, negligible, bounces| {
        let config = AssembleConfig {
            shape_storage,
            transport_storage,
            negligible: Some(negligible),
            ..AssembleConfig::default()
        };
        let scene = Scene::assemble(&level, default_dictionary(), &config).expect("the level fits");
        let mut random = Random(2);
        let lights: Vec<Light> = (0..4)
            .map(|_| {
                let position = mrt_tests::sequences::random_position(&mut random, &level);
                mrt_tests::sphere(position, 0.1, Vec3::new(1.0, 0.5, 0.25))
            })
            .collect();
        let mut frame = Frame::new(&scene, FrameConfig::default());
        frame.light_with(&lights, bounces);
        by_texel(&scene, &frame.indirect())
    };
    for bounces in [Bounces::Count(1), Bounces::Count(10)] {
        let exact = solved(Storage::F32, Storage::F32, 0.0, bounces);
        for (shapes, transport, negligible, bound) in [
            (Storage::F16, Storage::F32, 0.0, 1e-6),
            (Storage::F32, Storage::F16, 0.0, 2.5e-4),
            (Storage::F16, Storage::F16, 0.0, 2.5e-4),
            (Storage::Int8, Storage::F32, 0.0, 1.2e-2),
            (Storage::F32, Storage::Int8, 0.0, 1.2e-2),
            (Storage::Int8, Storage::Int8, 0.0, 1.2e-2),
            (Storage::F32, Storage::F32, 3e-3, 6e-4),
            (Storage::F32, Storage::F32, 1e-2, 3e-3),
            (Storage::F32, Storage::F16, 3e-3, 6e-4),
        ] {
            let apart = l2_apart(&solved(shapes, transport, negligible, bounces), &exact);
            println!("{bounces:?} {shapes:?} {transport:?} {negligible}: {apart:.1e}");
            assert!(
                apart < bound,
                "{bounces:?} {shapes:?} {transport:?} {negligible}: {apart:.1e}"
            );
        }
    }
}

#[test]
fn mirrors_that_would_fold_padding_are_left_out() {
    // A straight block has three mirrors: 16² texels make orbits of eight, and at 6² and 5² nearly half of eight times 32
    // slots would be padding.
    let level = Level::from_cells(&[[0, 0, 0], [1, 0, 0], [2, 0, 0]], Vec3::ONE).expect("a row");
    for (dictionary, mirrors, slots) in [
        (default_dictionary(), 3, 4 * 16 * 16),
        (mobile_dictionary(), 2, 4 * 48),
        (vector_dictionary(), 2, 4 * 32),
    ] {
        let scene =
            Scene::assemble(&level, dictionary, &AssembleConfig::default()).expect("it fits");
        let folding = &scene.shapes[scene.blocks[1].shape_index].folding;
        assert_eq!((folding.mirrors, folding.slots()), (mirrors, slots));
        // Tiles of T_b->r need it.
        assert!(folding.up_mirror.is_some_and(|k| k < folding.mirrors));
    }
}
