//! Kernels of frames: every instruction set against the scalar reference, and stored operators against those in `f32`.

use glam::Vec3;
use mrt_core::simd::SimdLevel;
use mrt_core::storage::Storage;
use mrt_runtime::blocks::maze;
use mrt_runtime::{
    AssembleConfig, Bounces, Dictionary, Frame, FrameConfig, Light, Outputs, ProbeOrder, Scene,
};
use mrt_tests::{
    FrameForTests, Random, configured, corridor, default_dictionary, floor_plan, mobile_dictionary,
    outputs, random_level, random_lights, random_position, relative_difference, relative_l2,
    scene_of, solved, stored, vector_dictionary,
};

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

/// Largest difference, relative to the largest number of an output: a few roundings of `f32`, since vector instructions
/// sum in another order. Measured over twelve bounces: 8e-7.
const ROUNDING: f64 = 3e-6;

/// Relative difference of each output from the scalar reference.
fn apart(frame: &Frame, scalar: &Frame) -> [(&'static str, f64); 6] {
    let [ours, theirs] = [frame, scalar].map(outputs);
    std::array::from_fn(|k| (ours[k].0, relative_difference(&ours[k].1, &theirs[k].1)))
}

/// Compares all instruction sets and storages on random levels.
fn compare_instruction_sets(dictionary: &Dictionary, blocks: usize, seeds: u64) {
    let mut worst = [("", 0.0f64); 6];
    for seed in 0..seeds {
        let mut random = Random(seed);
        let level = random_level(&mut random, blocks);
        for storage in Storage::ALL {
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
fn instruction_sets_agree_with_the_scalar_reference_on_mobile_operators() {
    compare_instruction_sets(mobile_dictionary(), 20, 12);
}

#[test]
fn instruction_sets_agree_with_the_scalar_reference_on_standard_operators() {
    compare_instruction_sets(default_dictionary(), 9, 2);
}

#[test]
fn instruction_sets_agree_with_the_scalar_reference_on_vector_irradiance() {
    compare_instruction_sets(vector_dictionary(), 6, 4);
}

/// Bounds are relative L2 errors over a maze of 41 blocks with four lamps, about twice the measured ones. Measured: `f16`
/// 1.1e-4 for transport and 0 for shapes, which the dictionary has in `f16` already; `int8` 6e-3; `negligible` 2.1e-4 at
/// 3e-3 and 1.6e-3 at 1e-2.
#[test]
fn stored_operators_change_light_by_less_than_stated() {
    let level = maze(41, Vec3::new(0.7, 0.5, 0.3), 7);
    let lit = |shape_storage, transport_storage, negligible, bounces| {
        let config = AssembleConfig {
            shape_storage,
            transport_storage,
            negligible: Some(negligible),
            ..AssembleConfig::default()
        };
        let scene = configured(&level, default_dictionary(), &config);
        let mut random = Random(2);
        let lights: Vec<Light> = (0..4)
            .map(|_| {
                let position = random_position(&mut random, &level, 0.0);
                Light::sphere(position, 0.1, Vec3::new(1.0, 0.5, 0.25))
            })
            .collect();
        solved(&scene, &lights, bounces).indirect()
    };
    for bounces in [Bounces::Count(1), Bounces::Count(10)] {
        let exact = lit(Storage::F32, Storage::F32, 0.0, bounces);
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
            let apart = relative_l2(&lit(shapes, transport, negligible, bounces), &exact);
            println!("{bounces:?} {shapes:?} {transport:?} {negligible}: {apart:.1e}");
            assert!(
                apart < bound,
                "{bounces:?} {shapes:?} {transport:?} {negligible}: {apart:.1e}"
            );
        }
    }
}

#[test]
fn mirrors_that_would_mostly_fold_padding_are_left_out() {
    // A straight block has three mirrors. They fold 16² texels a wall well. At 6² and 5², nearly half of eight times 32 slots
    // would be padding, so that one mirror is left out.
    let level = floor_plan(&corridor(3), 1.0);
    for (dictionary, mirrors, slots) in [
        (default_dictionary(), 3, 4 * 16 * 16),
        (mobile_dictionary(), 2, 4 * 48),
        (vector_dictionary(), 2, 4 * 32),
    ] {
        let scene = scene_of(&level, dictionary);
        let folding = &scene.shapes[scene.blocks[1].shape_index].folding;
        assert_eq!((folding.mirrors, folding.slots()), (mirrors, slots));
        // Tiles of T_b->r need the mirror that exchanges up and down.
        assert!(folding.up_mirror.is_some_and(|k| k < folding.mirrors));
    }
}
