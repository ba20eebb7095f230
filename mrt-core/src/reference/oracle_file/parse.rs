//! From hostile bytes to a checked [`ReferenceFile`].

use super::context::{FileContext, Shown};
use super::description::{Description, check_kind, check_level};
use super::error::ReferenceError;
use super::reference_file::{Kind, ReferenceFile};
use crate::container::place::check_plain;
use crate::geometry::cube::Face;
use glam::DVec3;
use std::path::Path;

/// Most bytes of a description; the largest known file takes 8 kB.
const MAX_JSON_BYTES: u64 = 4 << 20;
/// Most numbers in a file, 256 MB.
const MAX_VALUES: u64 = 64 << 20;

/// Reads `description`, a `.json` file, and the `.f32` file beside it.
///
/// # Errors
/// [`ReferenceError`], for the first rule that the files break.
pub fn read(description: &Path) -> Result<ReferenceFile, ReferenceError> {
    let file = FileContext(description.display().to_string());
    let io = |source| file.io(source);
    check_text_size(&file, size_of_file(description).map_err(io)?)?;
    let text = std::fs::read(description).map_err(io)?;
    let stem = description.file_stem().unwrap_or_default();
    let described = describe(&file, &stem.to_string_lossy(), &text)?;
    let path = description.with_extension("f32");
    let file = FileContext(path.display().to_string());
    let io = |source| file.io(source);
    // The size is checked before reading, so that a huge file costs nothing, and after, in case it
    // changed.
    check_data_size(&file, &described, size_of_file(&path).map_err(io)?)?;
    finish(&file, described, &std::fs::read(&path).map_err(io)?)
}

/// Same as [`read`], from the bytes of both files. `name` is what the files are called, without ending.
///
/// # Errors
/// [`ReferenceError`], for the first rule that the bytes break; never `Io`.
pub fn from_bytes(
    name: &str,
    description: &[u8],
    data: &[u8],
) -> Result<ReferenceFile, ReferenceError> {
    let file = FileContext(format!("{name}.json"));
    check_text_size(&file, description.len() as u64)?;
    let described = describe(&file, name, description)?;
    finish(&FileContext(format!("{name}.f32")), described, data)
}

fn check_text_size(file: &FileContext, found: u64) -> Result<(), ReferenceError> {
    file.check_limit("the file size in bytes", found, MAX_JSON_BYTES)
}

/// A checked description.
struct Described {
    parsed: Description,
    walls: Vec<(usize, Face)>,
    kind: Kind,
    /// Size of each dimension of the numbers, slowest first.
    shape: Vec<u64>,
    /// Number of all numbers, at most [`MAX_VALUES`].
    count: u64,
}

/// Checks all that the description of a file of this name says.
fn describe(file: &FileContext, name: &str, text: &[u8]) -> Result<Described, ReferenceError> {
    let parsed: Description = serde_json::from_slice(text).map_err(|error| file.json(&error))?;
    if name != parsed.name {
        let expected = format!("{name:?}, as the file is named");
        return Err(file.malformed("name", expected, Shown(parsed.name)));
    }
    let (index, walls) = check_level(file, &parsed)?;
    let (kind, shape) = check_kind(file, &parsed, (&index, &walls))?;
    if parsed.shape != shape {
        return Err(file.malformed("shape", Shown(&shape), Shown(&parsed.shape)));
    }
    let count = shape
        .iter()
        .try_fold(1u64, |product, &size| product.checked_mul(size))
        .unwrap_or(u64::MAX);
    file.check_limit("the number of values", count, MAX_VALUES)?;
    Ok(Described {
        parsed,
        walls,
        kind,
        shape,
        count,
    })
}

fn check_data_size(
    file: &FileContext,
    described: &Described,
    found: u64,
) -> Result<(), ReferenceError> {
    let expected = described.count * 4;
    if found == expected {
        return Ok(());
    }
    Err(file.malformed("the file size in bytes", expected, found))
}

/// The file whose numbers are `bytes`; `file` is the one with the numbers.
fn finish(
    file: &FileContext,
    described: Described,
    bytes: &[u8],
) -> Result<ReferenceFile, ReferenceError> {
    check_data_size(file, &described, bytes.len() as u64)?;
    let Described {
        parsed,
        walls,
        kind,
        shape,
        ..
    } = described;
    let may_be_negative = matches!(kind, Kind::RadianceSh9 { .. });
    Ok(ReferenceFile {
        name: parsed.name,
        resolution: match kind {
            Kind::RadianceSh9 { .. } => None,
            _ => parsed.resolution.map(|resolution| resolution as usize),
        },
        kind,
        cells: parsed.cells,
        walls,
        lights: parsed.lights.into_iter().map(DVec3::from_array).collect(),
        intensity: parsed.intensity,
        terms: parsed.terms,
        shape: shape.iter().map(|&size| size as usize).collect(),
        data: values(file, bytes, may_be_negative)?,
    })
}

/// Bytes of a plain file. A pipe has none, and reading it would wait until somebody writes to it.
fn size_of_file(path: &Path) -> std::io::Result<u64> {
    let found = std::fs::metadata(path)?;
    check_plain(&found)?;
    Ok(found.len())
}

/// Numbers of 32 bits each, all of them finite.
fn values(
    file: &FileContext,
    bytes: &[u8],
    may_be_negative: bool,
) -> Result<Vec<f32>, ReferenceError> {
    let (words, _) = bytes.as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|&word| f32::from_le_bytes(word)).collect();
    let is_allowed = |x: f32| x.is_finite() && (may_be_negative || x >= 0.0);
    match values.iter().position(|&x| !is_allowed(x)) {
        None => Ok(values),
        Some(k) => {
            let expected = if may_be_negative {
                "a finite number"
            } else {
                "a finite number of at least 0"
            };
            Err(file.malformed(format!("value {k}"), expected, values[k]))
        }
    }
}
