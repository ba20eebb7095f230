//! The exact solver against reference files.
//!
//! The files are Monte Carlo estimates. Their first bounce has hardly any noise. Later bounces scatter from texel to texel by
//! about 1 %, independently: means of the difference from the exact solution over 2² and 4² texels are 2 and 4 times smaller,
//! and the difference in the cube stays the same when it is solved at three times the resolution. So later bounces are
//! compared as means over 4 x 4 texels. These have a quarter of the noise, and any error of the solver in full.

use glam::DVec3;
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::error_measure::{rel_l2, rel_l2_by_hop};
use mrt_core::reference::oracle_file::{Kind, RGB_BOUNCES, ReferenceFile};
use mrt_core::reference::radiosity::ExactScene;
use mrt_core::reference::radiosity::direct::{PointLight, direct, direct_quarters};
use mrt_core::reference::radiosity::solve::{solve, solve_rgb};
use mrt_core::reference::radiosity::transport::Transport;
use mrt_tests::reference;

/// Bound for a whole level, mean over lights. Measured: 0.12 to 0.26 %, with 0.1 % noise of the file.
const FIRST_BOUNCE_LIMIT: f64 = 0.003;
/// Bound for means over 4 x 4 texels, mean over lights. Measured: 0.15 to 0.39 %, with 0.1 to 0.3 % noise.
const LATER_BOUNCES_LIMIT: f64 = 0.0045;
/// Bound for single texels, mean over lights: the noise of the files. Measured: 0.4 to 1.6 %.
const NOISE_LIMIT: f64 = 0.018;
/// Bound for direct light: single precision.
const DIRECT_LIMIT: f64 = 2e-6;
/// Samples along a quarter of a texel for the direct light that the first bounce reflects.
const SAMPLES: usize = 4;

/// A reference file and the exact solver's scene of its level.
struct Level {
    file: ReferenceFile,
    scene: ExactScene,
    transport: Transport,
}

fn load(name: &str) -> Level {
    let file = reference(name);
    let scene = ExactScene::from_cells(&file.cells, file.resolution.unwrap()).unwrap();
    let walls: Vec<_> = scene.walls().iter().map(|w| (w.block, w.face)).collect();
    assert_eq!(walls, file.walls, "texel order");
    let transport = Transport::build(&scene);
    // Several tests run at once, so even the largest level must leave room for others.
    assert!(transport.bytes() < 300_000_000);
    Level {
        file,
        scene,
        transport,
    }
}

/// Sums over 4 x 4 texels of walls of `resolution`² values.
fn pooled(values: &[f64], resolution: usize) -> Vec<f64> {
    const SIDE: usize = 4;
    let coarse = resolution / SIDE;
    let mut sums = vec![0.0; values.len() / (SIDE * SIDE)];
    for (k, value) in values.iter().enumerate() {
        let (row, column) = (k / resolution, k % resolution);
        sums[row / SIDE * coarse + column / SIDE] += value;
    }
    sums
}

/// Errors of one solution for single texels and for means over 4 x 4 texels. Prints them.
fn errors(level: &Level, light: usize, term: &str, found: &[f64], reference: &[f64]) -> [f64; 2] {
    let resolution = level.scene.resolution();
    let hops = level.file.hops(light).unwrap();
    let coarse = [pooled(found, resolution), pooled(reference, resolution)];
    let errors = [rel_l2(found, reference), rel_l2(&coarse[0], &coarse[1])];
    let by_hop = rel_l2_by_hop(found, reference, &hops)
        .map(|e| e.map_or("   - ".into(), |e| format!("{:5.2}", e * 100.0)));
    println!(
        "{:18} light {light} {term:22} {:6.3} % [{}], 4 x 4 texels {:6.3} %",
        level.file.name,
        errors[0] * 100.0,
        by_hop.join(" "),
        errors[1] * 100.0,
    );
    errors
}

fn mean(errors: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|k| errors.iter().map(|e| e[k]).sum::<f64>() / errors.len() as f64)
}

/// True for texels that a tiny move of the light neither hides nor uncovers. Of other texels, whose ray to the light touches
/// an edge, both lit and unlit is right.
fn is_stable(scene: &ExactScene, light: &PointLight) -> Vec<bool> {
    let lit = |offset: DVec3| {
        let position = light.position + offset;
        direct(scene, &PointLight { position, ..*light })
    };
    let base = lit(DVec3::ZERO);
    let mut stable = vec![true; base.len()];
    for axis in DVec3::AXES {
        for moved in [lit(axis * 1e-6), lit(axis * -1e-6)] {
            for (stable, (a, b)) in stable.iter_mut().zip(base.iter().zip(&moved)) {
                *stable &= (*a == 0.0) == (*b == 0.0);
            }
        }
    }
    stable
}

