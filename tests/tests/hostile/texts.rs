//! Texts of any length, in levels, dictionaries and reference files: memory stays a small multiple of them, and what a
//! message quotes is short and safe to print.

use glam::{DVec3, Vec3};
use mrt_core::container::{ByteBudget, Container, ContainerError, ElementType, Writer};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_runtime::low_level::level::block::MAX_BLOCKS;
use mrt_runtime::low_level::level::text::{MAX_PIECE_BYTES, MAX_TEXT_BYTES};
use mrt_runtime::{Dictionary, DictionaryError, Level, LevelError, LevelTextError};
use mrt_tests::{MOBILE_BYTES, OLDEST_BYTES, dictionary_format};

/// Longest message accepted, characters: what a message says itself and an excerpt.
const LONGEST_MESSAGE: usize = 400;

const HEAD: &str = "format = \"mrt-level\"\nversion = 1\n";

/// Bytes that reading a level holds at once, and what came of it.
fn peak_of_reading(text: &str) -> (u64, Result<Level, LevelTextError>) {
    let mut result = None;
    let counts = allocation_counter::measure(|| result = Some(Level::from_text(text)));
    (counts.bytes_max, result.expect("measured"))
}

fn assert_short(message: &str) {
    assert!(
        message.chars().count() <= LONGEST_MESSAGE,
        "{} characters",
        message.chars().count()
    );
    assert!(!message.contains(char::is_control), "{message:?}");
}

#[test]
fn a_hostile_level_takes_little_memory() {
    let megabytes = |unit: &str, count: usize| unit.repeat((count << 20) / unit.len());
    let block = "[[block]]\nshape = \"closed\"\ncell = [0, 0, 0]\nalbedo = [1, 1, 1]\n";
    let texts = [
        format!("{HEAD}connections = [{}]", megabytes("1,", 20)),
        format!("{HEAD}connections = [{}", megabytes("[", 20)),
        format!(
            "{HEAD}connections = [{}]",
            megabytes("[0, \"+x\", 1, \"-x\"],", 20)
        ),
        format!("{HEAD}doors = [{}]", megabytes("[0,0],", 20)),
        format!("{HEAD}{}", megabytes("\n", 20)),
        format!("{HEAD}{}", megabytes("a = 1\n", 20)),
        format!("{HEAD}{}", megabytes("[[block]]\n", 20)),
        format!("{HEAD}{}", megabytes("[block.x]\n", 20)),
        format!("{HEAD}{}", megabytes(block, 20)),
        format!("{HEAD}{block}corners = [{}]", megabytes("1,", 20)),
        format!("{HEAD}{block}transport = \"{}\"", megabytes("x", 20)),
        format!("{HEAD}{block}{} = 1", megabytes("x", 20)),
        megabytes("v 0 0 0\n", 20),
        megabytes("\u{0}\u{1b}[31m", 20),
    ];
    for (case, text) in texts.iter().enumerate() {
        let (peak, result) = peak_of_reading(text);
        let error = result.expect_err("no level");
        assert_short(&error.to_string());
        // A list of doors is four times as large in memory, and grows by doubling.
        assert!(
            peak < 8 * text.len() as u64,
            "case {case}: {peak} bytes, {error}"
        );
    }
}

#[test]
fn the_largest_level_is_read_within_a_few_times_its_text() {
    let mut level = Level::default();
    for k in 0..MAX_BLOCKS {
        let low = DVec3::new((k % 300) as f64, 0.0, (k / 300) as f64) * 2.0;
        let warp = Hexahedron::cuboid(low, low + DVec3::splat(1.25));
        let mut block = level_block(warp);
        block.albedo[k % 6] = Vec3::splat(0.25);
        level.blocks.push(block);
    }
    let text = level.to_text().expect("writes");
    let (peak, read) = peak_of_reading(&text);
    assert!(read == Ok(level), "the level is another one");
    assert!(peak < 8 * text.len() as u64, "{peak} for {}", text.len());
    let more = "[[block]]\nshape = \"closed\"\ncell = [0, 9, 0]\nalbedo = [1, 1, 1]\n";
    let (_, read) = peak_of_reading(&format!("{text}\n{more}{more}"));
    assert_eq!(
        read,
        Err(LevelTextError::Level(LevelError::TooManyBlocks {
            expected: MAX_BLOCKS,
            found: MAX_BLOCKS + 2,
        }))
    );
}

