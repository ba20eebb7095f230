//! The path tracer agrees with closed forms and with the exact solver.

use glam::DVec3;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::path_tracer::{PathScene, PathSettings, SphereLight, irradiance};
use mrt_core::reference::radiosity::ExactScene;
use mrt_core::reference::radiosity::direct::{PointLight, direct, direct_quarters};
use mrt_core::reference::radiosity::solve::solve;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_tests::{painted, with_threads};

fn unit_cube(albedo: f32) -> TriangleMesh {
    let positions = (0..8)
        .map(|k| Hexahedron::unit_corner(k).as_vec3())
        .collect();
    let quads = [
        [0, 2, 6, 4],
        [1, 5, 7, 3],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 1, 3, 2],
        [4, 6, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    painted(TriangleMesh::from_triangles(positions, triangles), albedo)
}

#[test]
fn a_cube_agrees_with_the_exact_solver_within_its_noise() {
    const PATHS: u32 = 1024;
    const ALBEDO: f64 = 0.5;
    let scene = ExactScene::from_cells(&[[0, 0, 0]], 8).unwrap();
    let position = DVec3::new(0.4, 0.6, 0.45);
    let light = PointLight::unit(position);
    let transport = Transport::build(&scene);
    let quarters = direct_quarters(&scene, &light, 4);
    let albedo = vec![ALBEDO; scene.texel_count()];
    let lights = vec![SphereLight {
        position,
        intensity: DVec3::new(1.0, 2.0, 0.5),
        radius: 0.0,
    }];
    let traced_scene = PathScene::new(&unit_cube(ALBEDO as f32), lights, &[]).unwrap();
    let receivers: Vec<(DVec3, DVec3)> = scene
        .centers()
        .iter()
        .copied()
        .zip(scene.normals().iter().copied())
        .collect();
    for bounces in [1, 3] {
        let settings = PathSettings {
            paths: PATHS,
            bounces,
            seed: 7,
        };
        let traced = irradiance(&traced_scene, &receivers, &settings);
        let green: Vec<f64> = traced.iter().map(|e| e.indirect.y / 2.0).collect();
        let blue: Vec<f64> = traced.iter().map(|e| e.indirect.z * 2.0).collect();
        assert!(rel_l2(&green, &blue) < 1e-12);
        let bounces = ReferenceBounces::Count(bounces as usize);
        let exact = solve(&scene, &transport, &quarters, bounces, &albedo).unwrap();
        // The radiosity that a path meets deviates from its mean by less than the mean: the spot nearest to the light has
        // 2.6 times the mean. So the error of N independent paths is below 1/sqrt(N), 3.1 %. The exact solver adds 0.5 % at
        // 8² texels.
        let bound = 1.0 / f64::from(PATHS).sqrt() + 0.005;
        let error = rel_l2(&green, &exact);
        assert!(error < bound, "{bounces:?}: {error}");
        // Noise has no preferred sign, so the mean over 384 texels is 20 times as exact.
        let (mean, exact_mean) = (green.iter().sum::<f64>(), exact.iter().sum::<f64>());
        assert!((mean / exact_mean - 1.0).abs() < bound / 5.0);

        let traced_direct: Vec<f64> = traced.iter().map(|e| e.direct.x).collect();
        // Only rounding to `f32` differs.
        assert!(rel_l2(&traced_direct, &direct(&scene, &light)) < 1e-5);
    }
}

#[test]
fn a_white_furnace_adds_up_the_geometric_series() {
    const BOUNCES: u32 = 60;
    let center = (DVec3::new(0.3, 0.0, 0.6), DVec3::Y);
    for albedo in [0.25f32, 0.75] {
        let scene = PathScene::new(&unit_cube(albedo), Vec::new(), &[DVec3::ONE]).unwrap();
        let settings = PathSettings {
            paths: 64,
            bounces: BOUNCES,
            seed: 1,
        };
        let found = irradiance(&scene, &[center], &settings)[0];
        let albedo = f64::from(albedo);
        // All paths carry the same light, so there is no noise. 60 bounces leave out a share of albedo^61.
        assert!((found.direct.x - 1.0).abs() < 1e-12, "{found:?}");
        let total = found.direct.x + found.indirect.x;
        assert!((total - 1.0 / (1.0 - albedo)).abs() < 1e-6, "{total}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let lights = vec![SphereLight {
        position: DVec3::splat(0.4),
        intensity: DVec3::ONE,
        radius: 0.05,
    }];
    let scene = PathScene::new(&unit_cube(0.5), lights, &[]).unwrap();
    let receivers = [(DVec3::new(0.5, 0.0, 0.5), DVec3::Y); 5];
    let settings = PathSettings {
        paths: 32,
        bounces: 2,
        seed: 3,
    };
    let on = |threads| with_threads(threads, || irradiance(&scene, &receivers, &settings));
    let one = on(1);
    assert_eq!(one, on(3));
    // Each receiver has paths of its own, even if two are at the same point.
    assert_ne!(one[0], one[1]);
}

#[test]
fn the_number_of_emissions_must_be_that_of_materials_or_0() {
    let wrong = PathScene::new(&unit_cube(0.5), Vec::new(), &[DVec3::ONE; 2]);
    assert!(wrong.is_err_and(|error| error.to_string().contains("expected none, or 1")));
}
