//! Dictionary files: whatever can be read lights a level.

use super::container_parts::Parts;
use super::sound::write_pixels;
use super::target::{ChangeBytes, MAX_INPUT_BYTES, Target, measured};
use crate::random::Random;
use crate::scenes::COUPLINGS;
use glam::{DVec3, Vec3};
use mrt_core::container::ByteBudget;
use mrt_runtime::blocks::{Block, CubeRotation, Hexahedron};
use mrt_runtime::low_level::modular::dictionary::StoredDictionary;
use mrt_runtime::low_level::modular::pack::{PackConfig, pack};
use mrt_runtime::{
    AssembleConfig, Bounces, Coupling, Dictionary, Frame, FrameConfig, Level, Light, Outputs,
    ProbeOrder, Scene,
};

/// Bytes that may be a dictionary.
pub const TARGET: Target = Target {
    name: "dictionary",
    run,
    mutate,
    words: &[],
};

/// What reading may allocate: enough for inputs of [`MAX_INPUT_BYTES`] in any storage.
const BUDGET: u64 = 4 << 20;

/// What reading may allocate beyond its budget: names and messages of errors.
const BEYOND_BUDGET: u64 = 1 << 16;

/// Most bytes of a scene.
const SCENE_BYTES: usize = 64 << 20;

/// Most texels of a block that is lit, so that an input takes milliseconds. Larger dictionaries are read only.
const MOST_TEXELS: usize = 6 * 16 * 16;

/// Reads the bytes. A dictionary that comes out is written again, packed, and lights levels. Its numbers may be absurd, so
/// the light may be too.
pub fn run(bytes: &[u8]) {
    let (read, allocated) =
        measured(|| Dictionary::from_bytes_within(bytes, &mut ByteBudget::new(BUDGET)));
    let most = BUDGET + BEYOND_BUDGET;
    assert!(allocated <= most, "{allocated} bytes, expected {most}");
    let dictionary = match read {
        Ok(dictionary) => dictionary,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    let again = dictionary.to_bytes().expect("what was read can be written");
    let again = Dictionary::from_bytes(&again).expect("and read again");
    assert_eq!(again, dictionary);
    let stored = StoredDictionary::read(bytes, &mut ByteBudget::new(BUDGET)).expect("as before");
    if 6 * stored.resolution.pow(2) > MOST_TEXELS {
        return;
    }
    for level in levels(&stored) {
        if let Ok(packed) = pack(&level, &stored, &PackConfig::default()) {
            packed.to_bytes().expect("a part can be written");
        }
        for coupling in COUPLINGS {
            light(&level, &stored, coupling);
        }
    }
}

/// Changes the parts of the file, mostly; sometimes its bytes, to try header, table and checksums.
fn mutate(bytes: &[u8], random: &mut Random, change: &mut ChangeBytes<'_>) -> Vec<u8> {
    if random.below(16) == 0 {
        let mut changed = bytes.to_vec();
        change(&mut changed, MAX_INPUT_BYTES);
        return changed;
    }
    let mut parts = Parts::of(bytes);
    let most = MAX_INPUT_BYTES / 4;
    for _ in 0..1 + random.below(3) {
        parts.change(random, change, most);
    }
    let changed = parts.bytes();
    if changed.len() > MAX_INPUT_BYTES {
        return bytes.to_vec();
    }
    changed
}

/// Levels that a dictionary may be for: each of its shapes alone, cells in a row and around a corner, and cells one above
/// another.
fn levels(dictionary: &StoredDictionary<'_>) -> Vec<Level> {
    let mut alone = Level::default();
    for (index, entry) in dictionary.shapes.iter().enumerate() {
        let warp = Hexahedron::cell(DVec3::X * (2 * index) as f64);
        let turn = CubeRotation::about_y(index as u32);
        let mut block = Block::new(entry.shape, turn, warp, Vec3::splat(0.5));
        block.emission[1] = Vec3::ONE;
        alone.blocks.push(block);
    }
    let cells = |cells: &[[i32; 3]]| Level::from_cells(cells, Vec3::splat(0.5));
    let others = [
        cells(&[[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1]]),
        cells(&[[0, 0, 0], [0, 1, 0], [0, 1, 1]]),
    ];
    std::iter::once(alone)
        .chain(others.into_iter().flatten())
        .collect()
}

/// Lights a level with all outputs, if the dictionary has what it needs.
fn light(level: &Level, dictionary: &StoredDictionary<'_>, coupling: Coupling) {
    let config = AssembleConfig {
        coupling,
        max_depth: 3,
        max_bytes: SCENE_BYTES,
        ..AssembleConfig::default()
    };
    let scene = match Scene::assemble(level, dictionary, &config) {
        Ok(scene) => scene,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    let config = FrameConfig {
        outputs: Outputs {
            lightmap: true,
            probes: Some(ProbeOrder::L2),
            vector: true,
        },
        bounces: Bounces::Count(2),
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    frame.add_light(Light::sphere(Vec3::new(0.4, 0.5, 0.6), 0.1, Vec3::ONE));
    frame.add_light(Light::directional(Vec3::new(1.0, -1.0, 0.5), Vec3::ONE));
    for bounces in [Bounces::Count(2), Bounces::Feedback, Bounces::Feedback] {
        frame.set_bounces(bounces);
        let report = frame.solve();
        write_pixels(&frame, &report);
        let _ = frame.irradiance_at(Vec3::splat(0.5), Vec3::Y);
    }
}
