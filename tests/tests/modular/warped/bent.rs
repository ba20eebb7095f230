//! F of bent blocks against the path tracer: what it costs to neglect that a bent face hides things.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::geometry::mesh::{Material, TriangleMesh};
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::path_tracer::{PathScene, PathSettings, SphereLight, irradiance};
use mrt_dictionary::modular::one_bounce::warped::warped_bounce;
use mrt_dictionary::modular::surface::walls::warped::WarpedWalls;
use mrt_tests::warped::*;

/// Squares along each side of a face: flat triangles that miss a bent face by 1e-4 of its bend.
const FINENESS: usize = 32;
/// Every so manieth texel is traced; prime to the resolution.
const STRIDE: usize = 7;
/// The light's radiosity varies by less than its mean over a hemisphere here, so noise is below 1.6 %; the
/// quasi-random paths of the tracer leave 0.15 %, measured on the cube.
const PATHS: u32 = 4096;

fn mesh(warp: &Hexahedron) -> TriangleMesh {
    let line = FINENESS as u32 + 1;
    let along = |k: u32| f64::from(k) / FINENESS as f64;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for face in Face::ALL {
        let first = positions.len() as u32;
        let points = (0..line * line).map(|k| face.point(along(k % line), along(k / line)));
        positions.extend(points.map(|unit| warp.point(unit).as_vec3()));
        for j in 0..line - 1 {
            for i in 0..line - 1 {
                let [a, b] = [first + j * line + i, first + (j + 1) * line + i];
                triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
    }
    let mut mesh = TriangleMesh::from_triangles(positions, triangles);
    mesh.materials = vec![Material {
        name: "white".into(),
        albedo: Vec3::ONE,
    }];
    mesh
}

/// Relative L2 of the first bounce, and the relative error of its sum.
fn error(warp: &Hexahedron) -> [f64; 2] {
    assert_eq!(warp.check(), Ok(()));
    let walls = WarpedWalls::new(&Face::ALL, RESOLUTION, warp);
    let lights = vec![SphereLight {
        position: warp.point(DVec3::new(0.4, 0.6, 0.45)),
        intensity: DVec3::ONE,
        radius: 0.1,
    }];
    let scene = PathScene::new(&mesh(warp), lights, &[]).unwrap();
    let texels: Vec<(DVec3, DVec3)> = walls
        .centers
        .iter()
        .copied()
        .zip(walls.normals.iter().copied())
        .collect();
    let settings = |paths, bounces| PathSettings {
        paths,
        bounces,
        seed: 3,
    };
    let direct: Vec<f64> = irradiance(&scene, &texels, &settings(1, 0))
        .iter()
        .map(|e| e.direct.x)
        .collect();
    let direct = Matrix::from_column_major(direct.len(), 1, direct);
    let found = multiply(warped_bounce(&walls).view(), direct.view());
    let found: Vec<f64> = found.data().iter().copied().step_by(STRIDE).collect();
    let receivers: Vec<(DVec3, DVec3)> = texels.into_iter().step_by(STRIDE).collect();
    let traced: Vec<f64> = irradiance(&scene, &receivers, &settings(PATHS, 1))
        .iter()
        .map(|e| e.indirect.x)
        .collect();
    [rel_l2(&found, &traced), mean(&found) / mean(&traced) - 1.0]
}

#[test]
fn neglected_occlusion_costs_less_than_the_reduction() {
    println!("| block | L2 % | level % |");
    // Bounds: measured, rounded up. The cube shows what noise and grid alone make.
    for (name, warp, bound) in [
        ("cube", twisted(0.0), 0.003),
        ("corners 0.2", jittered(0.2, 6), 0.003),
        ("corners 0.3 a", jittered(0.3, 5), 0.004),
        ("corners 0.3 b", jittered(0.3, 6), 0.004),
        ("corners 0.3 c", jittered(0.3, 7), 0.004),
        ("corners 0.3 d", jittered(0.3, 9), 0.004),
        ("frustum 0.5", frustum(0.5), 0.003),
        ("twist 20", twisted(20.0), 0.003),
        ("twist 45", twisted(45.0), 0.008),
        ("twist 70", twisted(70.0), 0.022),
    ] {
        let [l2, level] = error(&warp);
        println!("| {name} | {:.2} | {:+.2} |", 100.0 * l2, 100.0 * level);
        assert!(l2 < bound, "{name}: {l2}");
        assert!(level.abs() < 0.004, "{name}: {level}");
    }
}
