//! The paper's form of `T_b->r` makes the same light as the scene's.

use glam::Vec3;
use mrt_core::container::ByteBudget;
use mrt_core::matrix::{MatrixView, multiply, multiply_add};
use mrt_runtime::assemble::{AssembleConfig, Coupling, assemble};
use mrt_runtime::dictionary::Dictionary;
use mrt_runtime::maze::maze;
use mrt_runtime::opening_responses::responses_by_opening;

#[test]
fn responses_by_opening_add_up_to_the_transport_of_the_scene() {
    let bytes = include_bytes!("../../assets/versions/2.mrt");
    let dictionary =
        Dictionary::from_bytes(bytes, &mut ByteBudget::new(16 << 20)).expect("a dictionary");
    let level = maze(9, Vec3::splat(0.5), 3);
    for coupling in [Coupling::Table, Coupling::Lightfield] {
        let config = AssembleConfig {
            coupling,
            ..AssembleConfig::default()
        };
        let scene = assemble(&level, &dictionary, &config).expect("a maze is a level");
        let b: Vec<f32> = (0..3 * scene.coefficient_count)
            .map(|k| (k % 17) as f32 - 8.0)
            .collect();
        let mut expected = vec![0.0; 3 * scene.joint_count];
        scene.transport.multiply(&b, &scene.doors, &mut expected);
        let mut found = vec![0.0; expected.len()];
        let all =
            responses_by_opening(&level, &scene, &dictionary, &config).expect("it is the scene");
        for arrival in &all {
            let (target, source) = (&scene.blocks[arrival.target], &scene.blocks[arrival.source]);
            let entry = dictionary.shape_index(target.shape).expect("it is used");
            let opening = &dictionary.shapes[entry].openings[arrival.opening];
            let of_source = &b[3 * source.coefficients.start..3 * source.coefficients.end];
            let of_source = MatrixView::new(source.coefficients.len(), 3, of_source);
            let responses = multiply(arrival.responses.view(), of_source);
            multiply_add(
                opening.joint_from_response[usize::from(arrival.exchanged)].view(),
                responses.view(),
                &mut found[3 * target.joint.start..3 * target.joint.end],
            );
        }
        let largest = expected.iter().fold(0.0f32, |m, x| m.max(x.abs()));
        assert!(largest > 0.0);
        for (a, b) in found.iter().zip(&expected) {
            // Sums in another order.
            assert!((a - b).abs() < 1e-4 * largest, "{a} for {b}");
        }
    }
}
