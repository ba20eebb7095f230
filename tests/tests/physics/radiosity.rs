//! The exact solver agrees with closed forms and conservation laws.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::radiosity::direct::{PointLight, direct, direct_mean, direct_quarters};
use mrt_core::reference::radiosity::solve::solve;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_core::reference::radiosity::{ExactError, ExactScene, Side};
use mrt_tests::with_threads;

/// Form factors are stored in `f32`. The sum of a row of a thousand differs from 1 by less than this.
const ROW_SUM_TOLERANCE: f64 = 1e-6;

const L_SHAPE: [[i32; 3]; 4] = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [1, 1, 1]];

fn sides_of(scene_cells: &[[i32; 3]]) -> Vec<[Side; 6]> {
    let side = |cell: [i32; 3], face: Face| {
        let mut across = cell;
        across[face.axis()] += if face.is_positive() { 1 } else { -1 };
        let found = scene_cells.iter().position(|&c| c == across);
        found.map_or(Side::Wall, |b| Side::Opening(b, face.opposite()))
    };
    let sides = |&cell: &[i32; 3]| Face::ALL.map(|face| side(cell, face));
    scene_cells.iter().map(sides).collect()
}

fn mapped(cells: &[[i32; 3]], map: impl Fn(DVec3) -> DVec3) -> Vec<Hexahedron> {
    let block = |cell: &[i32; 3]| {
        let mut block = Hexahedron::cell(DVec3::from_array(cell.map(f64::from)));
        block.corners = block.corners.map(&map);
        block
    };
    cells.iter().map(block).collect()
}

/// A perspective map: lines stay lines and planes stay planes, but a cube does not become a parallelepiped.
fn perspective(p: DVec3) -> DVec3 {
    DVec3::new(p.x + 0.2 * p.y, 1.3 * p.y, 0.9 * p.z) / (1.0 + 0.1 * p.x + 0.07 * p.z)
}

fn closed_levels() -> Vec<(&'static str, ExactScene)> {
    let shear = DMat3::from_cols(
        DVec3::new(1.0, 0.0, 0.1),
        DVec3::new(0.4, 1.5, 0.0),
        DVec3::new(-0.2, 0.3, 0.7),
    );
    let build = |cells: &[[i32; 3]], map: &dyn Fn(DVec3) -> DVec3| {
        ExactScene::new(mapped(cells, map), sides_of(cells), 6).unwrap()
    };
    let room = [
        [0, 0, 0],
        [1, 0, 0],
        [0, 0, 1],
        [1, 0, 1],
        [2, 0, 1],
        [2, 1, 1],
    ];
    vec![
        ("cube", ExactScene::from_cells(&[[0, 0, 0]], 6).unwrap()),
        ("L", ExactScene::from_cells(&L_SHAPE, 6).unwrap()),
        ("room", ExactScene::from_cells(&room, 6).unwrap()),
        ("sheared L", build(&L_SHAPE, &|p| shear * p)),
        ("warped L", build(&L_SHAPE, &perspective)),
        ("warped room", build(&room, &perspective)),
    ]
}

/// Form factor between two walls: the mean over the texels of one, weighted by area, of the sum over the texels of the
/// other.
fn wall_factor(scene: &ExactScene, transport: &Transport, from: usize, to: usize) -> f64 {
    let texels = scene.resolution() * scene.resolution();
    let range = |wall: usize| wall * texels..(wall + 1) * texels;
    let mut sum = 0.0;
    let mut area = 0.0;
    for receiver in range(from) {
        let factors: f64 = range(to).map(|s| transport.factor(receiver, s)).sum();
        sum += scene.areas()[receiver] * factors;
        area += scene.areas()[receiver];
    }
    sum / area
}

#[test]
fn unit_squares_have_the_closed_form_factors() {
    let scene = ExactScene::from_cells(&[[0, 0, 0]], 24).unwrap();
    let transport = Transport::build(&scene);
    // Parallel unit squares at distance 1; Howell, configuration C-11.
    let parallel = 2.0 / PI
        * ((4.0f64 / 3.0).sqrt().ln() + 2.0 * 2f64.sqrt() * (1.0 / 2f64.sqrt()).atan() - PI / 2.0);
    // Perpendicular unit squares with a common edge; configuration C-14.
    let perpendicular = 1.0 / PI
        * (2.0 * 1f64.atan() - 2f64.sqrt() * (1.0 / 2f64.sqrt()).atan()
            + 0.25 * (3.0f64 / 4.0).ln());
    // Errors are those of the midpoint rule over 24² receivers. The perpendicular factor jumps at the shared edge.
    assert!((wall_factor(&scene, &transport, 0, 1) - parallel).abs() < 1e-4);
    assert!((wall_factor(&scene, &transport, 0, 2) - perpendicular).abs() < 1e-3);
    // The closed forms themselves fill the hemisphere.
    assert!((parallel + 4.0 * perpendicular - 1.0).abs() < 1e-12);
}

