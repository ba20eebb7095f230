//! Dictionaries in fewer bytes: errors of the light, reading in place, and packing for a level.

use glam::{DVec3, Vec3, dvec3, vec3};
use mrt_core::container::ByteBudget;
use mrt_core::storage::Storage;
use mrt_runtime::blocks::WarpTransport;
use mrt_runtime::low_level::modular::dictionary::{OperatorMatrix, StoredDictionary, Variant};
use mrt_runtime::low_level::modular::pack::{PackConfig, pack};
use mrt_runtime::{
    AssembleConfig, AssembleError, Bounces, Coupling, Dictionary, Frame, FrameConfig, Level, Light,
    Scene,
};
use mrt_tests::{
    COUPLINGS, FrameForTests, corridor, default_dictionary, floor_plan, lossless,
    mobile_dictionary, refusal, relative_l2, square,
};

const BYTE_BUDGET: u64 = 64 << 20;

/// Relative L2 error of indirect irradiance over a level, against a dictionary in `f32`.
const F16_TOLERANCE: f64 = 3e-4;

/// [`F16_TOLERANCE`] with lightfields: a corridor of the mobile preset errs by 0.033 %, since light there is a sum of more
/// products, with coefficients of both signs.
const F16_LIGHTFIELD_TOLERANCE: f64 = 3.5e-4;

/// As [`F16_TOLERANCE`].
const INT8_TOLERANCE: f64 = 5e-3;

fn f16_tolerance(coupling: Coupling) -> f64 {
    match coupling {
        Coupling::Table => F16_TOLERANCE,
        Coupling::Lightfield => F16_LIGHTFIELD_TOLERANCE,
    }
}

fn maze() -> Level {
    let level = include_str!("../../../assets/maze.level.toml");
    Level::from_text(level).expect("the maze is sound")
}

fn levels() -> Vec<(&'static str, Level)> {
    vec![
        ("maze", maze()),
        ("corridor", floor_plan(&corridor(5), 0.5)),
        ("cube", floor_plan(&corridor(1), 0.5)),
        ("room", floor_plan(&square(3), 0.5)),
    ]
}

/// A light in the middle of the first block, two others off the middle, and two lights at once.
fn light_sets(level: &Level) -> Vec<Vec<Light>> {
    let at = |block: usize, unit: DVec3, intensity: Vec3| {
        let position = level.blocks[block].canonical_warp().point(unit);
        Light::sphere(position.as_vec3(), 0.15, intensity)
    };
    let last = level.blocks.len() - 1;
    let warm = at(0, dvec3(0.6, 0.7, 0.4), vec3(1.0, 0.8, 0.6));
    vec![
        vec![at(0, DVec3::splat(0.5), Vec3::ONE)],
        vec![warm],
        vec![at(last, dvec3(0.3, 0.75, 0.3), vec3(0.5, 0.75, 1.0))],
        vec![
            at(last / 2, dvec3(0.2, 0.3, 0.7), vec3(0.5, 0.75, 1.0)),
            warm,
        ],
    ]
}

/// Indirect irradiance of all texels after one bounce and after four, for one set of lights after another.
fn lit<M: OperatorMatrix>(
    level: &Level,
    dictionary: &Dictionary<M>,
    coupling: Coupling,
) -> Vec<Vec<f32>> {
    let depth = AssembleConfig::default().max_depth;
    lit_to(level, dictionary, coupling, depth)
}

/// [`lit`], with light that ends after `max_depth` openings.
fn lit_to<M: OperatorMatrix>(
    level: &Level,
    dictionary: &Dictionary<M>,
    coupling: Coupling,
    max_depth: usize,
) -> Vec<Vec<f32>> {
    let config = AssembleConfig {
        max_depth,
        ..lossless(coupling)
    };
    let scene = Scene::assemble(level, dictionary, &config).expect("the level fits the dictionary");
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let mut signals = Vec::new();
    for lights in light_sets(level) {
        for bounces in [Bounces::Count(1), Bounces::Count(4)] {
            frame.light_with(&lights, bounces);
            signals.push(frame.indirect());
        }
    }
    signals
}

