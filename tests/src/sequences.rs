//! Random levels, lights and sequences of frames, from seeds.

use crate::FrameForTests;
use crate::{Random, random_cells};
use glam::{DVec3, Vec3};
use mrt_core::container::ByteBudget;
use mrt_core::storage::Storage;
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Progress;
use mrt_runtime::blocks::Door;
use mrt_runtime::{AssembleConfig, Dictionary, Frame, Level, Light, Scene};
use std::sync::OnceLock;

/// 6² texels a wall, 12 coefficients, probes 2³: whatever does not depend on sizes is tested with it, many times.
pub fn mobile_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/versions/2.mrt");
        let bytes = std::fs::read(path).expect("a file of each version is committed");
        Dictionary::from_bytes_within(&bytes, &mut ByteBudget::new(16 << 20)).expect("readable")
    })
}

/// The level with the mobile dictionary.
pub fn mobile(level: &Level) -> Scene {
    Scene::assemble(level, mobile_dictionary(), &AssembleConfig::default()).expect("the level fits")
}

/// A dictionary with vector irradiance, as small as they come.
pub fn vector_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        let mut config = BakeConfig::preset("mobile").expect("a preset");
        // Odd, so that texels lie on mirrors' planes.
        config.resolution = 5;
        config.modes = 8;
        config.coupling.emission_modes = 8;
        config.coupling.response_modes = 8;
        config.coupling.foreign_modes = 8;
        config.coupling.depth = 2;
        config.outputs.vector = true;
        config.lightfield.positions = 4;
        config.lightfield.directions = 4;
        config.lightfield.lightfield_modes = 16;
        bake(&config, &Progress::silent()).expect("nobody cancels")
    })
}

/// How operators can be kept.
pub const STORAGES: [Storage; 3] = [Storage::F32, Storage::F16, Storage::Int8];

/// The level with all operators kept in one way.
pub fn stored(level: &Level, dictionary: &Dictionary, storage: Storage) -> Scene {
    let config = AssembleConfig {
        shape_storage: storage,
        transport_storage: storage,
        ..AssembleConfig::default()
    };
    Scene::assemble(level, dictionary, &config).expect("the level fits")
}

/// Seldom dark, often bright, up to 0.99.
pub fn random_albedo(random: &mut Random) -> Vec3 {
    let mut value = || 0.99 * (1.0 - random.unit().powi(3)) as f32;
    Vec3::new(value(), value(), value())
}

/// A heap of cells with loops, doors, openings to the outside, panels that shine now and then; every other one bent.
pub fn random_level(random: &mut Random, blocks: usize) -> Level {
    let cells: Vec<[i32; 3]> = random_cells(random, blocks)
        .into_iter()
        .map(|[x, z]| [x, 0, z])
        .collect();
    let mut level = Level::from_cells(&cells, Vec3::ZERO).expect("cells side by side are a level");
    furnish(random, &mut level);
    level
}

/// Colours, doors, openings, panels and bends for a level of cells.
pub fn furnish(random: &mut Random, level: &mut Level) {
    for block in &mut level.blocks {
        block.albedo = std::array::from_fn(|_| random_albedo(random));
    }
    let unconnected = [0.0, 0.2][random.below(2)];
    level.connections.retain(|_| random.unit() >= unconnected);
    for connection in 0..level.connections.len() {
        if random.unit() < 0.2 {
            let value = [0.0, 1.0, random.unit() as f32][random.below(3)];
            level.doors.push(Door { connection, value });
        }
    }
    if random.unit() < 0.3 {
        let block = random.below(level.blocks.len());
        level.blocks[block].emission[random.below(6)] = Vec3::new(1.0, 0.5, 2.0);
    }
    if random.unit() < 0.5 {
        for block in &mut level.blocks {
            for corner in &mut block.warp.corners {
                *corner = bent(*corner);
            }
        }
    }
    assert_eq!(level.check(), Ok(()));
}

