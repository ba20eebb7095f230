//! Rooms with doors and windows in their walls, against closed forms: the lit room, the next room, and the room after
//! that.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::reference::error_measure::rel_l2;
use mrt_runtime::blocks::{Block, Shape};
use mrt_runtime::low_level::level::shape::Hole;
use mrt_runtime::{Bounces, Dictionary, Level, Light, Scene};
use mrt_tests::{
    FrameForTests, baked, by_texel, connected, point_and_normal, scene_of, set_lightfields, solved,
};
use std::f64::consts::PI;
use std::sync::OnceLock;

/// Texels along an edge of a wall. The edges of holes do not fall on edges of texels.
const RESOLUTION: usize = 8;

const LAMP: DVec3 = DVec3::new(0.437, 0.613, 0.389);

/// The standard preset at half its resolution.
fn dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("standard", "rooms", |config| {
            config.resolution = RESOLUTION;
            config.outputs.probes = 0;
            config.coupling.depth = 2;
            set_lightfields(config, 8, 12, 48);
        })
    })
}

/// A lit room, a second room behind a hole at x = 1, and a dead end behind the missing face of the second at x = 2.
fn level(hole: Hole, albedo: f32) -> Level {
    let (room, passage) = match hole {
        Hole::Doorway => ("door", "doorway"),
        Hole::Window => ("window", "window_end"),
    };
    let place = |name: &str, orientation: CubeRotation, x: f64| {
        let shape = Shape::from_name(name).expect("a shape");
        let warp = Hexahedron::cell(DVec3::new(x, 0.0, 0.0));
        Block::new(shape, orientation, warp, Vec3::splat(albedo))
    };
    let half_turn = CubeRotation::about_y(2);
    Level {
        blocks: vec![
            place(room, CubeRotation::IDENTITY, 0.0),
            place(passage, half_turn, 1.0),
            place("dead_end", half_turn, 2.0),
        ],
        connections: vec![connected(0, Face::PosX, 1), connected(1, Face::PosX, 2)],
        doors: Vec::new(),
        mesh: None,
    }
}

/// Pieces along an edge of a wall of the lit room. The exact light is the sum over all pieces.
const FINE: usize = 40;

/// A piece of a wall of the lit room.
struct Piece {
    center: DVec3,
    normal: DVec3,
    polygon: [DVec3; 4],
    /// Direct irradiance.
    direct: f64,
}

/// The walls of the lit room without the hole. Edges of both holes are edges of pieces.
fn pieces(hole: Hole) -> Vec<Piece> {
    let [u, v] = hole.rectangle();
    let mut pieces = Vec::new();
    for face in Face::ALL {
        for k in 0..FINE * FINE {
            let center = face.texel_center(FINE, k / FINE, k % FINE);
            let (cu, cv) = (center[face.u_axis()], center[face.v_axis()]);
            let in_hole = face == Face::PosX && u[0] < cu && cu < u[1] && v[0] < cv && cv < v[1];
            if in_hole {
                continue;
            }
            let half = 0.5 / FINE as f64;
            let normal = -face.outward();
            pieces.push(Piece {
                center,
                normal,
                polygon: face.rectangle([cu - half, cu + half], [cv - half, cv + half]),
                direct: sphere_light_irradiance(LAMP - center, normal, 0.1),
            });
        }
    }
    pieces
}

/// True if the segment passes the hole in the plane x = 1.
fn passes(hole: Hole, from: DVec3, to: DVec3) -> bool {
    let t = (1.0 - from.x) / (to.x - from.x);
    let at = from + (to - from) * t;
    let [u, v] = hole.rectangle();
    u[0] < at.z && at.z < u[1] && v[0] < at.y && at.y < v[1]
}

