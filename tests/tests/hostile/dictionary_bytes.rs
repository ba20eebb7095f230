//! Dictionaries from arbitrary bytes: every fault is a named error, and nothing panics.

use mrt_core::container::{ByteBudget, ContainerError, Writer};
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::{SHAPES, Shape};
use mrt_runtime::low_level::level::shape::Hole;
use mrt_runtime::low_level::modular::dictionary::{
    LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators, Sources,
    StoredDictionary,
};
use mrt_runtime::low_level::modular::dictionary_file::{
    DEFAULT_BYTE_BUDGET, DICTIONARY_VERSION, MAX_MODES, MAX_PROBES, MAX_RESOLUTION, MAX_VARIANTS,
};
use mrt_runtime::low_level::modular::path::{MAX_WORD, Word};
use mrt_runtime::{AssembleError, Dictionary, DictionaryError};
use mrt_tests::{
    DEFAULT_BYTES, Random, corridor, default_dictionary, dictionary_format, floor_plan, refusal,
};

fn read(bytes: &[u8]) -> Result<Dictionary, DictionaryError> {
    Dictionary::from_bytes_within(bytes, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET))
}

/// A matrix of made-up numbers.
fn filled(rows: usize, columns: usize) -> Matrix<f32> {
    Matrix::from_fn(rows, columns, |i, j| (1 + i + 3 * j) as f32 * 0.01)
}

/// A dictionary of two shapes with 2² texels a wall, one probe and two modes of everything. Light of other blocks adds a
/// third joint mode.
fn small() -> Dictionary {
    Dictionary {
        preset: "small".to_owned(),
        settings: "made up".to_owned(),
        resolution: 2,
        probes: 1,
        shapes: SHAPES[..2].iter().map(small_shape).collect(),
        lightfields: LightfieldOperators {
            parity: vec![0, 1],
            from_emission: filled(2, 2),
            straight: filled(2, 2),
            left: filled(2, 2),
            exchange: Matrix::zeros(0, 2),
            holes: Vec::new(),
            response_from_lightfield: filled(2, 2),
            dropped_energy: 0.2,
        },
        paths: PathTable {
            depth: 1,
            hole_depth: 0,
            emission_parity: vec![0, 1],
            response_parity: vec![0, 3],
            entries: ["z", "zx"]
                .map(|name| PathEntry {
                    word: Word::from_name(name).expect("canonical"),
                    response_from_emission: filled(2, 2),
                })
                .to_vec(),
            emission_dropped_energy: 0.3,
            response_dropped_energy: 0.4,
        },
        variants: Vec::new(),
        sources: Some(Sources {
            emission_from_radiosity: filled(2, 20),
            response_basis: filled(29, 2),
        }),
    }
}

/// The operators of a shape in [`small`].
fn small_shape(shape: &'static Shape) -> ShapeOperators {
    let texels = shape.texel_count(2);
    let opening = OpeningOperators {
        emission_from_coefficients: vec![filled(2, 2)],
        joint_from_response: vec![filled(3, 2)],
    };
    ShapeOperators {
        shape,
        coefficients_from_direct: filled(2, texels),
        joint_basis: filled(texels, 3),
        probe_basis: filled(9, 3),
        vector_basis: Matrix::zeros(0, 3),
        openings: vec![opening; shape.openings.len()],
        implicit_lighting: filled(texels, 2),
        singular_values: vec![1.0, 0.5],
        dropped_energy: 0.1,
        joint_dropped_energy: 0.05,
    }
}

