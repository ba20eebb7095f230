//! Tests of the container as a whole: round trips, every named error, and hostile bytes.

use super::fixtures::FORMAT;
use super::layout::*;
use super::*;
use proptest::prelude::*;

const FIRST_ENTRY: usize = HEADER_SIZE;
const FIRST_CONTENT: usize = 256;

fn sample() -> Vec<u8> {
    let mut writer = Writer::new(FORMAT);
    writer.add_text("about", "grey ☁").unwrap();
    writer
        .add_numbers("weights", &[1.5f32, -0.0, f32::MAX, 2e-40])
        .unwrap();
    writer.add_numbers("counts", &[7u32, u32::MAX]).unwrap();
    writer.add_numbers("ids", &[u64::MAX, 1 << 40]).unwrap();
    writer.add_numbers("halves", &[0x3c00u16]).unwrap();
    writer.add_bytes("blob", &[]).unwrap();
    writer.finish()
}

fn open(bytes: &[u8]) -> Result<Container<'_>, ContainerError> {
    Container::read(bytes, &FORMAT, &mut ByteBudget::new(1 << 20))
}

/// Makes the header's checksum right again, so that the next check is reached.
fn reseal(bytes: &mut [u8]) {
    let count = get_u32(bytes, COUNT) as usize;
    let table_end = (HEADER_SIZE + ENTRY_SIZE * count.min(4096)).min(bytes.len());
    if table_end >= HEADER_SIZE {
        let crc = table_crc(&bytes[..table_end]);
        put_u32(bytes, TABLE_CRC, crc);
    }
}

/// The error of the sample after a change, with a checksum that is right again.
fn error_after(change: impl FnOnce(&mut Vec<u8>)) -> ContainerError {
    let mut bytes = sample();
    change(&mut bytes);
    reseal(&mut bytes);
    open(&bytes).expect_err("the change must be refused")
}

/// The field that a `Malformed` error names.
fn malformed_field(error: &ContainerError) -> &'static str {
    match error {
        ContainerError::Malformed { what, .. } => what,
        other => panic!("expected Malformed, found {other}"),
    }
}

#[test]
fn sections_come_back() {
    let bytes = sample();
    let container = open(&bytes).unwrap();
    let mut budget = ByteBudget::new(42);
    assert_eq!(container.version(), 3);
    assert_eq!(container.sections().count(), 6);
    assert_eq!(container.text("about").unwrap(), "grey ☁");
    let weights = container
        .finite_numbers::<f32>("weights", &mut budget)
        .unwrap();
    assert_eq!(weights[1].to_bits(), (-0.0f32).to_bits());
    assert_eq!(weights, [1.5, 0.0, f32::MAX, 2e-40]);
    assert_eq!(
        container.numbers::<u32>("counts", &mut budget).unwrap(),
        [7, u32::MAX]
    );
    assert_eq!(
        container.numbers::<u64>("ids", &mut budget).unwrap(),
        [u64::MAX, 1 << 40]
    );
    assert_eq!(
        container.numbers::<u16>("halves", &mut budget).unwrap(),
        [0x3c00]
    );
    assert_eq!(budget.remaining(), 0);
    assert!(container.bytes("blob").unwrap().is_empty());
    for (name, _) in container.sections() {
        let content = container.bytes(name).unwrap();
        assert_eq!(
            (content.as_ptr() as usize - bytes.as_ptr() as usize) % ALIGNMENT,
            0
        );
    }
}

#[test]
fn unaligned_bytes_read_the_same() {
    let mut shifted = vec![0xff];
    shifted.extend(sample());
    let container = open(&shifted[1..]).unwrap();
    let counts = container
        .numbers::<u32>("counts", &mut ByteBudget::new(8))
        .unwrap();
    assert_eq!(counts, [7, u32::MAX]);
}

#[test]
fn the_same_sections_give_the_same_bytes() {
    assert_eq!(sample(), sample());
    assert_eq!(
        open(&Writer::new(FORMAT).finish())
            .unwrap()
            .sections()
            .count(),
        0
    );
}

#[test]
fn every_flipped_byte_is_noticed() {
    let bytes = sample();
    for at in 0..bytes.len() {
        for mask in [1, 2, 4, 8, 16, 32, 64, 128, 255] {
            let mut flipped = bytes.clone();
            flipped[at] ^= mask;
            assert!(open(&flipped).is_err(), "byte {at} ^ {mask}");
        }
    }
}