fn check_colourless(name: &str) {
    let level = load(name);
    let (file, scene, transport) = (&level.file, &level.scene, &level.transport);
    let terms = [
        ("first bounce", ReferenceBounces::First, 1.0),
        ("6 bounces, albedo 0.9", ReferenceBounces::Count(6), 0.9),
        ("all, albedo 0.5", ReferenceBounces::All, 0.5),
        ("all, albedo 0.9", ReferenceBounces::All, 0.9),
    ];
    let mut found = terms.map(|_| Vec::new());
    for (light, &position) in file.lights.iter().enumerate() {
        let source = PointLight {
            intensity: file.intensity,
            ..PointLight::unit(position)
        };
        let stable = is_stable(scene, &source);
        let keep = |values: Vec<f64>| -> Vec<f64> {
            let kept = values.into_iter().zip(&stable).filter(|(_, keep)| **keep);
            kept.map(|(value, _)| value).collect()
        };
        let straight = keep(direct(scene, &source));
        // An edge of a shadow that runs through centres of texels excludes at most 128 texels.
        assert!(straight.len() + 128 > scene.texel_count());
        let error = rel_l2(&straight, &keep(file.term(light, 0).unwrap()));
        assert!(error < DIRECT_LIMIT, "{name}, light {light}: {error}");

        let quarters = direct_quarters(scene, &source, SAMPLES);
        for ((label, bounces, albedo), errors_of_term) in terms.iter().zip(&mut found) {
            let albedos = vec![*albedo; scene.texel_count()];
            let solved = solve(scene, transport, &quarters, *bounces, &albedos).unwrap();
            let reference = file.indirect_irradiance(light, *bounces, *albedo).unwrap();
            errors_of_term.push(errors(&level, light, label, &solved, &reference));
        }
    }
    let [first, six, half, nine] = found.map(|errors| mean(&errors));
    assert!(first[0] < FIRST_BOUNCE_LIMIT, "{name}: {first:?}");
    for errors in [six, half] {
        assert!(errors[0] < NOISE_LIMIT, "{name}: {errors:?}");
        assert!(errors[1] < LATER_BOUNCES_LIMIT, "{name}: {errors:?}");
    }
    // At albedo 0.9, half of the reference is extrapolated from six bounces (see `ReferenceFile::indirect_irradiance`).
    // Extrapolating the solver's own six bounces in this way differs from all of its bounces by 0.01 to 0.1 % in the cube and
    // in the room, by up to 2 % in long levels, and by 5 % in the maze.
    let nine_limit = match name {
        "cube" | "room3x3" => LATER_BOUNCES_LIMIT,
        "maze11" => 0.06,
        _ => 0.025,
    };
    assert!(nine[1] < nine_limit, "{name}: {nine:?}");
}

fn check_coloured(name: &str) {
    let Level {
        file,
        scene,
        transport,
    } = &load(name);
    let Kind::IrradianceRgb { albedo } = &file.kind else {
        panic!("{name} is not coloured");
    };
    let albedo = scene.spread_over_texels(albedo).unwrap();
    let terms = [
        ("first bounce", ReferenceBounces::First),
        ("10 bounces", ReferenceBounces::Count(RGB_BOUNCES)),
    ];
    let mut found = terms.map(|_| Vec::new());
    for (light, &position) in file.lights.iter().enumerate() {
        let quarters = direct_quarters(scene, &PointLight::unit(position), SAMPLES);
        for ((label, bounces), errors_of_term) in terms.iter().zip(&mut found) {
            let solved = solve_rgb(scene, transport, &quarters, *bounces, &albedo).unwrap();
            let reference = file.indirect_irradiance_rgb(light, *bounces).unwrap();
            // One channel after another, so that each is a list of walls as in colourless files.
            let channels = |rgb: &[[f64; 3]]| -> Vec<Vec<f64>> {
                (0..3).map(|c| rgb.iter().map(|e| e[c]).collect()).collect()
            };
            let resolution = scene.resolution();
            let (solved, reference) = (channels(&solved), channels(&reference));
            let whole = rel_l2(&solved.concat(), &reference.concat());
            let coarse = |c: &[Vec<f64>]| -> Vec<f64> {
                c.iter().flat_map(|c| pooled(c, resolution)).collect()
            };
            let coarse = rel_l2(&coarse(&solved), &coarse(&reference));
            println!(
                "{name:18} light {light} {label:22} {:6.3} %, 4 x 4 texels {:6.3} %",
                whole * 100.0,
                coarse * 100.0
            );
            errors_of_term.push([whole, coarse]);
        }
    }
    let [first, ten] = found.map(|errors| mean(&errors));
    assert!(first[0] < FIRST_BOUNCE_LIMIT, "{name}: {first:?}");
    assert!(ten[0] < NOISE_LIMIT, "{name}: {ten:?}");
    assert!(ten[1] < LATER_BOUNCES_LIMIT, "{name}: {ten:?}");
}

/// A test for each reference file, of the same name.
macro_rules! one_test_a_file {
    ($check:ident: $($name:ident),*) => {$(
        #[test]
        #[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
        fn $name() {
            $check(stringify!($name));
        }
    )*};
}

one_test_a_file!(check_colourless: cube, corridor5, l_turn, t_junction, room3x3, stack3, maze11);
one_test_a_file!(check_coloured: cube_cornell, cube_one_white, corridor5_painted);

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn probe_files_hold_coefficients_and_no_irradiance() {
    for (name, points) in [("cube_probes", 64), ("corridor5_probes", 320)] {
        let file = reference(name);
        assert_eq!(file.shape[2..], [points, 9]);
        assert_eq!(file.term(1, 0).unwrap().len(), points * 9);
        assert!(
            file.indirect_irradiance(0, ReferenceBounces::First, 1.0)
                .is_err()
        );
        assert!(
            file.indirect_irradiance_rgb(0, ReferenceBounces::First)
                .is_err()
        );
    }
}
