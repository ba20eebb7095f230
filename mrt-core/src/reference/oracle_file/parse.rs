//! From hostile bytes to a checked [`ReferenceFile`].

use super::context::{FileContext, Shown};
use super::description::{Description, check_kind, check_level};
use super::error::ReferenceError;
use super::reference_file::{Kind, ReferenceFile};
use crate::container::place::check_plain;
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
    let size = size_of_file(description).map_err(io)?;
    file.check_limit("the file size in bytes", size, MAX_JSON_BYTES)?;
    let text = std::fs::read(description).map_err(io)?;
    let parsed: Description = serde_json::from_slice(&text).map_err(|error| file.json(&error))?;
    let stem = description.file_stem().unwrap_or_default();
    if stem != parsed.name.as_str() {
        return Err(file.malformed(
            "name",
            format!("{stem:?}, as the file is named"),
            Shown(parsed.name),
        ));
    }
    let (index, walls) = check_level(&file, &parsed)?;
    let (kind, expected_shape) = check_kind(&file, &parsed, (&index, &walls))?;
    if parsed.shape != expected_shape {
        return Err(file.malformed("shape", Shown(&expected_shape), Shown(&parsed.shape)));
    }
    let count = expected_shape
        .iter()
        .try_fold(1u64, |product, &size| product.checked_mul(size))
        .unwrap_or(u64::MAX);
    file.check_limit("the number of values", count, MAX_VALUES)?;
    let may_be_negative = matches!(kind, Kind::RadianceSh9 { .. });
    let data = read_values(&description.with_extension("f32"), count, may_be_negative)?;
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
        shape: expected_shape.iter().map(|&size| size as usize).collect(),
        data,
    })
}

/// Bytes of a plain file. A pipe has none, and reading it would wait until somebody writes to it.
fn size_of_file(path: &Path) -> std::io::Result<u64> {
    let found = std::fs::metadata(path)?;
    check_plain(&found)?;
    Ok(found.len())
}

/// Reads the numbers beside a description.
fn read_values(path: &Path, count: u64, may_be_negative: bool) -> Result<Vec<f32>, ReferenceError> {
    let file = FileContext(path.display().to_string());
    let io = |source| file.io(source);
    let check_size = |found: u64| {
        if found == count * 4 {
            Ok(())
        } else {
            Err(file.malformed("the file size in bytes", count * 4, found))
        }
    };
    // The size is checked before reading, so that a huge file costs nothing, and after, in case it
    // changed.
    check_size(size_of_file(path).map_err(io)?)?;
    let bytes = std::fs::read(path).map_err(io)?;
    check_size(bytes.len() as u64)?;
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