fn level_block(warp: Hexahedron) -> mrt_runtime::blocks::Block {
    let cell = Level::from_cells(&[[0, 0, 0]], Vec3::splat(0.5)).expect("a cell");
    mrt_runtime::blocks::Block {
        warp,
        ..cell.blocks[0].clone()
    }
}

#[test]
fn lists_and_blocks_are_read_wherever_pieces_end() {
    // Many pieces, and every form that TOML has for the same.
    let count = 3000;
    let mut level = Level::default();
    for k in 0..count {
        let low = DVec3::new(f64::from(k), 0.0, 0.0);
        level.blocks.push(level_block(Hexahedron::cell(low)));
    }
    let text = level.to_text().expect("writes");
    assert!(text.len() > 2 * MAX_PIECE_BYTES);
    assert_eq!(Level::from_text(&text), Ok(level.clone()));
    let windows = text.replace('\n', "\r\n");
    assert_eq!(Level::from_text(&windows), Ok(level.clone()));
    let commented = text.replace("[[block]]", "# [[block]] '\n  [[ \"block\" ]] # \"");
    assert_eq!(Level::from_text(&commented), Ok(level.clone()));
    let inline: String = (0..count)
        .map(|k| {
            format!("{{shape = 'closed', albedo = [0.5, 0.5, 0.5], cell = [{k}, 0, 0]}}, # ]\n")
        })
        .collect();
    let listed = format!("{HEAD}block = [\n{inline}]\n");
    assert_eq!(Level::from_text(&listed), Ok(level));
    let both = format!("{listed}[[block]]\n");
    assert!(matches!(
        Level::from_text(&both),
        Err(LevelTextError::Malformed(_))
    ));
    let twice = format!("{HEAD}doors = []\n{}", &listed[HEAD.len()..]) + "doors = []\n";
    assert!(matches!(
        Level::from_text(&twice),
        Err(LevelTextError::Malformed(_))
    ));
}

#[test]
fn faults_are_named_with_their_line_in_every_piece() {
    let blocks = "[[block]]\nshape = \"closed\"\ncell = [0, 0, 0]\nalbedo = [1, 1, 1]\n";
    let lists = "connections = [\n[0, \"+x\", 1, \"-x\"],\n]\n";
    let lines = |text: &str| text.lines().count();
    let many = blocks.repeat(2000);
    for (text, line) in [
        (format!("{HEAD}fog = 1\n{lists}"), lines(HEAD) + 1),
        (
            format!("{HEAD}{lists}fog = 1\n{many}"),
            lines(HEAD) + lines(lists) + 1,
        ),
        (
            format!("{HEAD}{}", lists.replace("1,", "one,")),
            lines(HEAD) + 2,
        ),
        (
            format!("{HEAD}{lists}{many}fog = 1\n{many}"),
            lines(HEAD) + lines(lists) + lines(&many) + 1,
        ),
    ] {
        let error = Level::from_text(&text).expect_err("no level").to_string();
        assert!(error.contains(&format!("line {line}: ")), "{line}: {error}");
    }
    let long = format!("{HEAD}{blocks}# {}\n", "x".repeat(MAX_PIECE_BYTES));
    let error = Level::from_text(&long).expect_err("no level");
    assert!(
        matches!(error, LevelTextError::PartTooLong { .. }),
        "{error}"
    );
    let longest = " ".repeat(MAX_TEXT_BYTES + 1);
    let error = Level::from_text(&longest).expect_err("no level");
    assert!(matches!(error, LevelTextError::TooLong { .. }), "{error}");
}

#[test]
fn what_a_level_says_is_quoted_shortly() {
    let hostile = "\\u001b[2J\\u202e".repeat(4000);
    let block = |change: &str| {
        let rest = "shape = \"closed\"\ncell = [0, 0, 0]\nalbedo = [1, 1, 1]\n";
        format!("{HEAD}[[block]]\n{rest}{change}")
    };
    let texts = [
        format!("format = \"{hostile}\"\nversion = 1\n"),
        block("").replace("closed", &hostile),
        block(&format!("orientation = \"{hostile}\"\n")),
        block(&format!("transport = \"{hostile}\"\n")),
        block(&format!("face_albedo = {{ \"{hostile}\" = [1, 1, 1] }}\n")),
        block(&format!("\"{hostile}\" = 1\n")),
        format!("{HEAD}connections = [[0, \"{hostile}\", 1, \"-x\"]]\n"),
    ];
    for text in texts {
        let error = Level::from_text(&text).expect_err("no level").to_string();
        assert_short(&error);
        assert!(error.contains("u{1b}"), "{error}");
    }
}

