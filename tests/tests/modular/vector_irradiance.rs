//! Vector irradiance, four coefficients a texel, against direct integration for normals that are tilted by up to 60 degrees
//! from the wall's (Loos et al. 2011, section 6.4 and appendix B).

use glam::{DVec3, Vec3, vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
use mrt_core::reference::error_measure::rel_l2;
use mrt_runtime::blocks::Shape;
use mrt_runtime::{BlockIndex, Bounces, Dictionary, Frame, Level, Light, Outputs};
use mrt_tests::{FrameForTests, baked, scene_of, set_lightfields, with_outputs};
use std::ops::Range;
use std::sync::OnceLock;

const RESOLUTION: usize = 8;

fn dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("standard", "cubes-2d", |config| {
            config.resolution = RESOLUTION;
            config.modes = 64;
            config.coupling.foreign_modes = 64;
            config.coupling.depth = 2;
            config.outputs.vector = true;
            set_lightfields(config, 4, 8, 32);
        })
    })
}

/// White cells with a lamp, after one bounce.
fn lit(cells: &[[i32; 3]], position: Vec3) -> Frame {
    let level = Level::from_cells(cells, Vec3::ONE).expect("cells side by side are a level");
    let outputs = Outputs {
        lightmap: true,
        probes: None,
        vector: true,
    };
    let mut frame = with_outputs(&scene_of(&level, dictionary()), outputs);
    frame.light_with(
        &[Light::sphere(position, 0.05, Vec3::ONE)],
        Bounces::Count(1),
    );
    frame
}

/// Vector irradiance of a texel in the first channel.
fn vector_at(frame: &Frame, block: BlockIndex, texel: usize, normal: Vec3) -> f64 {
    let light = frame.vector_at(block, texel, normal);
    f64::from(light.expect("the frame was asked for it").x)
}

/// Normals in a texel's tangent frame: upright, and rings that are tilted by 20, 40 and 60 degrees.
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

/// One bounce of a block's own light at a point of a wall, for any normal: the texels of the other walls are cut at the
/// normal's horizon, and each counts with its exact form factor. `direct` is the direct irradiance of the block's texels.
fn integrated(shape: &Shape, direct: &[f32], wall: Face, point: DVec3, normal: DVec3) -> f64 {
    let half = 0.5 / RESOLUTION as f64;
    let horizon = HalfSpace::through(point, normal);
    let mut scratch = Vec::new();
    let texels = shape.texels(RESOLUTION).zip(direct);
    texels
        .filter(|((face, _), _)| *face != wall)
        .map(|((face, c), &radiosity)| {
            let (u, v) = (c[face.u_axis()], c[face.v_axis()]);
            let mut polygon = face
                .rectangle([u - half, u + half], [v - half, v + half])
                .to_vec();
            clip_polygon(&mut polygon, &horizon, &mut scratch);
            f64::from(radiosity) * point_to_polygon(point, normal, &polygon)
        })
        .sum()
}

/// Relative L2 error over all texels of a closed room and some of the normals.
fn error(position: Vec3, tilts: Range<usize>) -> f64 {
    let frame = lit(&[[0, 0, 0]], position);
    let direct = frame.direct();
    let shape = frame.scene().level.blocks[0].shape;
    let normals = &normals()[tilts];
    let (mut found, mut exact) = (Vec::new(), Vec::new());
    for (k, (face, point)) in shape.texels(RESOLUTION).enumerate() {
        let axes = [
            DVec3::AXES[face.u_axis()],
            DVec3::AXES[face.v_axis()],
            -face.outward(),
        ];
        for &normal in normals {
            let n = normal.as_dvec3();
            let world = axes[0] * n.x + axes[1] * n.y + axes[2] * n.z;
            exact.push(integrated(shape, &direct, face, point, world));
            found.push(vector_at(&frame, BlockIndex::new(0), k, normal));
        }
    }
    rel_l2(&found, &exact)
}

/// Mean error over three lights. Four coefficients that are linear in the light cannot do better: coefficients that are
/// fitted anew to each lighting err as much (`mrt_core::lighting::hemisphere_sh`). The remaining error is the shape of the
/// light from a single bright wall.
///
/// Measured: 1.1, 2.8 and 4.7 % for lights in the middle, off the middle, and near a corner.
const MEAN_BOUND: f64 = 0.03;

/// As [`MEAN_BOUND`], for each light.
const WORST_BOUND: f64 = 0.055;

/// Error for the wall's own normal, for which the coefficients are exact: that of 64 modes. Measured: 0.85 %.
const UPRIGHT_BOUND: f64 = 0.012;

#[test]
fn vector_irradiance_agrees_with_integration_for_tilted_normals() {
    let lights = [
        vec3(0.5, 0.5, 0.5),
        vec3(0.3, 0.7, 0.6),
        vec3(0.2, 0.3, 0.8),
    ];
    let mut mean = 0.0;
    for position in lights {
        let rings = [0..1, 1..9, 9..17, 17..25].map(|ring| error(position, ring));
        let all = error(position, 0..25);
        println!("light at {position}: upright, 20, 40, 60 degrees {rings:.4?}, all {all:.4}");
        assert!(rings[0] <= UPRIGHT_BOUND);
        assert!(all <= WORST_BOUND);
        mean += all / lights.len() as f64;
    }
    assert!(mean <= MEAN_BOUND, "{mean}");
}

/// For the wall's own normal, vector irradiance is the lightmap's irradiance, whichever way the light came.
#[test]
fn vector_irradiance_of_upright_normals_is_the_irradiance_of_the_wall() {
    let frame = lit(
        &[[0, 0, 0], [1, 0, 0], [1, 0, 1], [2, 0, 1]],
        vec3(0.4, 0.5, 0.6),
    );
    for (index, block) in frame.scene().level.blocks.iter().enumerate() {
        let at = BlockIndex::new(index);
        let texels = 0..block.texels.len();
        let expected: Vec<f64> = texels
            .clone()
            .map(|k| f64::from(frame.indirect_at(at, k).expect("a texel").x))
            .collect();
        let found: Vec<f64> = texels.map(|k| vector_at(&frame, at, k, Vec3::Z)).collect();
        let error = rel_l2(&found, &expected);
        println!("block {index}: {error:.5}");
        // The block's own light is exact, and light of other blocks is fitted in the response basis. Measured: 1.5e-4, and
        // 0.4 % for light by lightfields, beyond the two openings of this table.
        assert!(error <= 0.006, "block {index}: {error}");
    }
}
