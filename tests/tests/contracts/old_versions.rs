//! Every version of the dictionary format stays readable: `assets/versions` has a file of each.

use glam::{Vec3, vec3};
use mrt_core::container::ByteBudget;
use mrt_core::storage::Storage;
use mrt_runtime::BlockIndex;
use mrt_runtime::FrameConfig;
use mrt_runtime::low_level::modular::dictionary::StoredDictionary;
use mrt_runtime::low_level::modular::dictionary_file::DICTIONARY_VERSION;
use mrt_runtime::{AssembleConfig, Bounces, Coupling, Dictionary, Frame, Level, Scene};
use mrt_tests::FrameForTests;
use mrt_tests::{CONVERGED, floor_plan, largest_difference, solved, sphere};

const BYTE_BUDGET: u64 = 16 << 20;

/// The old program and this one add up in another order; these are a few roundings of `f32`.
const OLD_FIGURES_TOLERANCE: f64 = 2e-6;

/// What scaling a channel takes of a bounce, at most.
const MOST_LIMITED: f64 = 3e-3;

fn file(version: u32) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/versions");
    std::fs::read(format!("{folder}/{version}.mrt")).expect("a file of each version is committed")
}

fn read(version: u32) -> Dictionary {
    Dictionary::from_bytes_within(&file(version), &mut ByteBudget::new(BYTE_BUDGET))
        .expect("readable")
}

/// A corridor with branches and a room of four: every shape but the closed one.
fn level() -> Level {
    let cells = [
        [0, 0],
        [1, 0],
        [2, 0],
        [3, 0],
        [4, 0],
        [2, 1],
        [2, 2],
        [3, 2],
        [3, 1],
        [1, 1],
        [1, -1],
        [1, 2],
    ];
    let cells: Vec<[i32; 3]> = cells.iter().map(|&[x, z]| [x, 0, z]).collect();
    Level::from_cells(&cells, Vec3::new(0.7, 0.5, 0.3)).expect("cells side by side are a level")
}

/// What the program of version 1 (commit 3a2e541) gave with that file, that level and the lights below: indirect
/// irradiance of texel 37 of each block after one bounce, and after three.
const VERSION_1_FIGURES: [[[f32; 3]; 12]; 2] = [
    [
        [2.5811183, 1.38853, 0.56111044],
        [0.67602354, 0.36977035, 0.15540563],
        [0.24938312, 0.15248656, 0.07959241],
        [0.12676184, 0.09296261, 0.061854053],
        [0.031965822, 0.018697971, 0.0090284],
        [0.25985265, 0.17076826, 0.09938321],
        [0.24229532, 0.23151071, 0.19274916],
        [0.57132685, 0.550498, 0.46086872],
        [0.20374759, 0.16869374, 0.1261047],
        [0.084511966, 0.066655464, 0.047714412],
        [0.14606033, 0.07934369, 0.032817658],
        [0.053094417, 0.04887185, 0.039662868],
    ],
    [
        [5.223545, 2.2927518, 0.75418967],
        [1.6802734, 0.72144586, 0.23440267],
        [0.7305875, 0.33738515, 0.12957317],
        [0.3814157, 0.2057682, 0.09904351],
        [0.1282584, 0.056240786, 0.019361066],
        [0.70298284, 0.35325167, 0.15424271],
        [0.6081696, 0.4325273, 0.2748806],
        [1.1419153, 0.88565594, 0.60506886],
        [0.51509726, 0.3243603, 0.1846426],
        [0.33689982, 0.17776851, 0.08413],
        [0.5042005, 0.20113556, 0.059229136],
        [0.21238184, 0.12787838, 0.06892422],
    ],
];