#[test]
fn a_square_seen_through_two_openings_has_the_closed_form_factor() {
    let scene = ExactScene::from_cells(&[[0, 0, 0], [1, 0, 0], [2, 0, 0]], 24).unwrap();
    let transport = Transport::build(&scene);
    let end = scene.walls().len() - 5;
    assert_eq!(scene.walls()[end].face, Face::PosX);
    // Parallel unit squares at distance 3: X = Y = 1/3.
    let x = 1.0f64 / 3.0;
    let root = (1.0 + x * x).sqrt();
    let expected = 2.0 / (PI * x * x)
        * (((1.0 + x * x).powi(2) / (1.0 + 2.0 * x * x)).sqrt().ln()
            + 2.0 * x * root * (x / root).atan()
            - 2.0 * x * x.atan());
    let found = wall_factor(&scene, &transport, 0, end);
    // The error is that of the midpoint rule over a smooth integrand.
    assert!((found - expected).abs() < 1e-4 * expected, "{found}");
}

#[test]
fn form_factors_of_a_texel_add_up_to_one_in_closed_levels() {
    for (name, scene) in closed_levels() {
        let transport = Transport::build(&scene);
        let sums = transport
            .irradiance(&vec![[1.0; 4]; scene.texel_count()])
            .unwrap();
        for (texel, sum) in sums.iter().enumerate() {
            assert!(
                (sum - 1.0).abs() < ROW_SUM_TOLERANCE,
                "{name}, {texel}: {sum}"
            );
        }
    }
}

#[test]
fn a_mild_warp_without_planar_faces_still_covers_the_hemisphere() {
    let twist = |p: DVec3| {
        let angle = 0.1 * p.y;
        let (x, z) = (p.x - 0.5, p.z - 0.5);
        DVec3::new(
            x * angle.cos() - z * angle.sin(),
            p.y,
            x * angle.sin() + z * angle.cos(),
        )
    };
    let cells = [[0, 0, 0], [0, 1, 0]];
    let scene = ExactScene::new(mapped(&cells, twist), sides_of(&cells), 8).unwrap();
    let transport = Transport::build(&scene);
    let sums = transport
        .irradiance(&vec![[1.0; 4]; scene.texel_count()])
        .unwrap();
    let worst = sums.iter().fold(0.0, |w: f64, s| w.max((s - 1.0).abs()));
    // A twist by 0.1 rad bends faces by 0.025. The solver neglects that a bent face hides parts of itself and sends light to
    // itself. For single texels this is an error of that order, and on average far less.
    assert!(worst < 0.03, "{worst}");
    let mean = sums.iter().sum::<f64>() / sums.len() as f64;
    assert!((mean - 1.0).abs() < 3e-3, "{mean}");
}

#[test]
fn a_furnace_glows_as_the_geometric_series_says() {
    const EMISSION: f64 = 2.0;
    for (name, scene) in closed_levels() {
        let transport = Transport::build(&scene);
        for albedo in [0.3, 0.9] {
            // Direct light of e / a makes the first reflection emit e.
            let direct = vec![[EMISSION / albedo; 4]; scene.texel_count()];
            let albedos = vec![albedo; scene.texel_count()];
            let irradiance =
                solve(&scene, &transport, &direct, ReferenceBounces::All, &albedos).unwrap();
            for e in irradiance {
                let radiosity = EMISSION + albedo * e;
                let expected = EMISSION / (1.0 - albedo);
                assert!(
                    (radiosity / expected - 1.0).abs() < 1e-6,
                    "{name}, {albedo}: {e}"
                );
            }
        }
    }
}

