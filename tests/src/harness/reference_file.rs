//! Reference files: a description, a zero byte, and numbers.

use super::target::{Target, measured, mutate_plain};
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::oracle_file::{ReferenceError, ReferenceFile, from_bytes};

/// Bytes that may be a reference file.
pub const TARGET: Target = Target {
    name: "reference_file",
    run,
    mutate: mutate_plain,
    words: &[
        "\"name\"",
        "\"level\"",
        "\"kind\"",
        "\"irradiance\"",
        "\"irradiance_rgb\"",
        "\"radiance_sh9\"",
        "\"cells\"",
        "\"lights\"",
        "\"intensity\"",
        "\"resolution\"",
        "\"bounces\"",
        "\"walls\"",
        "\"albedo\"",
        "\"terms\"",
        "\"points\"",
        "\"shape\"",
        "[0,0,0]",
        "[1,0,0]",
        "0.5",
        "-1",
        "1e999",
        "1e300",
        "4294967296",
        "18446744073709551615",
        "null",
        "\"-x\"",
        "\"+z\"",
        "[",
        "]",
        "{",
        "}",
        ",",
        ":",
        "\\n",
    ],
};

/// The name that descriptions give.
const NAME: &str = "level";

/// Most numbers that are made up for a description, if the input has another count.
const MOST_NUMBERS: usize = 1 << 14;

/// Most bytes that reading allocates beside a fixed part, for each byte of input: a wall takes 80 in memory.
const BYTES_PER_BYTE: u64 = 256;
const FIXED_BYTES: u64 = 1 << 18;

/// Reads the files. If only the length of the numbers is wrong, they are repeated or cut to fit.
pub fn run(bytes: &[u8]) {
    let split = bytes.iter().position(|&byte| byte == 0);
    let (description, numbers) = bytes.split_at(split.unwrap_or(bytes.len()));
    let numbers = numbers.strip_prefix(b"\0").unwrap_or_default();
    let (read, allocated) = measured(|| from_bytes(NAME, description, numbers));
    let most = FIXED_BYTES + BYTES_PER_BYTE * bytes.len() as u64;
    assert!(allocated <= most, "{allocated} bytes, expected {most}");
    match read {
        Ok(file) => use_file(&file),
        Err(error) => {
            assert!(!error.to_string().is_empty());
            let fitting = wanted_bytes(&error).filter(|&wanted| wanted <= 4 * MOST_NUMBERS);
            if let Some(wanted) = fitting {
                let numbers: Vec<u8> = numbers.iter().chain(&[0; 4]).copied().collect();
                let numbers: Vec<u8> = numbers.iter().cycle().take(wanted).copied().collect();
                if let Ok(file) = from_bytes(NAME, description, &numbers) {
                    use_file(&file);
                }
            }
        }
    }
}

/// The length that the numbers should have, if that is what is wrong.
fn wanted_bytes(error: &ReferenceError) -> Option<usize> {
    match error {
        ReferenceError::Malformed { file, expected, .. } if file.ends_with(".f32") => {
            expected.parse().ok()
        }
        _ => None,
    }
}

/// Computes everything that a file gives. Sums of finite numbers in `f64` are finite.
fn use_file(file: &ReferenceFile) {
    // One light more than there is.
    for light in 0..=file.lights.len().min(8) {
        for bounces in [
            ReferenceBounces::First,
            ReferenceBounces::Count(3),
            ReferenceBounces::All,
        ] {
            for albedo in [0.0, 0.5, 0.99, 1.0] {
                if let Ok(light) = file.indirect_irradiance(light, bounces, albedo) {
                    assert!(light.iter().all(|e| e.is_finite()));
                }
            }
            if let Ok(light) = file.indirect_irradiance_rgb(light, bounces) {
                assert!(light.iter().flatten().all(|e| e.is_finite()));
            }
        }
        for term in 0..=file.shape[1].min(4) {
            let _ = file.term(light, term);
        }
        let hops = file.hops(light);
        assert_eq!(hops.is_ok(), light < file.lights.len());
    }
}