#[test]
fn storage_changes_light_by_less_than_stated() {
    for dictionary in [mobile_dictionary(), default_dictionary()] {
        for coupling in COUPLINGS {
            for (name, level) in levels() {
                let exact = lit(&level, dictionary, coupling);
                for (storage, tolerance) in [
                    (Storage::F32, 0.0),
                    (Storage::F16, f16_tolerance(coupling)),
                    (Storage::Int8, INT8_TOLERANCE),
                ] {
                    let found = lit(&level, &dictionary.stored_as(storage), coupling);
                    for (found, exact) in found.iter().zip(&exact) {
                        let error = relative_l2(found, exact);
                        let case = (&dictionary.preset, coupling, name, storage.name());
                        assert!(error <= tolerance, "{case:?}: {error:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn smaller_storage_makes_smaller_files() {
    let dictionary = mobile_dictionary();
    let bytes = |storage| {
        dictionary
            .stored_as(storage)
            .to_bytes()
            .expect("it fits")
            .len() as f64
    };
    let whole = bytes(Storage::F32);
    // In this preset, a quarter of the bytes are small matrices that `f16` storage leaves in `f32`.
    assert!(bytes(Storage::F16) < 0.7 * whole);
    assert!(bytes(Storage::Int8) < 0.4 * whole);
}

/// The file in memory at a multiple of 64 bytes, where mapped files are, or `shift` bytes behind that. The range is the
/// file's place.
fn placed(file: &[u8], shift: usize) -> (Vec<u8>, std::ops::Range<usize>) {
    let mut room = vec![0; file.len() + 128];
    let start = room.as_ptr().align_offset(64) + shift;
    room[start..start + file.len()].copy_from_slice(file);
    (room, start..start + file.len())
}

/// A dictionary with variants, whose file has every kind of section.
fn with_variants() -> Dictionary {
    let mut dictionary = mobile_dictionary().clone();
    let mut corners = [[0.0; 3]; 8];
    for (k, corner) in corners.iter_mut().enumerate() {
        *corner = [0, 1, 2].map(|axis| (k >> axis & 1) as f32 * 0.5);
    }
    for (shape, transport) in [(2, WarpTransport::Rebuilt), (3, WarpTransport::Regathered)] {
        dictionary.variants.push(Variant {
            transport,
            corners,
            operators: dictionary.shapes[shape].clone(),
        });
    }
    dictionary
}

#[test]
fn files_give_back_what_was_stored_aligned_or_not() {
    let dictionary = with_variants();
    for storage in Storage::ALL {
        let stored = dictionary.stored_as(storage);
        let file = stored.to_bytes().expect("it fits");
        for shift in [0, 1] {
            let (room, range) = placed(&file, shift);
            let mut budget = ByteBudget::new(BYTE_BUDGET);
            let read = StoredDictionary::read(&room[range], &mut budget).expect("sound");
            assert_eq!(read.to_bytes().expect("it fits"), file);
            assert!(read == stored, "{}", storage.name());
            let spent = BYTE_BUDGET - budget.remaining();
            if shift == 0 && cfg!(target_endian = "little") {
                read.map(|kind, matrix| assert!(matrix.is_borrowed(), "{kind:?}"));
                // Names of sections, singular values and corners are copied all the same.
                assert!(spent < 64 << 10, "{spent} bytes");
            } else if storage != Storage::Int8 {
                assert!(spent as usize > read.bytes() / 2, "{spent} bytes");
            }
        }
    }
}

#[test]
fn stored_and_decoded_dictionaries_give_the_same_light() {
    let dictionary = mobile_dictionary();
    let level = maze();
    for storage in Storage::ALL {
        let stored = dictionary.stored_as(storage);
        for coupling in COUPLINGS {
            let decoded = lit(&level, &stored.decode(), coupling);
            assert!(lit(&level, &stored, coupling) == decoded);
        }
    }
}

#[test]
fn packed_dictionaries_give_the_same_light_in_fewer_bytes() {
    let dictionary = with_variants();
    for (name, level) in levels() {
        for storage in Storage::ALL {
            let whole = dictionary.stored_as(storage);
            let before = whole.to_bytes().expect("it fits").len();
            for config in [
                PackConfig::default(),
                PackConfig {
                    probes: false,
                    vector: false,
                    sources: false,
                    lightfields: false,
                },
                PackConfig {
                    sources: true,
                    ..PackConfig::default()
                },
            ] {
                let packed = pack(&level, &whole, &config).expect("it fits");
                let file = packed.to_bytes().expect("it fits");
                assert!(file.len() < before, "{name}: {} of {before}", file.len());
                let mut budget = ByteBudget::new(BYTE_BUDGET);
                let read = StoredDictionary::read(&file, &mut budget).expect("sound");
                assert!(
                    read.to_bytes().expect("it fits") == file,
                    "{name} {config:?}"
                );
                let found = lit(&level, &read, Coupling::Table);
                // Without lightfields, light ends at the table's longest path.
                let depth = if config.lightfields {
                    AssembleConfig::default().max_depth
                } else {
                    dictionary.paths.depth
                };
                let expected = lit_to(&level, &whole, Coupling::Table, depth);
                assert!(found == expected, "{name} {config:?} {}", storage.name());
                // Packing again changes nothing.
                let again = pack(&level, &read, &config).expect("it fits");
                assert!(
                    again.to_bytes().expect("it fits") == file,
                    "{name} {config:?}"
                );
            }
        }
    }
}

#[test]
fn a_packed_dictionary_says_what_another_level_lacks() {
    let dictionary = mobile_dictionary();
    let config = PackConfig {
        lightfields: false,
        ..PackConfig::default()
    };
    let packed_refusal = |from: &Level, to: &Level, coupling| {
        let packed = pack(from, dictionary, &config).expect("it fits");
        let config = AssembleConfig {
            coupling,
            ..AssembleConfig::default()
        };
        Scene::assemble(to, &packed, &config).expect_err("it was packed for another level")
    };
    let short = floor_plan(&corridor(2), 0.5);
    let long = floor_plan(&corridor(4), 0.5);
    let error = packed_refusal(&short, &long, Coupling::Table);
    assert!(
        matches!(error, AssembleError::MissingShape { block: 1, .. }),
        "{error}"
    );
    // A dictionary with all shapes, and no paths but those of a corridor.
    let zigzag = floor_plan(&[[0, 0], [1, 0], [1, 1], [2, 1], [2, 2]], 0.5);
    let straight = floor_plan(&corridor(3), 0.5);
    let mut both = dictionary.clone();
    both.paths = pack(&straight, dictionary, &config).expect("it fits").paths;
    match &refusal(&zigzag, &both) {
        AssembleError::MissingPath { word, .. } => assert_eq!(word, "zx"),
        other => panic!("{other}"),
    }
    let error = packed_refusal(&short, &short, Coupling::Lightfield);
    assert_eq!(error, AssembleError::MissingLightfields);
}
