//! Dictionary files with sound checksums and wrong sections, of every version and storage, give errors and no panic.

use mrt_core::container::{ByteBudget, Container, ElementType, Writer};
use mrt_core::storage::{Storage, f16};
use mrt_runtime::blocks::WarpTransport;
use mrt_runtime::low_level::modular::dictionary::{StoredDictionary, Variant};
use mrt_runtime::{AssembleConfig, Dictionary, DictionaryError, Scene};
use mrt_tests::{COUPLINGS, MOBILE_BYTES, OLDEST_BYTES, Random, dictionary_format, floor_plan};

const BYTE_BUDGET: u64 = 64 << 20;

/// What a section holds.
#[derive(Clone, Debug)]
enum Content {
    Text(String),
    F32(Vec<f32>),
    F16(Vec<f16>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    U32(Vec<u32>),
}

/// A file as a list of its sections.
#[derive(Clone)]
struct Parts {
    version: u32,
    sections: Vec<(String, Content)>,
}

impl Parts {
    fn of(bytes: &[u8]) -> Self {
        let mut budget = ByteBudget::new(BYTE_BUDGET);
        let container = Container::read(bytes, &dictionary_format(2), &mut budget).expect("sound");
        let mut numbers = ByteBudget::new(BYTE_BUDGET);
        let mut content = |name, element_type| match element_type {
            ElementType::Text => Content::Text(container.text(name).expect("text").to_owned()),
            ElementType::F32 => Content::F32(container.numbers(name, &mut numbers).expect("f32")),
            ElementType::F16 => Content::F16(container.numbers(name, &mut numbers).expect("f16")),
            ElementType::I8 => Content::I8(container.numbers(name, &mut numbers).expect("i8")),
            ElementType::U16 => Content::U16(container.numbers(name, &mut numbers).expect("u16")),
            ElementType::U32 => Content::U32(container.numbers(name, &mut numbers).expect("u32")),
            other => panic!("dictionaries have no {other:?}"),
        };
        Self {
            version: container.version(),
            sections: container
                .sections()
                .map(|(name, element_type)| (name.to_owned(), content(name, element_type)))
                .collect(),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        let mut writer = Writer::new(dictionary_format(self.version));
        for (name, content) in &self.sections {
            match content {
                Content::Text(text) => writer.add_text(name, text),
                Content::F32(numbers) => writer.add_numbers(name, numbers),
                Content::F16(numbers) => writer.add_numbers(name, numbers),
                Content::I8(numbers) => writer.add_numbers(name, numbers),
                Content::U16(numbers) => writer.add_numbers(name, numbers),
                Content::U32(numbers) => writer.add_numbers(name, numbers),
            }
            .expect("the names are legal");
        }
        writer.finish()
    }

    fn get(&mut self, name: &str) -> &mut Content {
        let mut sections = self.sections.iter_mut();
        let found = sections.find(|(n, _)| n == name);
        &mut found.unwrap_or_else(|| panic!("no section {name}")).1
    }

    /// The error of reading the file with one section changed.
    fn refused(&self, name: &str, change: impl FnOnce(&mut Content)) -> DictionaryError {
        let mut parts = self.clone();
        change(parts.get(name));
        read(&parts.bytes()).expect_err(name)
    }
}

fn read(bytes: &[u8]) -> Result<Dictionary, DictionaryError> {
    Dictionary::from_bytes_within(bytes, &mut ByteBudget::new(BYTE_BUDGET))
}

/// A file of the oldest version, and files of the newest with variants, one for each storage.
fn files() -> Vec<Parts> {
    let mut dictionary = read(MOBILE_BYTES).expect("sound");
    dictionary.variants.push(Variant {
        transport: WarpTransport::Rebuilt,
        corners: [[0.5; 3]; 8],
        operators: dictionary.shapes[1].clone(),
    });
    let mut files = vec![Parts::of(OLDEST_BYTES)];
    for storage in Storage::ALL {
        let bytes = dictionary.stored_as(storage).to_bytes().expect("it fits");
        files.push(Parts::of(&bytes));
    }
    files
}

#[test]
fn files_written_again_from_their_sections_are_sound() {
    for parts in files() {
        read(&parts.bytes()).expect("sound");
    }
}

#[test]
fn every_section_is_needed() {
    for parts in files() {
        for at in 0..parts.sections.len() {
            let mut damaged = parts.clone();
            let (name, _) = damaged.sections.remove(at);
            let result = read(&damaged.bytes());
            // A dictionary without sources is sound: it is a packed one.
            assert_eq!(result.is_ok(), name == "B_e", "{name}: {:?}", result.err());
        }
    }
}

#[test]
fn sections_longer_than_the_sizes_say_are_refused() {
    for parts in files() {
        for (name, content) in &parts.sections {
            if let Content::Text(_) = content {
                continue;
            }
            let longer = parts.refused(name, |content| match content {
                Content::Text(_) => {}
                Content::F32(numbers) => numbers.push(1.0),
                Content::F16(numbers) => numbers.push(f16::from_bits(0)),
                Content::I8(numbers) => numbers.push(1),
                Content::U16(numbers) => numbers.push(1),
                Content::U32(numbers) => numbers.push(1),
            });
            assert!(longer.to_string().len() > name.len(), "{longer}");
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for parts in files() {
        for (name, content) in &parts.sections {
            match content {
                Content::F32(numbers) if !numbers.is_empty() => {
                    parts.refused(name, |content| {
                        if let Content::F32(numbers) = content {
                            numbers[0] = f32::NAN;
                        }
                    });
                }
                Content::F16(numbers) if !numbers.is_empty() => {
                    parts.refused(name, |content| {
                        if let Content::F16(numbers) = content {
                            numbers[0] = f16::INFINITY;
                        }
                    });
                }
                Content::I8(numbers) if !numbers.is_empty() => {
                    parts.refused(name, |content| {
                        if let Content::I8(numbers) = content {
                            numbers[0] = i8::MIN;
                        }
                    });
                }
                _ => {}
            }
            // Scales of `int8` sections.
            if name.ends_with('*') && !matches!(content, Content::F32(scales) if scales.is_empty())
            {
                for bad in [0.0, -1.0, f32::INFINITY, f32::MAX, 1e-40] {
                    parts.refused(name, |content| {
                        if let Content::F32(scales) = content {
                            scales[0] = bad;
                        }
                    });
                }
            }
        }
    }
}

#[test]
fn sizes_out_of_bounds_are_refused() {
    for parts in files() {
        let Content::U32(sizes) = parts.clone().get("sizes").clone() else {
            panic!("sizes are u32");
        };
        for at in 0..sizes.len() {
            for bad in [u32::MAX, 4097, 1 << 31] {
                parts.refused("sizes", |content| {
                    if let Content::U32(sizes) = content {
                        sizes[at] = bad;
                    }
                });
            }
        }
    }
}

#[test]
fn variants_without_a_known_shape_and_transport_are_refused() {
    let parts = files().pop().expect("there are four");
    for bad in [
        "",
        "dead_end",
        "dead_end:",
        "dead_end:folded",
        "sphere:rebuilt",
        "door:rebuilt",
        "a:b c:d",
    ] {
        let error = parts.refused("variants", |content| {
            *content = Content::Text(bad.to_owned())
        });
        let expected = matches!(
            error,
            DictionaryError::Variant { index: 0, .. } | DictionaryError::Length { .. }
        );
        assert!(expected, "{bad}: {error}");
    }
}

#[test]
fn version_1_has_only_the_shapes_of_its_time() {
    let parts = &files()[0];
    for bad in ["sphere", "open", "door"] {
        let error = parts.refused("0.name", |content| *content = Content::Text(bad.to_owned()));
        assert!(
            matches!(error, DictionaryError::UnknownShape { index: 0, .. }),
            "{error}"
        );
    }
    let twice = parts.refused("0.name", |content| {
        *content = Content::Text("cross".to_owned())
    });
    assert!(!twice.to_string().is_empty());
}

#[test]
fn a_right_turn_that_does_not_mirror_the_left_turn_is_refused() {
    let error = files()[0].refused("right", |content| {
        if let Content::F32(numbers) = content {
            numbers[70] *= 1.5;
        }
    });
    assert!(
        matches!(
            error,
            DictionaryError::NotMirrored {
                row: 6,
                column: 1,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_budget_is_never_exceeded() {
    for parts in files() {
        let bytes = parts.bytes();
        let needed = {
            let mut budget = ByteBudget::new(BYTE_BUDGET);
            Dictionary::from_bytes_within(&bytes, &mut budget).expect("sound");
            BYTE_BUDGET - budget.remaining()
        };
        for share in 0..8 {
            let mut budget = ByteBudget::new(needed * share / 8);
            Dictionary::from_bytes_within(&bytes, &mut budget).expect_err("less than it takes");
        }
        Dictionary::from_bytes_within(&bytes, &mut ByteBudget::new(needed)).expect("just enough");
    }
}

/// A dictionary with random changes behind sound checksums is refused, or a level is assembled with it, or assembly refuses
/// it.
#[test]
fn random_damage_causes_no_panic() {
    let mut random = Random(12);
    let level = floor_plan(&[[0, 0], [1, 0], [1, 1], [2, 1]], 0.5);
    for parts in files() {
        for _ in 0..150 {
            let mut damaged = parts.clone();
            for _ in 0..1 + random.below(2) {
                let at = random.below(damaged.sections.len());
                damage(&mut damaged.sections[at].1, &mut random);
            }
            let bytes = damaged.bytes();
            let mut budget = ByteBudget::new(BYTE_BUDGET);
            let Ok(dictionary) = StoredDictionary::read(&bytes, &mut budget) else {
                continue;
            };
            for coupling in COUPLINGS {
                let config = AssembleConfig {
                    coupling,
                    ..AssembleConfig::default()
                };
                // An error is allowed: a damaged dictionary may lack what the level needs.
                let _ = Scene::assemble(&level, &dictionary, &config);
            }
        }
    }
}

fn damage(content: &mut Content, random: &mut Random) {
    fn some<T>(numbers: &mut Vec<T>, random: &mut Random, value: T) {
        if numbers.is_empty() || random.below(4) == 0 {
            numbers.push(value);
        } else {
            let at = random.below(numbers.len());
            numbers[at] = value;
        }
    }
    let bits = random.bits();
    match content {
        Content::Text(text) => {
            let at = random.below(text.len() + 1);
            if text.is_char_boundary(at) {
                text.insert(at, char::from(b' ' + (bits % 90) as u8));
            }
        }
        Content::F32(numbers) => some(numbers, random, f32::from_bits(bits as u32)),
        Content::F16(numbers) => some(numbers, random, f16::from_bits(bits as u16)),
        Content::I8(numbers) => some(numbers, random, bits as i8),
        Content::U16(numbers) => some(numbers, random, (bits % 5) as u16),
        Content::U32(numbers) => some(numbers, random, (bits % 40) as u32),
    }
}
