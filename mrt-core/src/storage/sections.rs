//! Stored matrices as sections of a container.
//!
//! The values are one section, whose element type (F32, F16 or I8) tells how they are stored. The
//! scales, if there are any, are an F32 section of their own, one number per mode. The caller names both
//! sections: names have eight bytes, so no suffix would always fit. A format that starts to use F16 or
//! I8 needs a new content version, because older readers know neither.

use super::matrix::{CowValues, ModeAxis, Storage, StoredMatrix, StoredValues};
use crate::container::{ByteBudget, Container, ContainerError, ElementType, Writer, malformed};
use std::borrow::Cow;

/// Where a matrix is in a container, and the shape that its reader expects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredSection<'n> {
    /// Name of the section of values.
    pub values: &'n str,
    /// Name of the section of scales; ignored where the values are `f32`.
    pub scales: &'n str,
    /// Rows of the matrix.
    pub rows: usize,
    /// Columns of the matrix.
    pub columns: usize,
    /// Whether rows or columns share a scale.
    pub modes: ModeAxis,
}

/// Appends a matrix to a container: its values as section `values` and, unless it is `f32`, its scales
/// as section `scales`.
///
/// # Errors
/// Those of [`Writer::add_bytes`], for either name.
pub fn write_stored(
    writer: &mut Writer,
    values: &str,
    scales: &str,
    matrix: &StoredMatrix,
) -> Result<(), ContainerError> {
    match matrix.values() {
        StoredValues::F32(numbers) => return writer.add_numbers(values, numbers),
        StoredValues::F16(numbers) => writer.add_numbers(values, numbers)?,
        StoredValues::Int8(numbers) => writer.add_numbers(values, numbers)?,
    }
    writer.add_numbers(scales, matrix.scales())
}

/// Reads a matrix, in place where the bytes of the file allow it ([`Container::numbers_in_place`]).
/// Bytes that must be copied are first taken from `budget`.
///
/// Every element of the result decodes to a finite number. Cost: one pass over the values.
///
/// # Errors
/// - [`ContainerError::MissingSection`].
/// - [`ContainerError::LimitExceeded`], if `budget` has fewer bytes left than must be copied.
/// - [`ContainerError::Malformed`] for values that have another type than F32, F16 or I8, or are not
///   rows x columns in number, and for a value that is infinite, NaN or the integer -128.
/// - [`ContainerError::Malformed`] for scales that are not one per mode, and for a scale that is not a
///   normal positive number (for F16 a power of two) whose product with the largest value of the type
///   is finite.
pub fn read_stored<'a>(
    container: &Container<'a>,
    section: &StoredSection,
    budget: &mut ByteBudget,
) -> Result<StoredMatrix<'a>, ContainerError> {
    let (rows, columns, name) = (section.rows, section.columns, section.values);
    let element_type = container.element_type(name)?;
    let Some(storage) = Storage::from_element_type(element_type) else {
        let (what, expected) = ("element type of a matrix", "F32, F16 or I8");
        let (at, found) = (container.offset(name)?, format!("{element_type:?}"));
        return Err(malformed(what, at, expected, found));
    };
    // Lengths are checked first, so that nothing is copied for a matrix that is refused.
    let count = rows as u128 * columns as u128;
    check_count(container, name, element_type, count)?;
    let values = match storage {
        Storage::F32 => CowValues::F32(container.finite_numbers_in_place(name, budget)?),
        Storage::F16 => CowValues::F16(container.finite_numbers_in_place(name, budget)?),
        Storage::Int8 => CowValues::Int8(symmetric_integers(container, name, budget)?),
    };
    let scales = match storage {
        Storage::F32 => Cow::Borrowed(&[][..]),
        Storage::F16 | Storage::Int8 => read_scales(container, section, storage, budget)?,
    };
    Ok(StoredMatrix {
        rows,
        columns,
        modes: section.modes,
        values,
        scales,
    })
}

fn check_count(
    container: &Container,
    name: &str,
    element_type: ElementType,
    expected: u128,
) -> Result<(), ContainerError> {
    let found = container.typed_bytes(name, element_type)?.len() / element_type.size();
    if found as u128 == expected {
        return Ok(());
    }
    let at = container.offset(name)?;
    Err(malformed("count of numbers", at, expected, found))
}

/// A section of integers from -127 to 127.
fn symmetric_integers<'a>(
    container: &Container<'a>,
    name: &str,
    budget: &mut ByteBudget,
) -> Result<Cow<'a, [i8]>, ContainerError> {
    let values = container.numbers_in_place::<i8>(name, budget)?;
    match values.iter().position(|&x| x == i8::MIN) {
        None => Ok(values),
        Some(k) => {
            let at = container.offset(name)? + k;
            Err(malformed("number", at, "-127 to 127", i8::MIN))
        }
    }
}

fn read_scales<'a>(
    container: &Container<'a>,
    section: &StoredSection,
    storage: Storage,
    budget: &mut ByteBudget,
) -> Result<Cow<'a, [f32]>, ContainerError> {
    let name = section.scales;
    let modes = section.modes.count(section.rows, section.columns);
    check_count(container, name, ElementType::F32, modes as u128)?;
    let scales = container.numbers_in_place::<f32>(name, budget)?;
    let power_of_two = storage == Storage::F16;
    let rule = if power_of_two {
        "a positive power of two, at most 2^112"
    } else {
        "a normal positive number, at most 2.679e36"
    };
    let legal = |scale: f32| {
        scale.is_normal()
            && scale > 0.0
            && (scale * storage.largest_value()).is_finite()
            && (!power_of_two || scale.to_bits() << 9 == 0)
    };
    match scales.iter().position(|&scale| !legal(scale)) {
        None => Ok(scales),
        Some(k) => {
            let at = container.offset(name)? + k * size_of::<f32>();
            Err(malformed("scale of a mode", at, rule, scales[k]))
        }
    }
}

#[cfg(test)]
mod tests;
