//! A frame with each instruction set of this machine against the scalar reference. Needs little, so that it can run under
//! emulation too.

use glam::{Vec3, vec3};
use mrt_core::container::ByteBudget;
use mrt_core::simd::SimdLevel;
use mrt_core::storage::Storage;
use mrt_runtime::assemble::{AssembleConfig, assemble};
use mrt_runtime::dictionary::Dictionary;
use mrt_runtime::frame::{Bounces, Frame, FrameConfig};
use mrt_runtime::light::Light;
use mrt_runtime::maze::maze;
use mrt_runtime::visibility::Openings;

/// Share of the brightest texel by which levels may differ: sums of some hundred products in another order, in `f32`.
const ROUNDING: f32 = 1e-5;

#[test]
fn every_level_gives_the_light_of_the_scalar_reference() {
    let bytes = include_bytes!("../../assets/versions/2.mrt");
    let dictionary = Dictionary::from_bytes(bytes, &mut ByteBudget::new(64 << 20)).expect("sound");
    let level = maze(9, vec3(0.7, 0.5, 0.3), 3);
    let lamp = |block: usize, intensity: Vec3| Light::Sphere {
        // Off every texel's line through an edge of an opening: no texel is lit or not by rounding.
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
        let scene = assemble(&level, &dictionary, &config).expect("it fits");
        let lit = |simd: SimdLevel, bounces: Bounces| {
            let config = FrameConfig {
                simd,
                ..FrameConfig::default()
            };
            let mut frame = Frame::with_config(&scene, config);
            for _ in 0..3 {
                let solved = frame.solve(&scene, &lights, &Openings, bounces);
                solved.expect("the lights are sound");
            }
            [frame.direct(), frame.indirect()].concat()
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