/// A gentle bend of the plan: walls stay upright, floors and ceilings flat.
fn bent(point: DVec3) -> DVec3 {
    let DVec3 { x, y, z } = point;
    DVec3::new(
        x + 0.12 * (0.9 * z).sin(),
        0.8 * y,
        z + 0.1 * (0.7 * x).sin(),
    )
}

/// A point of a random block, often next to a wall, sometimes on one.
pub fn random_position(random: &mut Random, level: &Level) -> Vec3 {
    let block = &level.blocks[random.below(level.blocks.len())];
    let mut coordinate = || {
        let near = 0.1 * random.unit().powi(3);
        [near, 1.0 - near, 0.05 + 0.9 * random.unit()][random.below(3)]
    };
    let unit = DVec3::new(coordinate(), coordinate(), coordinate());
    block.warp.point(unit).as_vec3()
}

/// From 0 to 1e6 W/sr, most of them near 1.
pub fn random_intensity(random: &mut Random) -> Vec3 {
    let scale = match random.below(8) {
        0 => 0.0,
        1 => 1e6,
        2 => 1e3,
        _ => random.unit() as f32,
    };
    Vec3::new(1.0, 0.5, 0.25) * scale
}

/// A light of any kind.
pub fn random_light(random: &mut Random, level: &Level) -> Light {
    let position = random_position(random, level);
    let radius = [0.0, 0.1, 0.3][random.below(3)];
    let intensity = random_intensity(random);
    let mut side = || random.unit() as f32 - 0.5;
    let direction = Vec3::new(side(), side(), side() + 0.01);
    match random.below(6) {
        0 => Light::Spot {
            position,
            radius,
            intensity,
            direction,
            inner_angle: 0.3,
            outer_angle: 0.8,
        },
        1 => Light::Directional {
            direction,
            irradiance: intensity,
        },
        _ => Light::Sphere {
            position,
            radius,
            intensity,
        },
    }
}

/// Lights of a level that fit its scene: positions are rounded, and one on a wall of a bent block may be outside.
pub fn random_lights(
    random: &mut Random,
    level: &Level,
    scene: &Scene,
    count: usize,
) -> Vec<Light> {
    let lights = (0..count).map(|_| random_light(random, level));
    let lights: Vec<Light> = lights.collect();
    let fits =
        |light: &Light| mrt_runtime::low_level::light::placed::place(&scene.level, *light).is_ok();
    lights.into_iter().filter(fits).collect()
}

/// Everything that a frame shows, by name.
pub fn outputs(frame: &Frame) -> [(&'static str, Vec<f32>); 6] {
    let probes = frame.probes().map(|p| p.values().as_flattened().to_vec());
    [
        ("direct", frame.direct()),
        ("coefficients", frame.coefficients()),
        ("indirect", frame.indirect()),
        (
            "lightmap",
            frame.lightmap().pixels().as_flattened().to_vec(),
        ),
        ("probes", probes.unwrap_or_default()),
        ("vector", frame.vector().to_vec()),
    ]
}

/// The same, bit by bit.
pub fn shown(frame: &Frame) -> Vec<(&'static str, Vec<u32>)> {
    let outputs = outputs(frame).into_iter();
    outputs
        .map(|(name, values)| (name, values.into_iter().map(f32::to_bits).collect()))
        .collect()
}

/// Where two frames show something else, if anywhere: what, the index, and both values.
pub fn difference(a: &Frame, b: &Frame) -> Option<String> {
    for ((name, a), (_, b)) in shown(a).into_iter().zip(shown(b)) {
        assert_eq!(a.len(), b.len(), "{name}");
        let differ = a.iter().zip(&b).filter(|(a, b)| a != b).count();
        if let Some(k) = a.iter().zip(&b).position(|(a, b)| a != b) {
            let (a, b) = (f32::from_bits(a[k]), f32::from_bits(b[k]));
            return Some(format!("{name}[{k}]: {a:e}, {b:e} ({differ} differ)"));
        }
    }
    None
}
