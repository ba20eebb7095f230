//! Vector irradiance, four coefficients a texel, against direct integration for normals up to 60 degrees from the
//! wall's (the paper's section 6.4 and appendix B).

use glam::{DVec3, Vec3, vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Progress;
use mrt_runtime::BlockIndex;
use mrt_runtime::FrameConfig;
use mrt_runtime::{AssembleConfig, Bounces, Dictionary, Frame, Level, Light, Outputs, Scene};
use mrt_tests::FrameForTests;
use std::sync::OnceLock;

const RESOLUTION: usize = 8;

fn dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        let mut config = BakeConfig::preset("standard").expect("a preset");
        config.resolution = RESOLUTION;
        config.modes = 64;
        config.coupling.foreign_modes = 64;
        config.coupling.depth = 2;
        config.outputs.vector = true;
        config.lightfield.positions = 4;
        config.lightfield.directions = 8;
        config.lightfield.lightfield_modes = 32;
        bake(&config, &Progress::silent()).expect("nobody cancels")
    })
}

/// Tilts of normals in a texel's tangent frame: upright, and rings at 20, 40 and 60 degrees.
fn normals() -> Vec<Vec3> {
    let mut normals = vec![Vec3::Z];
    for ring in 1..=3u8 {
        let tilt = (20.0 * f32::from(ring)).to_radians();
        for k in 0..8u8 {
            let turn = f32::from(k) * std::f32::consts::FRAC_PI_4;
            normals.push(vec3(
                tilt.sin() * turn.cos(),
                tilt.sin() * turn.sin(),
                tilt.cos(),
            ));
        }
    }
    normals
}

/// One bounce of a block's own light at a point for any normal: every texel of the other walls is cut at the
/// normal's horizon and counts with its exact form factor.
fn integrated(
    scene: &Scene,
    frame: &Frame,
    block: usize,
    wall: Face,
    point: DVec3,
    normal: DVec3,
) -> f64 {
    let placed = &scene.level.blocks[block];
    let count = placed.texels.len();
    let half = 0.5 / RESOLUTION as f64;
    let horizon = HalfSpace::through(point, normal);
    let mut scratch = Vec::new();
    placed
        .shape
        .texels(RESOLUTION)
        .enumerate()
        .filter(|(_, (face, _))| *face != wall)
        .map(|(k, (face, c))| {
            let (u, v) = (c[face.u_axis()], c[face.v_axis()]);
            let mut polygon = face
                .rectangle([u - half, u + half], [v - half, v + half])
                .to_vec();
            clip_polygon(&mut polygon, &horizon, &mut scratch);
            let radiosity = f64::from(frame.direct()[3 * placed.texels.start + k % count]);
            radiosity * point_to_polygon(point, normal, &polygon)
        })
        .sum()
}

/// Relative L2 error over all texels of a closed room and some of the normals.
fn errors(position: Vec3, tilt: std::ops::Range<usize>) -> f64 {
    let level = Level::from_cells(&[[0, 0, 0]], Vec3::ONE).expect("a cell");
    let scene = Scene::assemble(&level, dictionary(), &AssembleConfig::default()).expect("a level");
    let outputs = Outputs {
        lightmap: true,
        probes: None,
        vector: true,
    };
    let mut frame = Frame::new(
        &scene,
        FrameConfig {
            outputs,
            ..FrameConfig::default()
        },
    );
    let lamp = Light::Sphere {
        position,
        radius: 0.05,
        intensity: Vec3::ONE,
    };
    frame.light_with(&[lamp], Bounces::Count(1));
    let normals = &normals()[tilt];
    let (mut miss, mut size) = (0.0, 0.0);
    for (k, (face, point)) in scene.level.blocks[0].shape.texels(RESOLUTION).enumerate() {
        let axes = [
            DVec3::AXES[face.u_axis()],
            DVec3::AXES[face.v_axis()],
            -face.outward(),
        ];
        for &normal in normals {
            let n = normal.as_dvec3();
            let world = axes[0] * n.x + axes[1] * n.y + axes[2] * n.z;
            let exact = integrated(&scene, &frame, 0, face, point, world);
            let ours = f64::from(
                frame
                    .vector_at(BlockIndex::new(0), k, normal)
                    .expect("asked for")
                    .x,
            );
            miss += (ours - exact) * (ours - exact);
            size += exact * exact;
        }
    }
    (miss / size).sqrt()
}

/// Four coefficients that are linear in the light cannot do better: of all such, those that are fitted to each
/// lighting anew err as much (`mrt_core::lighting::hemisphere_sh`). What is left is the shape of light that one bright wall gives.
/// Measured: 1.1, 2.8 and 4.7 % for lights in the middle, off it, and near a corner.
const MEAN_BOUND: f64 = 0.03;
const WORST_BOUND: f64 = 0.055;

/// A wall without a normal map: the coefficients are exact there, and what is left are 64 modes. Measured 0.85 %.
const UPRIGHT_BOUND: f64 = 0.012;

#[test]
fn tilted_normals_see_what_integration_gives() {
    let lights = [
        vec3(0.5, 0.5, 0.5),
        vec3(0.3, 0.7, 0.6),
        vec3(0.2, 0.3, 0.8),
    ];
    let mut mean = 0.0;
    for position in lights {
        let rings = [0..1, 1..9, 9..17, 17..25].map(|ring| errors(position, ring));
        let all = errors(position, 0..25);
        println!("light at {position}: upright, 20, 40, 60 degrees {rings:.4?}, all {all:.4}");
        assert!(rings[0] <= UPRIGHT_BOUND);
        assert!(all <= WORST_BOUND);
        mean += all / lights.len() as f64;
    }
    assert!(mean <= MEAN_BOUND, "{mean}");
}

#[test]
fn vector_irradiance_crosses_openings_and_follows_the_wall() {
    // Upright normals see the lightmap's irradiance in every block, whatever way its light came.
    let cells = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [2, 0, 1]];
    let level = Level::from_cells(&cells, Vec3::ONE).expect("cells");
    let scene = Scene::assemble(&level, dictionary(), &AssembleConfig::default()).expect("a level");
    let outputs = Outputs {
        lightmap: true,
        probes: None,
        vector: true,
    };
    let mut frame = Frame::new(
        &scene,
        FrameConfig {
            outputs,
            ..FrameConfig::default()
        },
    );
    let lamp = Light::Sphere {
        position: vec3(0.4, 0.5, 0.6),
        radius: 0.05,
        intensity: Vec3::ONE,
    };
    frame.light_with(&[lamp], Bounces::Count(1));
    for (index, block) in scene.level.blocks.iter().enumerate() {
        let block_index = BlockIndex::new(index);
        let (mut miss, mut size) = (0.0, 0.0);
        for k in 0..block.texels.len() {
            let exact = f64::from(frame.indirect_at(block_index, k).expect("a texel").x);
            let ours = f64::from(
                frame
                    .vector_at(block_index, k, Vec3::Z)
                    .expect("asked for")
                    .x,
            );
            miss += (ours - exact) * (ours - exact);
            size += exact * exact;
        }
        let error = (miss / size).sqrt();
        println!("block {index}: {error:.5}");
        // Exact for own light; that of other blocks is fitted in the response basis. Measured 1.5e-4, and 0.4 % where
        // light came by lightfields, beyond the two openings of this table.
        assert!(error <= 0.006, "block {index}: {error}");
    }
}
