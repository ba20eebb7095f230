//! Faces that emit light.

use glam::Vec3;
use mrt_core::geometry::cube::Face;
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_runtime::{Bounces, Frame, FrameConfig, Level};
use mrt_tests::{
    CONVERGED, FrameForTests, assembled, by_texel, corridor, exact_of, floor_plan, in_level_order,
    relative_difference, solved,
};

/// Tolerance for two products in `f32` instead of one, over many bounces.
const ROUNDING: f64 = 1e-5;

const PANEL: Vec3 = Vec3::new(3.0, 2.0, 1.0);

/// Four blocks in the shape of an L. The ceiling of the first shines.
fn panelled(albedo: f32) -> Level {
    let mut cells = corridor(3);
    cells.push([2, 1]);
    let mut level = floor_plan(&cells, albedo);
    level.blocks[0].emission[Face::PosY.index()] = PANEL;
    level
}

#[test]
fn a_panel_lights_its_own_block_and_all_others() {
    let scene = assembled(&panelled(0.5));
    let frame = solved(&scene, &[], Bounces::Count(1));
    assert!(frame.direct().iter().all(|&e| e == 0.0));
    let light = by_texel(&scene, &frame.indirect());
    for (index, block) in scene.level.blocks.iter().enumerate() {
        let sum: f32 = light[block.texels.clone()].iter().map(|e| e[0]).sum();
        assert!(sum > 0.0, "block {index}");
    }
}

#[test]
fn a_panel_acts_like_the_direct_light_that_its_wall_would_reflect() {
    let albedo = 0.5;
    let shining = assembled(&panelled(albedo));
    let mut dark = panelled(albedo);
    dark.blocks[0].emission = [Vec3::ZERO; 6];
    let dark = assembled(&dark);
    let mut direct = vec![0.0; 3 * dark.texel_count()];
    let block = &dark.level.blocks[0];
    let ceiling = block
        .shape
        .wall_offset(Face::PosY, dark.level.resolution)
        .expect("there is a ceiling");
    for channel in 0..3 {
        let start = 3 * block.texels.start + channel * block.texels.len() + ceiling;
        let texels = dark.level.resolution * dark.level.resolution;
        direct[start..start + texels].fill(PANEL[channel] / albedo);
    }
    for bounces in [Bounces::Count(1), Bounces::Count(7), CONVERGED] {
        let mut expected = Frame::new(&dark, FrameConfig::default());
        expected.light_from(&direct, bounces);
        let found = solved(&shining, &[], bounces);
        let apart = relative_difference(&found.indirect(), &expected.indirect());
        assert!(apart < ROUNDING, "{bounces:?}: {apart}");
    }
}

/// Bounds for the blocks, in the order of their distance from the panel. Measured: 0.013, 0.152, 0.181 and 0.241.
///
/// 32 modes represent a panel well in its own block, where the light prior was enriched with it. They do so poorly beyond
/// the opening, which touches an edge of the panel.
const PANEL_ERROR: [f64; 4] = [0.02, 0.17, 0.21, 0.28];

#[test]
fn light_of_a_panel_agrees_with_exact_form_factors() {
    // Walls are black, so all light comes straight from the panel.
    let level = panelled(0.0);
    let scene = assembled(&level);
    let frame = solved(&scene, &[], CONVERGED);
    let found = in_level_order(&level, &scene, &frame.indirect());
    let exact = exact_of(&level, scene.level.resolution);
    let transport = Transport::build(&exact);
    let radiosity: Vec<[f64; 4]> = exact
        .walls()
        .iter()
        .flat_map(|wall| {
            let emission = level.blocks[wall.block].emission[wall.face.index()];
            vec![[f64::from(emission.x); 4]; scene.level.resolution * scene.level.resolution]
        })
        .collect();
    let expected = transport
        .irradiance(&radiosity)
        .expect("of the right length");
    let texels = scene.level.resolution * scene.level.resolution;
    for (block, bound) in PANEL_ERROR.into_iter().enumerate() {
        let of_block = |values: Vec<f64>| -> Vec<f64> {
            exact
                .walls()
                .iter()
                .filter(|wall| wall.block == block)
                .flat_map(|wall| values[wall.first_texel..wall.first_texel + texels].to_vec())
                .collect()
        };
        let ours = of_block(found.iter().map(|e| f64::from(e[0])).collect());
        let theirs = of_block(expected.clone());
        let error = rel_l2(&ours, &theirs);
        println!("block {block}: {error:.4}");
        assert!(error < bound, "block {block}: {error}");
    }
}
