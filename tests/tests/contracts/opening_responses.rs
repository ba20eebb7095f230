//! The paper's form of `T_b->r` makes the same light as the scene's.

use glam::Vec3;
use mrt_core::container::ByteBudget;
use mrt_core::linalg::matrix::{MatrixView, multiply, multiply_add};
use mrt_core::storage::Storage;
use mrt_runtime::FrameConfig;
use mrt_runtime::blocks::maze;
use mrt_runtime::low_level::modular::opening_responses::responses_by_opening;
use mrt_runtime::{AssembleConfig, Bounces, Coupling, Dictionary, Frame, Light, Scene};
use mrt_tests::FrameForTests;

#[test]
fn responses_by_opening_add_up_to_the_transport_of_the_scene() {
    let bytes = include_bytes!("../../../assets/versions/2.mrt");
    let dictionary =
        Dictionary::from_bytes_within(bytes, &mut ByteBudget::new(16 << 20)).expect("a dictionary");
    let level = maze(9, Vec3::splat(0.5), 3);
    for coupling in [Coupling::Table, Coupling::Lightfield] {
        let config = AssembleConfig {
            coupling,
            transport_storage: Storage::F32,
            negligible: Some(0.0),
            ..AssembleConfig::default()
        };
        let scene = Scene::assemble(&level, &dictionary, &config).expect("a maze is a level");
        let light = Light::Sphere {
            position: level.blocks[4].warp.center().as_vec3(),
            radius: 0.1,
            intensity: Vec3::new(1.0, 0.5, 0.2),
        };
        let mut frame = Frame::new(&scene, FrameConfig::default());
        frame.light_with(&[light], Bounces::Count(1));
        let (b, expected) = (frame.coefficients(), frame.indirect());
        let joint_count = scene.blocks.last().map_or(0, |block| block.joint.end);
        let mut joint = vec![0.0; 3 * joint_count];
        let all =
            responses_by_opening(&level, &scene, &dictionary, &config).expect("it is the scene");
        for arrival in &all {
            let (target, source) = (
                &scene.blocks[arrival.target.get()],
                &scene.blocks[arrival.source.get()],
            );
            let shape = scene.level.blocks[arrival.target.get()].shape;
            let entry = dictionary.shape_index(shape).expect("it is used");
            let opening = &dictionary.shapes[entry].openings[arrival.opening];
            let of_source = &b[3 * source.coefficients.start..3 * source.coefficients.end];
            let of_source = MatrixView::new(source.coefficients.len(), 3, of_source);
            let responses = multiply(arrival.responses.view(), of_source);
            multiply_add(
                opening.joint_from_response[usize::from(arrival.exchanged)].view(),
                responses.view(),
                &mut joint[3 * target.joint.start..3 * target.joint.end],
            );
        }
        let mut found = vec![0.0; expected.len()];
        for (block, placed) in scene.blocks.iter().zip(&scene.level.blocks) {
            let own = &b[3 * block.coefficients.start..3 * block.coefficients.end];
            let joint = &mut joint[3 * block.joint.start..3 * block.joint.end];
            for channel in 0..3 {
                let (modes, stride) = (block.coefficients.len(), block.joint.len());
                for k in 0..modes {
                    joint[channel * stride + k] += own[channel * modes + k];
                }
            }
            let entry = dictionary.shape_index(placed.shape).expect("it is used");
            let joint = MatrixView::new(block.joint.len(), 3, joint);
            let out = &mut found[3 * placed.texels.start..3 * placed.texels.end];
            multiply_add(dictionary.shapes[entry].joint_basis.view(), joint, out);
        }
        let largest = expected.iter().fold(0.0f32, |m, x| m.max(x.abs()));
        assert!(largest > 0.0);
        for (a, b) in found.iter().zip(&expected) {
            // Sums in another order, and none below zero.
            let a = a.max(0.0);
            assert!((a - b).abs() < 1e-4 * largest, "{a} for {b}");
        }
    }
}
