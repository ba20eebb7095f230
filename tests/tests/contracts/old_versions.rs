//! Every version of the dictionary format stays readable. The folder `assets/versions` has a file of each.

use glam::{Vec3, vec3};
use mrt_core::container::ByteBudget;
use mrt_runtime::low_level::modular::dictionary::StoredDictionary;
use mrt_runtime::low_level::modular::dictionary_file::DICTIONARY_VERSION;
use mrt_runtime::{
    AssembleConfig, BlockIndex, Bounces, Coupling, Dictionary, Frame, FrameConfig, Level, Light,
};
use mrt_tests::{
    CONVERGED, FrameForTests, MOBILE_BYTES, OLDEST_BYTES, configured, corridor, floor_plan,
    largest_difference, lossless, scene_of, solved,
};

const BYTE_BUDGET: u64 = 16 << 20;

/// A few roundings of `f32`: the old program and this one sum in different orders.
const OLD_FIGURES_TOLERANCE: f64 = 2e-6;

/// Largest share of a bounce that a frame takes away when it scales a channel down.
const MOST_LIMITED: f64 = 3e-3;

fn file(version: u32) -> &'static [u8] {
    match version {
        1 => OLDEST_BYTES,
        DICTIONARY_VERSION => MOBILE_BYTES,
        other => panic!("version {other} has no file"),
    }
}

fn read(version: u32) -> Dictionary {
    let mut budget = ByteBudget::new(BYTE_BUDGET);
    Dictionary::from_bytes_within(file(version), &mut budget).expect("readable")
}

fn read_stored(bytes: &[u8]) -> StoredDictionary<'_> {
    StoredDictionary::read(bytes, &mut ByteBudget::new(BYTE_BUDGET)).expect("readable")
}

/// A corridor with branches and a room of four cells. It has every shape but the closed one.
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

/// Indirect irradiance of texel 37 of each block after one bounce, and after three: computed by the program of version 1
/// (commit 3a2e541) with the file of that version, the level above and the lights below.
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
        Light::sphere(vec3(0.4, 0.7, 0.5), 0.15, vec3(2.0, 1.5, 1.0)),
        Light::sphere(vec3(3.6, 0.6, 2.4), 0.15, vec3(0.5, 0.7, 1.0)),
    ];
    // The old program kept operators in `f32`.
    let scene = configured(&level(), &read(1), &lossless(Coupling::Table));
    let mut frame = Frame::new(&scene, FrameConfig::default());
    for (bounces, expected) in [1, 3].into_iter().zip(&VERSION_1_FIGURES) {
        frame.light_with(&lights, Bounces::Count(bounces));
        let found: Vec<[f32; 3]> = (0..scene.level.blocks.len())
            .map(|block| frame.indirect_at(BlockIndex::new(block), 37))
            .map(|light| light.expect("a texel").to_array())
            .collect();
        // Unlike the old program, frames scale a channel down when truncated operators make light out of nothing, which
        // happens in a closed level.
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
        // Each of several bounces is scaled by a share of its own.
        let tolerance = match bounces {
            1 => OLD_FIGURES_TOLERANCE,
            _ => MOST_LIMITED,
        };
        assert!(error < tolerance, "{bounces} bounces: {error:e}");
    }
}

#[test]
fn version_1_has_no_table_and_always_uses_lightfields() {
    let dictionary = read(1);
    assert!(dictionary.paths.entries.is_empty());
    let joined = |coupling| {
        let config = AssembleConfig {
            coupling,
            ..AssembleConfig::default()
        };
        let scene = configured(&level(), &dictionary, &config);
        let light = Light::sphere(vec3(0.4, 0.7, 0.5), 0.15, Vec3::ONE);
        solved(&scene, &[light], CONVERGED).indirect()
    };
    assert_eq!(joined(Coupling::Table), joined(Coupling::Lightfield));
}

#[test]
fn every_version_lights_a_room() {
    for version in 1..=DICTIONARY_VERSION {
        let scene = scene_of(&floor_plan(&corridor(3), 0.5), &read(version));
        let light = Light::sphere(vec3(0.5, 0.5, 0.5), 0.15, Vec3::ONE);
        let frame = solved(&scene, &[light], Bounces::Count(2));
        for block in 0..3 {
            let lit = frame.indirect_at(BlockIndex::new(block), 7);
            let lit = lit.expect("a texel").x;
            assert!(lit > 1e-3, "version {version}, block {block}: {lit}");
        }
    }
}

#[test]
fn version_1_can_be_written_as_the_newest_version() {
    let old = read_stored(file(1));
    let new = old.to_bytes().expect("it fits");
    assert!(read_stored(&new).decode() == old.decode());
}

#[test]
fn the_newest_version_has_not_changed_unnoticed() {
    let bytes = file(DICTIONARY_VERSION);
    let written = read_stored(bytes).to_bytes().expect("it fits");
    assert!(
        written == bytes,
        "the format is another than that of assets/versions/{DICTIONARY_VERSION}.mrt; if that version has been \
         released, count DICTIONARY_VERSION up and keep reading the old one; otherwise run \
         `mrt bake --preset mobile --resolution 6 --out assets/versions/{DICTIONARY_VERSION}.mrt`"
    );
}