#[test]
fn version_1_lights_a_level_as_its_program_did() {
    let lights = [
        sphere(vec3(0.4, 0.7, 0.5), 0.15, vec3(2.0, 1.5, 1.0)),
        sphere(vec3(3.6, 0.6, 2.4), 0.15, vec3(0.5, 0.7, 1.0)),
    ];
    // Figures of a program that kept operators in `f32`.
    let config = AssembleConfig {
        transport_storage: Storage::F32,
        negligible: Some(0.0),
        ..AssembleConfig::default()
    };
    let scene = Scene::assemble(&level(), &read(1), &config).expect("it fits");
    let mut frame = Frame::new(&scene, FrameConfig::default());
    for (bounces, expected) in [1, 3].into_iter().zip(&VERSION_1_FIGURES) {
        frame.light_with(&lights, Bounces::Count(bounces));
        let found: Vec<[f32; 3]> = (0..scene.level.blocks.len())
            .map(|block| frame.indirect_at(BlockIndex::new(block), 37))
            .map(|light| light.expect("a texel").to_array())
            .collect();
        // Frames have since learnt to scale a channel in which truncation makes light out of nothing, as it does in
        // a closed level.
        let mut scaled = *expected;
        for channel in 0..3 {
            let sum = |texels: &[[f32; 3]]| -> f64 {
                texels.iter().map(|texel| f64::from(texel[channel])).sum()
            };
            let limited = sum(&found) / sum(expected);
            let allowed = 1.0 - MOST_LIMITED * f64::from(bounces)..1.0 + OLD_FIGURES_TOLERANCE;
            assert!(allowed.contains(&limited), "channel {channel}: {limited}");
            for texel in &mut scaled {
                texel[channel] = (f64::from(texel[channel]) * limited) as f32;
            }
        }
        let error = largest_difference(&found, &scaled);
        // Of several bounces each was scaled, by its own share.
        let tolerance = match bounces {
            1 => OLD_FIGURES_TOLERANCE,
            _ => MOST_LIMITED,
        };
        assert!(error < tolerance, "{bounces} bounces: {error:e}");
    }
}

#[test]
fn version_1_without_a_table_follows_lightfields_when_asked_for_either() {
    let dictionary = read(1);
    assert!(dictionary.paths.entries.is_empty());
    let joined = |coupling| {
        let config = AssembleConfig {
            coupling,
            ..AssembleConfig::default()
        };
        let scene = Scene::assemble(&level(), &dictionary, &config).expect("it fits");
        let light = sphere(vec3(0.4, 0.7, 0.5), 0.15, Vec3::ONE);
        solved(&scene, &[light], CONVERGED).indirect()
    };
    assert_eq!(joined(Coupling::Table), joined(Coupling::Lightfield));
}

#[test]
fn every_version_lights_a_room() {
    for version in 1..=DICTIONARY_VERSION {
        let level = floor_plan(&[[0, 0], [1, 0], [2, 0]], 0.5);
        let scene =
            Scene::assemble(&level, &read(version), &AssembleConfig::default()).expect("it fits");
        let light = sphere(vec3(0.5, 0.5, 0.5), 0.15, Vec3::ONE);
        let frame = solved(&scene, &[light], Bounces::Count(2));
        for block in 0..3 {
            let lit = frame
                .indirect_at(BlockIndex::new(block), 7)
                .expect("a texel")
                .x;
            assert!(lit > 1e-3, "version {version}, block {block}: {lit}");
        }
    }
}

/// Old files are written again in the newest version.
#[test]
fn version_1_becomes_the_newest() {
    let bytes = file(1);
    let old = StoredDictionary::read(&bytes, &mut ByteBudget::new(BYTE_BUDGET)).expect("readable");
    let new = old.to_bytes().expect("it fits");
    let again = StoredDictionary::read(&new, &mut ByteBudget::new(BYTE_BUDGET)).expect("readable");
    assert!(again.decode() == old.decode());
}

#[test]
fn the_newest_version_has_not_changed_unnoticed() {
    let bytes = file(DICTIONARY_VERSION);
    let dictionary = StoredDictionary::read(&bytes, &mut ByteBudget::new(BYTE_BUDGET));
    let written = dictionary.expect("readable").to_bytes().expect("it fits");
    assert!(
        written == bytes,
        "the format is another than that of assets/versions/{DICTIONARY_VERSION}.mrt; if that version has been \
         released, count DICTIONARY_VERSION up and keep reading the old one; otherwise run \
         `mrt bake --preset mobile --resolution 6 --out assets/versions/{DICTIONARY_VERSION}.mrt`"
    );
}
