//! A level that opens upwards, turned on its side, is a level that opens sideways, with the same light.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::error_measure::{rel_l2, rel_l2_by_hop};
use mrt_runtime::{AssembleConfig, Bounces, Coupling, Dictionary, Level, Light, Scene};
use mrt_tests::{
    COUPLINGS, FrameForTests, Random, baked, by_texel, configured, in_level_order,
    largest_difference, lossless, matched, reference, solved, turned_cells,
};
use std::sync::OnceLock;

/// The mobile preset with vertical openings.
fn mobile() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| baked("mobile", "cubes-3d", |_| ()))
}

/// The level, with nothing left out of far light. Of two parts of the same size, either could be left out.
fn assembled(level: &Level, coupling: Coupling) -> Scene {
    let config = AssembleConfig {
        // As deep as the table, so that lightfields do not stand in for it.
        max_depth: 4,
        ..lossless(coupling)
    };
    configured(level, mobile(), &config)
}

/// Cells of a shaft, a bend upwards and sideways, an upright loop, and a random heap.
fn plans() -> Vec<Vec<[i32; 3]>> {
    let mut random = Random(8);
    let mut heap = vec![[0, 0, 0]];
    while heap.len() < 9 {
        let mut next = heap[random.below(heap.len())];
        next[random.below(3)] += [-1, 1][random.below(2)];
        if !heap.contains(&next) {
            heap.push(next);
        }
    }
    vec![
        vec![[0, 0, 0], [0, 1, 0], [0, 2, 0]],
        vec![[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 2, 1]],
        vec![[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        heap,
    ]
}

/// Turned cells with colours that turn with them.
fn painted(cells: &[[i32; 3]], turn: CubeRotation) -> Level {
    let turned = turned_cells(cells, turn);
    let mut level = Level::from_cells(&turned, Vec3::ZERO).expect("cells make a level");
    for (index, block) in level.blocks.iter_mut().enumerate() {
        for face in Face::ALL {
            let mut random = Random((10 * index + face.index()) as u64);
            let mut value = || random.unit() as f32;
            block.albedo[turn.face(face).index()] = Vec3::new(value(), value(), value());
        }
    }
    level
}

/// Tolerance for sums of `f32` in another order, over ten bounces.
const ROUNDING: f64 = 1e-5;

/// Tolerance with lightfields. Only up to the last mode that is kept do modes turn with their opening. Measured: 3.8e-4.
const GRID: f64 = 1e-3;

#[test]
fn turning_a_level_in_any_direction_turns_its_light() {
    let lamp = DVec3::new(0.3, 0.6, 0.4);
    for (plan, cells) in plans().iter().enumerate() {
        for coupling in COUPLINGS {
            let bound = match coupling {
                Coupling::Table => ROUNDING,
                Coupling::Lightfield => GRID,
            };
            // Each cell turns about its own middle, and the first cell is at the origin.
            let lit = |turn: CubeRotation| {
                let scene = assembled(&painted(cells, turn), coupling);
                let position = turn.point(lamp).as_vec3();
                let light = Light::sphere(position, 0.1, Vec3::new(1.0, 2.0, 3.0));
                let frame = solved(&scene, &[light], Bounces::Count(10));
                let signal = by_texel(&scene, &frame.indirect());
                (scene, signal)
            };
            let (scene, expected) = lit(CubeRotation::IDENTITY);
            let mut worst = 0.0f64;
            for turn in CubeRotation::all() {
                let (other, found) = lit(turn);
                let found = matched(&scene, &other, &found, |point| turn.point(point));
                let apart = largest_difference(&found, &expected);
                worst = worst.max(apart);
                assert!(
                    apart < bound,
                    "plan {plan}, {coupling:?}, {}: {apart:.1e}",
                    turn.name()
                );
            }
            println!("plan {plan}, {coupling:?}: {worst:.1e}");
        }
    }
}

/// Measured: 0.0072. This is better than the bound of levels that open sideways, since probes take no part here.
const STACK_ERROR: f64 = 0.012;

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn a_stack_is_within_the_bounds_of_the_standard_preset() {
    let reference = reference("stack3");
    let dictionary = baked("standard", "cubes-3d", |config| {
        // Enough for a stack of four, and fast to bake.
        config.coupling.depth = 3;
        config.outputs.probes = 0;
        config.lightfield.lightfield_modes = 16;
    });
    let level = Level::from_cells(&reference.cells, Vec3::ONE).expect("a level");
    let config = AssembleConfig {
        max_depth: 3,
        ..AssembleConfig::default()
    };
    let scene = configured(&level, &dictionary, &config);
    let mut whole = 0.0;
    for (light, position) in reference.lights.iter().enumerate() {
        let source = Light::sphere(
            position.as_vec3(),
            0.0,
            Vec3::splat(reference.intensity as f32),
        );
        let frame = solved(&scene, &[source], Bounces::Count(1));
        let ours: Vec<f64> = in_level_order(&level, &scene, &frame.indirect())
            .iter()
            .map(|e| f64::from(e[0]))
            .collect();
        let theirs = reference
            .indirect_irradiance(light, ReferenceBounces::First, 1.0)
            .expect("the file has the term");
        let hops = reference.hops(light).expect("the light is in the file");
        let by_hop = rel_l2_by_hop(&ours, &theirs, &hops);
        let error = rel_l2(&ours, &theirs);
        println!("stack3, light {light}: {error:.4}, {by_hop:.4?}");
        whole += error / reference.lights.len() as f64;
    }
    assert!(whole <= STACK_ERROR, "{whole}");
}