#[test]
fn every_truncation_and_extension_is_refused() {
    let bytes = sample();
    for length in 0..bytes.len() {
        assert!(open(&bytes[..length]).is_err(), "{length} bytes");
    }
    for extra in [0, 1] {
        let error = error_after(|bytes| bytes.push(extra));
        assert_eq!(malformed_field(&error), "file length");
    }
    // A longer file is refused even if the length in the header agrees.
    let error = error_after(|bytes| {
        bytes.push(0);
        let length = bytes.len() as u64;
        put_u64(bytes, FILE_LENGTH, length);
    });
    assert_eq!(malformed_field(&error), "end of the sections");
}

#[test]
fn files_of_another_kind_are_named() {
    for bytes in [&b""[..], b"TEST", b"\x89PNG\r\n\x1a\n and more"] {
        let error = open(bytes).unwrap_err();
        assert!(
            matches!(error, ContainerError::NotThisFormat { .. }),
            "{error}"
        );
    }
    let error = error_after(|bytes| bytes[8] = b'X');
    assert!(error.to_string().contains("TESTDATAXnit"), "{error}");
}

#[test]
fn versions_outside_the_range_are_refused() {
    for (at, version, accepted) in [
        (CONTENT, 1, false),
        (CONTENT, 2, true),
        (CONTENT, 4, false),
        (LAYOUT, 0, false),
        (LAYOUT, 2, false),
    ] {
        let mut bytes = sample();
        put_u32(&mut bytes, at, version);
        reseal(&mut bytes);
        match open(&bytes) {
            Ok(container) => assert!(accepted && container.version() == version),
            Err(ContainerError::UnsupportedVersion { found, .. }) => {
                assert!(!accepted && found == version);
            }
            Err(other) => panic!("{other}"),
        }
    }
}

#[test]
fn broken_tables_are_named() {
    let of = |change: &dyn Fn(&mut Vec<u8>)| error_after(|bytes| change(bytes));
    let field = |change: &dyn Fn(&mut Vec<u8>)| malformed_field(&of(change));
    let second = FIRST_ENTRY + ENTRY_SIZE;
    assert_eq!(field(&|b| b[40] = 1), "reserved bytes");
    assert_eq!(field(&|b| b[FIRST_ENTRY] = 0), "section name");
    assert_eq!(field(&|b| b[FIRST_ENTRY + 7] = b'x'), "section name");
    assert_eq!(
        field(&|b| b.copy_within(FIRST_ENTRY..FIRST_ENTRY + 8, second)),
        "section name"
    );
    assert_eq!(
        field(&|b| put_u32(b, FIRST_ENTRY + ENTRY_TYPE, 9)),
        "element type"
    );
    // Offsets that overlap, are out of order, leave a gap, lie beyond the end, or wrap around.
    for offset in [FIRST_CONTENT as u64, 0, 320 + 64, 1 << 20, u64::MAX] {
        assert_eq!(
            field(&|b| put_u64(b, second + ENTRY_OFFSET, offset)),
            "section offset"
        );
    }
    for length in [1 << 20, u64::MAX, u64::MAX - 255] {
        assert_eq!(
            field(&|b| put_u64(b, second + ENTRY_LENGTH, length)),
            "section length"
        );
    }
    assert_eq!(
        field(&|b| put_u64(b, second + ENTRY_LENGTH, 15)),
        "section length"
    );
    assert_eq!(field(&|b| b[FIRST_CONTENT + 63] = 1), "padding");
    assert_eq!(field(&|b| put_u32(b, COUNT, 4096)), "file length");
    assert_eq!(field(&|b| put_u32(b, COUNT, 5)), "padding");
    let error = of(&|b| put_u32(b, COUNT, u32::MAX));
    assert!(
        matches!(error, ContainerError::LimitExceeded { .. }),
        "{error}"
    );
}

#[test]
fn errors_of_damage_name_the_section() {
    let error = error_after(|bytes| bytes[FIRST_CONTENT] ^= 1);
    assert!(
        error
            .to_string()
            .starts_with("section \"about\" is damaged"),
        "{error}"
    );
    let mut bytes = sample();
    bytes[TABLE_CRC] ^= 1;
    let error = open(&bytes).unwrap_err();
    assert!(
        error.to_string().starts_with("header is damaged"),
        "{error}"
    );
}