#[test]
fn exchange_between_walls_is_reciprocal() {
    for (name, scene) in closed_levels() {
        let transport = Transport::build(&scene);
        let texels = scene.resolution() * scene.resolution();
        let area = |wall: usize| -> f64 { scene.areas()[wall * texels..][..texels].iter().sum() };
        for a in 0..scene.walls().len() {
            for b in 0..a {
                let there = area(a) * wall_factor(&scene, &transport, a, b);
                let back = area(b) * wall_factor(&scene, &transport, b, a);
                // The error of the midpoint rule over 6² receivers, which is largest for walls that share an edge.
                let tolerance = 0.02 * area(a).min(area(b));
                assert!((there - back).abs() < tolerance, "{name}: {there} {back}");
            }
        }
    }
}

#[test]
fn single_texels_that_are_far_apart_are_reciprocal() {
    let scene = ExactScene::from_cells(&[[0, 0, 0], [1, 0, 0]], 16).unwrap();
    let transport = Transport::build(&scene);
    let end = 5 * 256;
    assert_eq!(scene.walls()[5].face, Face::PosX);
    for (a, b) in [(0, end), (17, end + 200), (255, end + 3), (130, end + 90)] {
        let (there, back) = (transport.factor(a, b), transport.factor(b, a));
        // Receivers are points. The error is of second order in texel size over distance, (1/32)² here.
        assert!((there / back - 1.0).abs() < 1e-3, "{there} {back}");
    }
}

#[test]
fn energy_never_grows() {
    let scene = ExactScene::from_cells(&L_SHAPE, 6).unwrap();
    let transport = Transport::build(&scene);
    let mut radiosity: Vec<f64> = (0..scene.texel_count())
        .map(|k| ((k * 7919) % 101) as f64)
        .collect();
    let mut largest = 100.0;
    for _ in 0..20 {
        let quarters: Vec<[f64; 4]> = radiosity.iter().map(|&b| [b; 4]).collect();
        radiosity = transport.irradiance(&quarters).unwrap();
        let next = radiosity.iter().copied().fold(0.0, f64::max);
        assert!(next <= largest * (1.0 + ROW_SUM_TOLERANCE));
        assert!(radiosity.iter().all(|&b| b >= 0.0));
        largest = next;
    }
}

#[test]
fn light_is_lost_through_the_sky() {
    let mut sides = sides_of(&L_SHAPE);
    sides[3][Face::PosY.index()] = Side::Sky;
    let scene = ExactScene::new(mapped(&L_SHAPE, |p| p), sides, 6).unwrap();
    let transport = Transport::build(&scene);
    let ones = vec![[1.0; 4]; scene.texel_count()];
    let sums = transport.irradiance(&ones).unwrap();
    assert!(sums.iter().all(|&sum| sum < 1.0 + ROW_SUM_TOLERANCE));
    // This texel sees the sky through one opening: a parallel square at distance 2.
    let below = scene.walls().iter().find(|wall| wall.block == 2).unwrap();
    assert!(sums[below.first_texel + 15] < 0.99);
}

#[test]
fn light_in_an_unconnected_block_is_exactly_zero() {
    let scene = ExactScene::from_cells(&[[0, 0, 0], [1, 0, 0], [3, 0, 0], [2, 1, 0]], 8).unwrap();
    let light = PointLight::unit(DVec3::new(0.6, 0.5, 0.4));
    let transport = Transport::build(&scene);
    let quarters = direct_quarters(&scene, &light, 2);
    let albedo = vec![0.9; scene.texel_count()];
    let indirect = solve(
        &scene,
        &transport,
        &quarters,
        ReferenceBounces::All,
        &albedo,
    )
    .unwrap();
    let straight = direct(&scene, &light);
    for wall in scene.walls() {
        for texel in wall.first_texel..wall.first_texel + 64 {
            if wall.block >= 2 {
                assert_eq!((straight[texel], indirect[texel]), (0.0, 0.0));
            } else {
                assert!(indirect[texel] > 0.0);
            }
        }
    }
}

#[test]
fn direct_light_of_a_closed_level_is_all_its_power() {
    // The flux of an isotropic point light is 4 pi I. The tolerance is for the midpoint rule over 16 x 8 points along a side.
    for scene in [
        ExactScene::from_cells(&L_SHAPE, 16).unwrap(),
        ExactScene::new(mapped(&L_SHAPE, perspective), sides_of(&L_SHAPE), 16).unwrap(),
    ] {
        let position = scene.blocks()[1].point(DVec3::new(0.4, 0.55, 0.6));
        let e = direct_mean(&scene, &PointLight::unit(position), 8);
        let flux: f64 = e.iter().zip(scene.areas()).map(|(e, a)| e * a).sum();
        assert!((flux / (4.0 * PI) - 1.0).abs() < 1e-3, "{flux}");
    }
}