/// The contents of a section.
#[derive(Clone, Debug)]
enum Section {
    Text(&'static str),
    Sizes(Vec<u32>),
    Parities(Vec<u16>),
    Numbers(Vec<f32>),
}

/// The section of sizes: resolution, probes, shapes, variants, lightfield modes, emission modes, response modes, no vertical
/// openings, no holes, depth of paths without holes and with holes.
const SIZES: [u32; 11] = [2, 1, 2, 0, 2, 2, 2, 0, 0, 2, 0];

/// Sections of a file with the sizes of [`small`], under the names that the format gives them.
fn sections() -> Vec<(&'static str, Section)> {
    use Section::{Numbers, Parities, Sizes, Text};
    let quarters = |count| Numbers(vec![0.25; count]);
    vec![
        ("preset", Text("small")),
        ("settings", Text("made up")),
        ("sizes", Sizes(SIZES.to_vec())),
        ("dropped", quarters(3)),
        ("rlf.par", Parities(vec![0, 1])),
        ("e.par", Parities(vec![0, 1])),
        ("r.par", Parities(vec![0, 3])),
        ("e_rlf", quarters(4)),
        ("left", quarters(4)),
        ("ahead", quarters(4)),
        ("swap", quarters(0)),
        ("T_rlf_r", quarters(4)),
        ("words", Text("z zx")),
        ("P0", quarters(4)),
        ("P1", quarters(4)),
        ("shapes", Text("closed dead_end")),
        ("variants", Text("")),
        ("corners", quarters(0)),
        ("0.k", Sizes(vec![2, 3])),
        ("0.s", quarters(2)),
        ("0.d", quarters(2)),
        ("0.T", quarters(48)),
        ("0.J", quarters(72)),
        ("0.Jp", quarters(27)),
        ("0.Jv", quarters(0)),
        ("0.L", quarters(48)),
        ("1.k", Sizes(vec![2, 3])),
        ("1.s", quarters(2)),
        ("1.d", quarters(2)),
        ("1.T", quarters(40)),
        ("1.J", quarters(60)),
        ("1.Jp", quarters(27)),
        ("1.Jv", quarters(0)),
        ("1.L", quarters(40)),
        ("1.E0", quarters(4)),
        ("1.Q0", quarters(6)),
        ("B_e", quarters(40)),
        ("U_r", quarters(58)),
    ]
}

/// The bytes of a file with these sections and sound checksums.
fn file_of(sections: &[(&str, Section)]) -> Vec<u8> {
    let mut writer = Writer::new(dictionary_format(DICTIONARY_VERSION));
    for (name, section) in sections {
        match section {
            Section::Text(text) => writer.add_text(name, text),
            Section::Sizes(numbers) => writer.add_numbers(name, numbers),
            Section::Parities(numbers) => writer.add_numbers(name, numbers),
            Section::Numbers(numbers) => writer.add_numbers(name, numbers),
        }
        .expect("the names are legal");
    }
    writer.finish()
}

/// The file of [`sections`] with one section replaced.
fn with(name: &str, section: Section) -> Vec<u8> {
    let mut all = sections();
    let entry = all.iter_mut().find(|(n, _)| *n == name);
    entry.expect("the section is there").1 = section;
    file_of(&all)
}

#[test]
fn the_small_dictionary_is_sound_before_it_is_damaged() {
    assert_eq!(read(&file_of(&sections())).expect("sound").shapes.len(), 2);
    let bytes = small().to_bytes().expect("it fits");
    assert_eq!(read(&bytes).expect("sound"), small());
    let mut budget = ByteBudget::new(DEFAULT_BYTE_BUDGET);
    let built_in = StoredDictionary::read(DEFAULT_BYTES, &mut budget).expect("sound");
    assert!(built_in.to_bytes().expect("it fits") == DEFAULT_BYTES);
}

#[test]
fn truncated_dictionaries_are_refused() {
    let bytes = small().to_bytes().expect("it fits");
    for length in 0..bytes.len() {
        let error = read(&bytes[..length]).expect_err("cut");
        assert!(
            matches!(error, DictionaryError::Container(_)),
            "{length}: {error}"
        );
    }
    let mut random = Random(1);
    for _ in 0..200 {
        let length = random.below(DEFAULT_BYTES.len());
        assert!(read(&DEFAULT_BYTES[..length]).is_err(), "{length}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(read(&longer).is_err());
}

#[test]
fn an_empty_or_foreign_file_is_recognised() {
    for foreign in [
        &b""[..],
        b"\x89PNG\r\n\x1a\n rest",
        &[0; 4096],
        b"format = \"mrt-level\"",
    ] {
        let error = read(foreign).expect_err("no dictionary");
        let foreign = matches!(
            error,
            DictionaryError::Container(ContainerError::NotThisFormat { .. })
        );
        assert!(foreign, "{error}");
    }
}

#[test]
fn every_flipped_bit_is_detected() {
    let bytes = small().to_bytes().expect("it fits");
    for at in 0..bytes.len() {
        for bit in 0..8 {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << bit;
            let error = read(&damaged).expect_err("one bit is wrong");
            assert!(
                matches!(error, DictionaryError::Container(_)),
                "{at}.{bit}: {error}"
            );
        }
    }
    let mut random = Random(2);
    let mut damaged = DEFAULT_BYTES.to_vec();
    for _ in 0..100 {
        let (at, bit) = (random.below(damaged.len()), random.below(8));
        damaged[at] ^= 1 << bit;
        assert!(read(&damaged).is_err(), "{at}.{bit}");
        damaged[at] ^= 1 << bit;
    }
}

#[test]
fn a_newer_version_is_refused_by_its_number() {
    let mut writer = Writer::new(dictionary_format(DICTIONARY_VERSION + 1));
    writer.add_text("preset", "from the future").expect("legal");
    let error = read(&writer.finish()).expect_err("too new");
    let version = matches!(
        error,
        DictionaryError::Container(ContainerError::UnsupportedVersion { found, newest, .. })
            if found == DICTIONARY_VERSION + 1 && newest == DICTIONARY_VERSION
    );
    assert!(version, "{error}");
}

#[test]
fn absurd_sizes_are_refused_by_name() {
    let huge = u32::MAX;
    for (k, (what, low, high)) in [
        ("resolution", 1, MAX_RESOLUTION),
        ("number of probes along an edge", 0, MAX_PROBES),
        ("number of shapes", 1, SHAPES.len()),
        ("number of variants", 0, MAX_VARIANTS),
        ("number of lightfield modes", 0, MAX_MODES),
        ("number of emission modes", 1, MAX_MODES),
        ("number of response modes", 1, MAX_MODES),
        ("mark of vertical openings", 0, 1),
        ("number of holes", 0, Hole::ALL.len()),
        ("depth of paths", 0, MAX_WORD),
        ("depth of paths with holes", 0, MAX_WORD),
    ]
    .into_iter()
    .enumerate()
    {
        let below = (low > 0).then_some(0);
        for size in below.into_iter().chain([high as u32 + 1, huge]) {
            let mut sizes = SIZES.to_vec();
            sizes[k] = size;
            match read(&with("sizes", Section::Sizes(sizes))).expect_err("absurd") {
                DictionaryError::Size {
                    what: named, found, ..
                } => {
                    assert_eq!((named, found), (what, size as usize));
                }
                other => panic!("{what} {size}: {other}"),
            }
        }
    }
    // More joint modes than the limit, and fewer than the shape has of its own.
    for joint in [MAX_MODES + 1, 1] {
        let modes = Section::Sizes(vec![2, joint as u32]);
        let error = read(&with("0.k", modes)).expect_err("absurd");
        assert!(
            matches!(error, DictionaryError::Size { found, .. } if found == joint),
            "{error}"
        );
    }
}

#[test]
fn sections_of_the_wrong_length_or_type_are_refused() {
    for (name, section) in sections() {
        let (shorter, longer, other) = match section {
            Section::Text(_) => continue,
            Section::Parities(parities) => (
                Section::Parities(parities[1..].to_vec()),
                Section::Parities([&parities[..], &[1]].concat()),
                Section::Numbers(vec![1.0; parities.len()]),
            ),
            Section::Sizes(sizes) => (
                Section::Sizes(sizes[1..].to_vec()),
                Section::Sizes([&sizes[..], &[1]].concat()),
                Section::Numbers(vec![2.0; 4]),
            ),
            Section::Numbers(numbers) => (
                Section::Numbers(numbers.get(1..).unwrap_or(&[1.0; 2]).to_vec()),
                Section::Numbers([&numbers[..], &[1.0]].concat()),
                Section::Sizes(vec![1; numbers.len()]),
            ),
        };
        for section in [shorter, longer] {
            match read(&with(name, section)) {
                Err(DictionaryError::Length { section, .. }) => assert_eq!(section, name),
                other => panic!("{name}: {other:?}"),
            }
        }
        let error = read(&with(name, other)).expect_err("another type");
        assert!(
            matches!(error, DictionaryError::Container(_)),
            "{name}: {error}"
        );
    }
}

#[test]
fn missing_sections_are_refused_by_name() {
    for (k, (name, _)) in sections().into_iter().enumerate() {
        // A dictionary without sources is sound: it is a packed one.
        if name == "B_e" {
            continue;
        }
        let mut all = sections();
        all.remove(k);
        match read(&file_of(&all)) {
            Err(DictionaryError::Container(ContainerError::MissingSection { name: found })) => {
                assert_eq!(found, name);
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for (name, section) in sections() {
        let Section::Numbers(numbers) = section else {
            continue;
        };
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut numbers = numbers.clone();
            // A number in an empty section would be refused for the length of the section.
            let Some(last) = numbers.last_mut() else {
                continue;
            };
            *last = bad;
            let error = read(&with(name, Section::Numbers(numbers))).expect_err("not finite");
            let malformed = matches!(
                error,
                DictionaryError::Container(ContainerError::Malformed { .. })
            );
            assert!(malformed, "{name}: {error}");
        }
    }
}

#[test]
fn unknown_and_repeated_shapes_are_refused() {
    let error = read(&with("shapes", Section::Text("sphere dead_end"))).expect_err("unknown");
    assert!(
        matches!(error, DictionaryError::UnknownShape { index: 0, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("`sphere`"), "{error}");
    let mut twice = small();
    twice.shapes[0] = twice.shapes[1].clone();
    let bytes = twice.to_bytes().expect("it fits");
    let error = read(&bytes).expect_err("twice");
    assert!(
        matches!(error, DictionaryError::ShapeTwice { found: "dead_end" }),
        "{error}"
    );
}

#[test]
fn malformed_words_and_parities_are_refused() {
    for words in [
        "x",
        "zy",
        "z z",
        "zx z",
        "zdd",
        "q",
        "zzzzzzzzzzzzz",
        "z zx z",
    ] {
        let error = read(&with("words", Section::Text(words))).expect_err(words);
        assert!(
            matches!(error, DictionaryError::Word { .. }),
            "{words}: {error}"
        );
    }
    for name in ["rlf.par", "e.par", "r.par"] {
        let error = read(&with(name, Section::Parities(vec![0, 4]))).expect_err(name);
        assert!(
            matches!(&error, DictionaryError::Parity { section, found: 4 } if section == name),
            "{error}"
        );
    }
}

#[test]
fn a_dictionary_may_hold_the_closed_cube_alone() {
    let mut alone = small();
    alone.shapes.truncate(1);
    let bytes = alone.to_bytes().expect("it fits");
    assert_eq!(read(&bytes).expect("sound"), alone);
}

#[test]
fn a_small_budget_is_never_exceeded() {
    let bytes = small().to_bytes().expect("it fits");
    let enough = (0..20_000)
        .step_by(50)
        .find(|&size| Dictionary::from_bytes_within(&bytes, &mut ByteBudget::new(size)).is_ok())
        .expect("the dictionary is small");
    assert!(enough > 1000, "{enough}");
    for size in (0..enough).step_by(50) {
        let error = Dictionary::from_bytes_within(&bytes, &mut ByteBudget::new(size))
            .expect_err("below the smallest that is enough");
        let limit = matches!(
            error,
            DictionaryError::Container(ContainerError::LimitExceeded { .. })
        );
        assert!(limit, "{size}: {error}");
    }
    // A number takes 4 bytes of the budget, however few it takes in the file.
    let matrices = default_dictionary().bytes() as u64;
    let spent = Dictionary::from_bytes_within(DEFAULT_BYTES, &mut ByteBudget::new(matrices / 2));
    assert!(spent.is_err());
}

#[test]
fn a_dictionary_that_lacks_a_shape_says_which() {
    let mut incomplete = default_dictionary().clone();
    incomplete
        .shapes
        .retain(|entry| entry.shape.name != "straight");
    let error = refusal(&floor_plan(&corridor(3), 0.5), &incomplete);
    let missing = matches!(
        error,
        AssembleError::MissingShape {
            block: 1,
            shape: "straight",
            ..
        }
    );
    assert!(missing, "{error}");
}
