//! Stored matrices as sections of a container.
//!
//! The values are a section whose element type (F32, F16 or I8) tells how they are stored. The scales,
//! if there are any, are an F32 section of their own, one number a mode. The caller names both: names have
//! eight bytes, so no suffix would always fit, and the writer refuses a name that is taken. A format that
//! starts to use F16 or I8 needs a new content version: older readers know neither.

use super::{CowValues, ModeAxis, Storage, StoredMatrix, Values};
use crate::container::{ByteBudget, Container, ContainerError, ElementType, Writer};
use std::borrow::Cow;

/// Where a matrix is in a container, and what shape its reader expects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredSection<'n> {
    /// Name of the section of values.
    pub values: &'n str,
    /// Name of the section of scales, which is not looked for where values are `f32`.
    pub scales: &'n str,
    /// Rows of the matrix.
    pub rows: usize,
    /// Columns of the matrix.
    pub columns: usize,
    /// Which lines share a scale.
    pub modes: ModeAxis,
}

/// Appends a matrix to a container: its values as section `values` and then, unless it is `f32`, its scales
/// as section `scales`.
///
/// # Errors
/// As [`Writer::add_bytes`], for either name.
pub fn write_stored(
    writer: &mut Writer,
    values: &str,
    scales: &str,
    matrix: &StoredMatrix,
) -> Result<(), ContainerError> {
    match matrix.values() {
        Values::F32(numbers) => return writer.add_numbers(values, numbers),
        Values::F16(numbers) => writer.add_numbers(values, numbers)?,
        Values::Int8(numbers) => writer.add_numbers(values, numbers)?,
    }
    writer.add_numbers(scales, matrix.scales())
}

/// Reads a matrix, in place where the bytes of the file allow ([`Container::numbers_in_place`]); what must
/// be copied is first taken from `budget`.
///
/// Every element of the result decodes to a finite number. Cost: one pass over the values.
///
/// # Errors
/// - [`ContainerError::MissingSection`].
/// - [`ContainerError::LimitExceeded`], if `budget` has fewer bytes left than are to be copied.
/// - [`ContainerError::Malformed`], if the values have another type than F32, F16 or I8, are not rows x
///   columns in number, or one is infinite, not a number, or the integer -128; or if the scales are not one a
///   mode, each a normal positive number (for F16 a power of two) whose product with the largest
///   value of the type is finite.
pub fn read_stored<'a>(
    container: &Container<'a>,
    section: &StoredSection,
    budget: &mut ByteBudget,
) -> Result<StoredMatrix<'a>, ContainerError> {
    let (rows, columns, name) = (section.rows, section.columns, section.values);
    let element_type = container.element_type(name)?;
    let storage = Storage::from_element_type(element_type).ok_or_else(|| {
        let (what, expected) = ("element type of a matrix", "F32, F16 or I8");
        container.fault(name, what, 0, expected, format!("{element_type:?}"))
    })?;
    // Lengths come first, so that nothing is copied for a matrix that is refused.
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
    Err(container.fault(name, "count of numbers", 0, expected, found))
}

fn symmetric_integers<'a>(
    container: &Container<'a>,
    name: &str,
    budget: &mut ByteBudget,
) -> Result<Cow<'a, [i8]>, ContainerError> {
    let values = container.numbers_in_place::<i8>(name, budget)?;
    match values.iter().position(|&x| x == i8::MIN) {
        None => Ok(values),
        Some(at) => Err(container.fault(name, "number", at, "-127 to 127", i8::MIN)),
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
            let (what, at) = ("scale of a mode", k * size_of::<f32>());
            Err(container.fault(name, what, at, rule, scales[k]))
        }
    }
}

#[cfg(test)]
mod tests;