/// A dictionary file with one text replaced.
fn with_text(bytes: &[u8], version: u32, section: &str, text: &str) -> Vec<u8> {
    let mut budget = ByteBudget::new(1 << 30);
    let container = Container::read(bytes, &dictionary_format(2), &mut budget).expect("sound");
    let mut writer = Writer::new(dictionary_format(version));
    for (name, element_type) in container.sections() {
        match element_type {
            ElementType::Text if name == section => writer.add_text(name, text),
            ElementType::Text => writer.add_text(name, container.text(name).expect("text")),
            ElementType::F32 => {
                let numbers: Vec<f32> = container.numbers(name, &mut budget).expect("numbers");
                writer.add_numbers(name, &numbers)
            }
            ElementType::U32 => {
                let numbers: Vec<u32> = container.numbers(name, &mut budget).expect("numbers");
                writer.add_numbers(name, &numbers)
            }
            ElementType::U16 => {
                let numbers: Vec<u16> = container.numbers(name, &mut budget).expect("numbers");
                writer.add_numbers(name, &numbers)
            }
            ElementType::F16 => {
                let numbers: Vec<mrt_core::storage::f16> =
                    container.numbers(name, &mut budget).expect("numbers");
                writer.add_numbers(name, &numbers)
            }
            other => panic!("the files have no {other:?}"),
        }
        .expect("legal");
    }
    writer.finish()
}

#[test]
fn texts_of_a_dictionary_are_charged_before_they_are_copied() {
    let settings = "x".repeat(50 << 20);
    for (bytes, version) in [(MOBILE_BYTES, 2), (OLDEST_BYTES, 1)] {
        for section in ["settings", "preset"] {
            let file = with_text(bytes, version, section, &settings);
            let mut budget = ByteBudget::new(1 << 20);
            let counts = allocation_counter::measure(|| {
                let error =
                    Dictionary::from_bytes_within(&file, &mut budget).expect_err("too large");
                let is_limit = matches!(
                    error,
                    DictionaryError::Container(ContainerError::LimitExceeded { .. })
                );
                assert!(is_limit, "{error}");
            });
            // The budget, and some room for messages.
            assert!(counts.bytes_max < 2 << 20, "{} bytes", counts.bytes_max);
        }
        // Up to the limit, texts are read, and every byte is charged.
        let remaining = |length: usize| {
            let file = with_text(bytes, version, "settings", &"x".repeat(length));
            let mut budget = ByteBudget::new(1 << 30);
            Dictionary::from_bytes_within(&file, &mut budget).expect("sound");
            budget.remaining()
        };
        assert!(remaining(0) >= remaining(60_000) + 60_000);
    }
}

#[test]
fn names_in_a_dictionary_are_quoted_shortly() {
    let hostile = "\u{1b}[2J\u{202e}".repeat(4000);
    for (bytes, version, section) in [
        (MOBILE_BYTES, 2, "shapes"),
        (MOBILE_BYTES, 2, "words"),
        (OLDEST_BYTES, 1, "0.name"),
    ] {
        let mut text = hostile.clone();
        if section == "shapes" {
            // The number of names is checked first.
            let mut budget = ByteBudget::new(1 << 30);
            let container = Container::read(bytes, &dictionary_format(2), &mut budget);
            let names = container
                .expect("sound")
                .text(section)
                .expect("text")
                .to_owned();
            let count = names.split_ascii_whitespace().count();
            text = vec![hostile.as_str(); count].join(" ");
        }
        let file = with_text(bytes, version, section, &text);
        let error = Dictionary::from_bytes(&file)
            .expect_err("no names")
            .to_string();
        assert_short(&error);
        assert!(error.contains("u{1b}"), "{error}");
    }
}
