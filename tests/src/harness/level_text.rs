//! Levels from text.

use super::target::{Target, measured, mutate_plain};
use mrt_runtime::Level;

/// Text that may be a level.
pub const TARGET: Target = Target {
    name: "level_text",
    run,
    mutate: mutate_plain,
    words: &[
        "format",
        "mrt-level",
        "version",
        "connections",
        "doors",
        "[[block]]",
        "shape",
        "cell",
        "box",
        "corners",
        "albedo",
        "face_albedo",
        "face_emission",
        "orientation",
        "transport",
        "regathered",
        "rebuilt",
        "canonical",
        "dead_end",
        "straight",
        "closed",
        "tube",
        "door",
        "window",
        "-x",
        "+x",
        "-y",
        "+y",
        "-z",
        "+z",
        "+x+y",
        "nan",
        "inf",
        "-inf",
        "1e300",
        "1e-300",
        "4294967296",
        "-1",
        "0.5",
        "\n",
        "\"",
        "'''",
        "[[",
        "]]",
        "{",
        "}",
        " = ",
        "#",
        "\\u0000",
    ],
};

/// A short text may need this much: parsers allocate ahead.
const FIXED_BYTES: u64 = 1 << 18;

/// Most bytes that reading allocates for each byte of text: a block in memory takes 512, and its shortest text about 60.
const BYTES_PER_BYTE: u64 = 512;

/// Reads the text. A level that comes out is sound, and its own text gives the same level.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let (read, allocated) = measured(|| Level::from_text(text));
    let most = FIXED_BYTES + BYTES_PER_BYTE * bytes.len() as u64;
    assert!(allocated <= most, "{allocated} bytes, expected {most}");
    match read {
        Ok(level) => {
            assert_eq!(level.check(), Ok(()));
            let again = level.to_text().expect("a sound level has text");
            assert_eq!(Level::from_text(&again).expect("and is read again"), level);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}
