//! The paper's form of `T_b->r`, opening by opening, gives the same light as the scene's operators.

use glam::Vec3;
use mrt_core::linalg::matrix::{MatrixView, multiply, multiply_add};
use mrt_runtime::blocks::maze;
use mrt_runtime::low_level::modular::opening_responses::{OpeningResponses, responses_by_opening};
use mrt_runtime::{Bounces, Dictionary, Light, Scene};
use mrt_tests::{COUPLINGS, FrameForTests, configured, lossless, mobile_dictionary, solved};

/// The joint coefficients of all blocks: light of other blocks by the responses, and the blocks' own coefficients `b`.
fn joint_coefficients(
    scene: &Scene,
    dictionary: &Dictionary,
    arrivals: &[OpeningResponses],
    b: &[f32],
) -> Vec<f32> {
    let joint_count = scene.blocks.last().map_or(0, |block| block.joint.end);
    let mut joint = vec![0.0; 3 * joint_count];
    for arrival in arrivals {
        let [target, source] =
            [arrival.target, arrival.source].map(|block| &scene.blocks[block.get()]);
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
    for block in &scene.blocks {
        let own = &b[3 * block.coefficients.start..3 * block.coefficients.end];
        let joint = &mut joint[3 * block.joint.start..3 * block.joint.end];
        let (modes, stride) = (block.coefficients.len(), block.joint.len());
        for channel in 0..3 {
            for k in 0..modes {
                joint[channel * stride + k] += own[channel * modes + k];
            }
        }
    }
    joint
}

/// Indirect irradiance of all texels from joint coefficients, before negative values are set to 0.
fn irradiance(scene: &Scene, dictionary: &Dictionary, joint: &[f32]) -> Vec<f32> {
    let mut found = vec![0.0; 3 * scene.texel_count()];
    for (block, placed) in scene.blocks.iter().zip(&scene.level.blocks) {
        let entry = dictionary.shape_index(placed.shape).expect("it is used");
        let joint = &joint[3 * block.joint.start..3 * block.joint.end];
        let joint = MatrixView::new(block.joint.len(), 3, joint);
        let out = &mut found[3 * placed.texels.start..3 * placed.texels.end];
        multiply_add(dictionary.shapes[entry].joint_basis.view(), joint, out);
    }
    found
}

#[test]
fn responses_by_opening_add_up_to_the_transport_of_the_scene() {
    let dictionary = mobile_dictionary();
    let level = maze(9, Vec3::splat(0.5), 3);
    for coupling in COUPLINGS {
        let config = lossless(coupling);
        let scene = configured(&level, dictionary, &config);
        let position = level.blocks[4].warp.center().as_vec3();
        let light = Light::sphere(position, 0.1, Vec3::new(1.0, 0.5, 0.2));
        let frame = solved(&scene, &[light], Bounces::Count(1));
        let (b, expected) = (frame.coefficients(), frame.indirect());
        let arrivals = responses_by_opening(&level, &scene, dictionary, &config)
            .expect("the scene is made of this level and dictionary");
        let joint = joint_coefficients(&scene, dictionary, &arrivals, &b);
        let found = irradiance(&scene, dictionary, &joint);
        assert_eq!(found.len(), expected.len());
        let largest = expected.iter().fold(0.0f32, |m, x| m.max(x.abs()));
        assert!(largest > 0.0);
        for (a, b) in found.iter().zip(&expected) {
            // Sums have another order here, and frames set negative light to 0.
            let a = a.max(0.0);
            assert!((a - b).abs() < 1e-4 * largest, "{a} for {b}");
        }
    }
}