#[test]
fn budgets_are_kept() {
    let bytes = sample();
    let mut none = ByteBudget::new(0);
    let error = Container::read(&bytes, &FORMAT, &mut none).unwrap_err();
    assert!(
        matches!(error, ContainerError::LimitExceeded { limit: 0, .. }),
        "{error}"
    );
    let container = open(&bytes).unwrap();
    let mut budget = ByteBudget::new(15);
    let error = container
        .numbers::<f32>("weights", &mut budget)
        .unwrap_err();
    assert!(
        matches!(
            error,
            ContainerError::LimitExceeded {
                limit: 15,
                found: 16,
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(budget.remaining(), 15);
}

#[test]
fn wrong_names_and_types_are_refused() {
    let mut writer = Writer::new(FORMAT);
    writer.add_numbers("x", &[1.0f32, f32::NAN]).unwrap();
    for name in ["", "nine char", "a b", "ü", "x"] {
        let error = writer.add_bytes(name, &[1]).unwrap_err();
        assert!(
            matches!(error, ContainerError::InvalidSection { .. }),
            "{name}: {error}"
        );
    }
    let bytes = writer.finish();
    let container = open(&bytes).unwrap();
    let mut budget = ByteBudget::new(100);
    let error = container.bytes("y").unwrap_err();
    assert!(
        matches!(error, ContainerError::MissingSection { .. }),
        "{error}"
    );
    let error = container.numbers::<u32>("x", &mut budget).unwrap_err();
    assert_eq!(malformed_field(&error), "element type of a section");
    let error = container
        .finite_numbers::<f32>("x", &mut budget)
        .unwrap_err();
    assert!(
        matches!(error, ContainerError::Malformed { at: 132, .. }),
        "{error}"
    );
}

#[test]
fn text_must_be_text() {
    let mut bytes = sample();
    bytes[FIRST_CONTENT + 5] = 0xff;
    let crc = crc32fast::hash(&bytes[FIRST_CONTENT..FIRST_CONTENT + 8]);
    put_u32(&mut bytes, FIRST_ENTRY + ENTRY_CRC, crc);
    reseal(&mut bytes);
    let error = open(&bytes).unwrap().text("about").unwrap_err();
    let at_the_byte = matches!(error, ContainerError::Malformed { at: 261, .. });
    assert!(at_the_byte, "{error}");
}

proptest! {
    /// Splices, noise and truncation, with and without a matching checksum: nothing panics, and
    /// everything that is read fits the budget.
    #[test]
    fn mutated_bytes_never_panic(
        edits in prop::collection::vec((any::<usize>(), any::<u8>()), 0..6),
        splice in (any::<usize>(), any::<usize>(), 0usize..80),
        cut in any::<usize>(),
        sealed in any::<bool>(),
        allowance in 0u64..600,
    ) {
        let mut bytes = sample();
        for (at, value) in edits {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        let (from, to, length) = splice;
        let from = from % (bytes.len() - length);
        let to = to % (bytes.len() - length);
        bytes.copy_within(from..from + length, to);
        if cut % 3 == 0 {
            bytes.truncate(cut % bytes.len());
        }
        if sealed && bytes.len() >= HEADER_SIZE {
            reseal(&mut bytes);
        }
        read_everything(&bytes, allowance);
    }

    #[test]
    fn random_bytes_never_panic(
        mut bytes in prop::collection::vec(any::<u8>(), 0..400),
        count in 0u32..12,
    ) {
        read_everything(&bytes, 1000);
        if bytes.len() >= HEADER_SIZE {
            bytes[MAGIC].copy_from_slice(&FORMAT.magic);
            bytes[KIND].copy_from_slice(&FORMAT.kind);
            put_u32(&mut bytes, LAYOUT, LAYOUT_VERSION);
            put_u32(&mut bytes, CONTENT, FORMAT.version);
            put_u32(&mut bytes, COUNT, count);
            let length = bytes.len() as u64;
            put_u64(&mut bytes, FILE_LENGTH, length);
            bytes[RESERVED].fill(0);
            reseal(&mut bytes);
            read_everything(&bytes, 1000);
        }
    }
}

/// Reads every section in every way; what is allocated must fit the allowance.
fn read_everything(bytes: &[u8], allowance: u64) {
    let mut budget = ByteBudget::new(allowance);
    let Ok(container) = Container::read(bytes, &FORMAT, &mut budget) else {
        return;
    };
    let mut allocated = allowance - budget.remaining();
    for (name, _) in container.sections() {
        let _ = container.text(name);
        if let Ok(numbers) = container.numbers::<f32>(name, &mut budget) {
            allocated += numbers.capacity() as u64 * 4;
        }
        if let Ok(numbers) = container.numbers::<u64>(name, &mut budget) {
            allocated += numbers.capacity() as u64 * 8;
        }
    }
    assert!(allocated <= allowance, "{allocated} of {allowance}");
}