#[test]
fn all_bounces_are_the_limit_of_many() {
    let scene = ExactScene::from_cells(&L_SHAPE, 6).unwrap();
    let transport = Transport::build(&scene);
    let light = PointLight::unit(DVec3::new(0.3, 0.4, 0.6));
    let quarters = direct_quarters(&scene, &light, 4);
    let albedo = vec![0.8; scene.texel_count()];
    let run = |bounces| solve(&scene, &transport, &quarters, bounces, &albedo).unwrap();
    let all = run(ReferenceBounces::All);
    // 80 bounces leave out a share of 0.8^80 = 2e-8, and the limit is solved to 1e-7 of the first bounce.
    assert!(rel_l2(&run(ReferenceBounces::Count(80)), &all) < 1e-6);
    assert_eq!(
        run(ReferenceBounces::Count(1)),
        run(ReferenceBounces::First)
    );
    assert!(run(ReferenceBounces::Count(0)).iter().all(|&e| e == 0.0));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let solved_with = |threads| {
        with_threads(threads, || {
            let scene = ExactScene::from_cells(&L_SHAPE, 6).unwrap();
            let light = PointLight::unit(DVec3::new(0.3, 0.4, 0.6));
            let quarters = direct_quarters(&scene, &light, 3);
            let transport = Transport::build(&scene);
            let albedo = vec![0.7; scene.texel_count()];
            solve(
                &scene,
                &transport,
                &quarters,
                ReferenceBounces::All,
                &albedo,
            )
            .unwrap()
        })
    };
    assert_eq!(solved_with(1), solved_with(3));
}

#[test]
fn faulty_inputs_are_refused_by_a_named_error() {
    let cell = Hexahedron::cell(DVec3::ZERO);
    let beyond = Hexahedron::cell(DVec3::new(1.5, 0.0, 0.0));
    let walls = [Side::Wall; 6];
    let with = |face: Face, side| {
        let mut sides = walls;
        sides[face.index()] = side;
        sides
    };
    let one_way = vec![with(Face::PosX, Side::Opening(7, Face::NegX))];
    let error = ExactScene::new(vec![cell], one_way, 4).unwrap_err();
    assert!(matches!(error, ExactError::OneWayOpening { other: 7, .. }));
    let apart = vec![
        with(Face::PosX, Side::Opening(1, Face::NegX)),
        with(Face::NegX, Side::Opening(0, Face::PosX)),
    ];
    let error = ExactScene::new(vec![cell, beyond], apart, 4).unwrap_err();
    assert!(matches!(error, ExactError::CornersApart { found: 0.5, .. }));
    for resolution in [0, 1 << 20, usize::MAX] {
        let error = ExactScene::from_cells(&[[0, 0, 0]], resolution).unwrap_err();
        assert!(matches!(error, ExactError::TexelCount { .. }), "{error}");
    }
    let error = ExactScene::from_cells(&[[2, 0, 0], [2, 0, 0]], 4).unwrap_err();
    assert_eq!(error, ExactError::DuplicateCell { cell: [2, 0, 0] });
    let error = ExactScene::new(vec![cell], Vec::new(), 4).unwrap_err();
    assert!(matches!(error, ExactError::SideCount { found: 0, .. }));

    let scene = ExactScene::from_cells(&[[0, 0, 0]], 2).unwrap();
    let transport = Transport::build(&scene);
    let light = vec![[1.0; 4]; 24];
    for (albedo, bounces) in [
        (1.0, ReferenceBounces::All),
        (1.1, ReferenceBounces::First),
        (f64::NAN, ReferenceBounces::First),
        (-0.1, ReferenceBounces::All),
    ] {
        let error = solve(&scene, &transport, &light, bounces, &[albedo; 24]).unwrap_err();
        assert!(matches!(error, ExactError::Albedo { .. }), "{error}");
    }
    let error = solve(
        &scene,
        &transport,
        &light,
        ReferenceBounces::All,
        &[0.5; 23],
    )
    .unwrap_err();
    assert!(matches!(error, ExactError::Length { found: 23, .. }));
}