/// Exact irradiance at a point of one of the three blocks after one bounce on the walls of the lit room, with albedo 1.
fn exact(hole: Hole, pieces: &[Piece], block: usize, point: DVec3, normal: DVec3) -> f64 {
    if block == 0 {
        // The wall that the point is on is left out: Lambert's formula would take it for the whole hemisphere.
        return pieces
            .iter()
            .filter(|piece| piece.normal != normal)
            .map(|piece| piece.direct * point_to_polygon(point, normal, &piece.polygon))
            .sum();
    }
    // Nearly all pieces are far away, so the middle of a piece stands for the piece.
    let area = 1.0 / (FINE * FINE) as f64;
    pieces
        .iter()
        .filter(|piece| passes(hole, piece.center, point))
        .map(|piece| {
            let offset = piece.center - point;
            let cosines = normal.dot(offset).max(0.0) * (-piece.normal.dot(offset)).max(0.0);
            piece.direct * cosines * area / (PI * offset.length_squared().powi(2))
        })
        .sum()
}

/// Without the direct light that falls through the hole onto walls of other blocks, which [`exact`] leaves out.
fn only_first_block(scene: &Scene, mut direct: Vec<f32>) -> Vec<f32> {
    direct[3 * scene.level.blocks[0].texels.end..].fill(0.0);
    direct
}

/// Bounds for the lit room, the next room, and the room after that. Measured: 0.025, 0.056, 0.046.
const DOOR_ERROR: [f64; 3] = [0.035, 0.08, 0.08];

/// As [`DOOR_ERROR`]. Measured: 0.012, 0.077, 0.046.
const WINDOW_ERROR: [f64; 3] = [0.02, 0.10, 0.08];

#[test]
fn light_behind_holes_agrees_with_form_factors() {
    let albedo = 0.8;
    for (hole, bounds) in [(Hole::Doorway, DOOR_ERROR), (Hole::Window, WINDOW_ERROR)] {
        let scene = scene_of(&level(hole, albedo), dictionary());
        let lamp = Light::sphere(LAMP.as_vec3(), 0.1, Vec3::ONE);
        let mut frame = solved(&scene, &[lamp], Bounces::Count(0));
        let direct = only_first_block(&scene, frame.direct());
        frame.light_from(&direct, Bounces::Count(1));
        let found = by_texel(&scene, &frame.indirect());
        let pieces = pieces(hole);
        for (block, bound) in bounds.into_iter().enumerate() {
            let mut ours = Vec::new();
            let mut theirs = Vec::new();
            let placed = &scene.level.blocks[block];
            for (texel, (face, center)) in
                placed.texels.clone().zip(placed.shape.texels(RESOLUTION))
            {
                if placed.shape.is_in_hole(face, center) {
                    assert_eq!(found[texel], [0.0; 3], "a texel in a hole is dark");
                    continue;
                }
                let (point, normal) = point_and_normal(&scene, texel);
                ours.push(f64::from(found[texel][0]));
                theirs.push(f64::from(albedo) * exact(hole, &pieces, block, point, normal));
            }
            let error = rel_l2(&ours, &theirs);
            let ratio = ours.iter().sum::<f64>() / theirs.iter().sum::<f64>();
            println!("{hole:?}, block {block}: error {error:.4}, sum x {ratio:.4}");
            assert!(error <= bound, "{hole:?}, block {block}: {error}");
        }
    }
}

#[test]
fn direct_light_falls_through_the_hole_and_nowhere_else() {
    for hole in Hole::ALL {
        let scene = scene_of(&level(hole, 0.5), dictionary());
        let lamp = Light::sphere(LAMP.as_vec3(), 0.0, Vec3::ONE);
        let frame = solved(&scene, &[lamp], Bounces::Count(1));
        let direct = by_texel(&scene, &frame.direct());
        let mut lit = 0;
        for block in 1..3 {
            for texel in scene.level.blocks[block].texels.clone() {
                let (point, normal) = point_and_normal(&scene, texel);
                let faces = normal.dot(LAMP - point) > 1e-6;
                let expected = faces && passes(hole, LAMP, point);
                assert_eq!(direct[texel][0] > 0.0, expected, "{hole:?}, {point}");
                lit += usize::from(expected);
            }
        }
        assert!(lit > 10, "{hole:?}: {lit}");
    }
}
