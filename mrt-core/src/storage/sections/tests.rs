//! Tests of sections: in place, copied, and hostile.

use super::*;
use crate::container::SectionNumber;
use crate::container::fixtures::{FORMAT, Placed, open};
use crate::linalg::matrix::Matrix;
use crate::storage::f16;
use proptest::prelude::*;

fn matrix() -> Matrix<f32> {
    Matrix::from_fn(5, 3, |i, j| (i as f32 - 1.7) * [1.0, 1e-8, -1e9][j])
}

fn section(rows: usize, columns: usize, modes: ModeAxis) -> StoredSection<'static> {
    StoredSection {
        values: "straight",
        scales: "s.scale",
        rows,
        columns,
        modes,
    }
}

fn file_of(stored: &StoredMatrix) -> Vec<u8> {
    let mut writer = Writer::new(FORMAT);
    writer.add_text("about", "odd").unwrap();
    write_stored(&mut writer, "straight", "s.scale", stored).unwrap();
    writer.finish()
}

/// A file of arbitrary values and scales.
fn file_with<T: SectionNumber, S: SectionNumber>(values: &[T], scales: &[S]) -> Vec<u8> {
    let mut writer = Writer::new(FORMAT);
    writer.add_numbers("straight", values).unwrap();
    writer.add_numbers("s.scale", scales).unwrap();
    writer.finish()
}

fn read<'a>(bytes: &'a [u8], section: &StoredSection) -> Result<StoredMatrix<'a>, ContainerError> {
    read_stored(&open(bytes), section, &mut ByteBudget::new(1 << 16))
}

/// The message of the error for a 2 x 2 matrix with one scale per column.
fn refusal<T: SectionNumber, S: SectionNumber>(values: &[T], scales: &[S]) -> String {
    let file = file_with(values, scales);
    let error = read(&file, &section(2, 2, ModeAxis::Columns)).unwrap_err();
    assert!(matches!(error, ContainerError::Malformed { .. }), "{error}");
    error.to_string()
}

fn address_of_values(stored: &StoredMatrix) -> *const u8 {
    match stored.values() {
        StoredValues::F32(values) => values.as_ptr().cast(),
        StoredValues::F16(values) => values.as_ptr().cast(),
        StoredValues::Int8(values) => values.as_ptr().cast(),
    }
}

#[cfg(target_endian = "little")]
#[test]
fn aligned_files_are_used_in_place_and_others_copied() {
    for storage in Storage::ALL {
        let stored = StoredMatrix::encode(&matrix(), storage, ModeAxis::Columns);
        assert!(!stored.is_borrowed());
        let file = file_of(&stored);
        for shift in 0..8 {
            let placed = Placed::new(&file, shift);
            let bytes = placed.bytes();
            let mut budget = ByteBudget::new(1000);
            let section = section(5, 3, ModeAxis::Columns);
            let found = read_stored(&open(bytes), &section, &mut budget).unwrap();
            assert_eq!(found, stored);
            assert_eq!(found.to_matrix(), stored.to_matrix());
            let borrowed = shift % storage.element_type().size() == 0;
            assert_eq!(found.is_borrowed(), borrowed);
            let within = bytes.as_ptr_range().contains(&address_of_values(&found));
            assert_eq!(within, borrowed);
            let mut copied = if borrowed { 0 } else { size_of_values(&found) };
            if shift % 4 != 0 {
                copied += size_of_val(found.scales());
            }
            assert_eq!(1000 - budget.remaining(), copied as u64);
            let owned = found.clone().into_owned();
            assert!(!owned.is_borrowed());
            assert_eq!(owned, found);
        }
    }
}

fn size_of_values(stored: &StoredMatrix) -> usize {
    stored.bytes() - size_of_val(stored.scales())
}

#[test]
fn copies_stay_within_the_budget() {
    let file = file_of(&StoredMatrix::encode(
        &matrix(),
        Storage::F16,
        ModeAxis::Rows,
    ));
    let placed = Placed::new(&file, 1);
    let container = open(placed.bytes());
    // 30 bytes of values and 20 of scales.
    for (allowance, fits) in [(29, false), (49, false), (50, true)] {
        let mut budget = ByteBudget::new(allowance);
        match read_stored(&container, &section(5, 3, ModeAxis::Rows), &mut budget) {
            Ok(_) => assert!(fits),
            Err(ContainerError::LimitExceeded { .. }) => assert!(!fits),
            Err(other) => panic!("{other}"),
        }
    }
}

#[test]
fn other_shapes_are_refused() {
    for storage in Storage::ALL {
        let file = file_of(&StoredMatrix::encode(&matrix(), storage, ModeAxis::Columns));
        for (rows, columns) in [(5, 2), (4, 3), (0, 0), (6, 3), (usize::MAX, usize::MAX)] {
            let error = read(&file, &section(rows, columns, ModeAxis::Columns)).unwrap_err();
            assert!(error.to_string().contains("count of numbers"), "{error}");
        }
        // There is one scale per column, not per row; `f32` has none.
        let other_axis = read(&file, &section(5, 3, ModeAxis::Rows));
        match storage {
            Storage::F32 => assert!(other_axis.is_ok()),
            Storage::F16 | Storage::Int8 => {
                let error = other_axis.unwrap_err();
                assert!(error.to_string().contains("expected 5, found 3"), "{error}");
            }
        }
    }
}

#[test]
fn truncated_sections_are_refused() {
    let halves = [1.0, 2.0, 3.0].map(f16::from_f32_const);
    let expected = "expected 4, found 3";
    assert!(refusal(&halves, &[1.0f32; 2]).contains(expected));
    assert!(refusal(&[1i8, 2, 3], &[1.0f32; 2]).contains(expected));
    assert!(refusal(&[1f32, 2.0, 3.0], &[1.0f32; 2]).contains(expected));
    assert!(refusal(&[1i8; 4], &[1.0f32]).contains("expected 2, found 1"));
    assert!(refusal(&[1i8; 4], &[1.0f32; 3]).contains("expected 2, found 3"));
}

#[test]
fn wrong_types_are_refused() {
    let message = refusal(&[0x3c00u16; 4], &[1.0f32; 2]);
    assert!(
        message.contains("expected F32, F16 or I8, found U16"),
        "{message}"
    );
    let message = refusal(&[1i8; 4], &[1u32; 2]);
    assert!(message.contains("expected F32, found U32"), "{message}");
}

#[test]
fn values_that_are_not_numbers_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for at in 0..4 {
            let mut values = [1.0f32; 4];
            values[at] = bad;
            let expected = "expected a finite one";
            assert!(refusal(&values, &[1.0f32; 2]).contains(expected));
            let halves = values.map(f16::from_f32_const);
            assert!(refusal(&halves, &[1.0f32; 2]).contains(expected));
        }
    }
    let message = refusal(&[1i8, -127, -128, 0], &[1.0f32; 2]);
    assert!(
        message.contains("expected -127 to 127, found -128"),
        "{message}"
    );
}

#[test]
fn wrong_scales_are_refused() {
    let never = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        0.0,
        -0.0,
        -1.0,
        f32::MIN_POSITIVE.next_down(),
        f32::MAX,
    ];
    let halves = [f16::ONE; 4];
    for scale in never {
        let message = refusal(&[1i8; 4], &[1.0, scale]);
        assert!(message.contains("scale of a mode"), "{message}");
        let message = refusal(&halves, &[scale, 1.0]);
        assert!(message.contains("scale of a mode"), "{message}");
    }
    for scale in [3.0, 1.0f32.next_up(), 2f32.powi(113)] {
        let message = refusal(&halves, &[scale, 1.0]);
        assert!(message.contains("power of two"), "{message}");
    }
    // The largest accepted scales decode to finite numbers.
    let section = section(2, 2, ModeAxis::Columns);
    let file = file_with(&[f16::MAX; 4], &[2f32.powi(112); 2]);
    assert!(read(&file, &section).unwrap().get(1, 1).is_finite());
    let file = file_with(&[127i8; 4], &[2.679e36f32; 2]);
    assert!(read(&file, &section).unwrap().get(1, 1).is_finite());
}

#[test]
fn missing_sections_are_named() {
    let mut writer = Writer::new(FORMAT);
    writer.add_numbers("straight", &[1i8; 4]).unwrap();
    let file = writer.finish();
    let expected = section(2, 2, ModeAxis::Columns);
    let error = read(&file, &expected).unwrap_err();
    assert_eq!(error.to_string(), "no section \"s.scale\"");
    let file = Writer::new(FORMAT).finish();
    let error = read(&file, &expected).unwrap_err();
    assert_eq!(error.to_string(), "no section \"straight\"");
}

#[test]
fn names_that_are_taken_are_refused() {
    let stored = StoredMatrix::encode(&matrix(), Storage::F16, ModeAxis::Rows);
    let mut writer = Writer::new(FORMAT);
    let error = write_stored(&mut writer, "same", "same", &stored).unwrap_err();
    assert!(
        matches!(error, ContainerError::InvalidSection { .. }),
        "{error}"
    );
}

proptest! {
    /// Any bytes of any type give an error or a matrix of finite numbers, and that matrix gives the
    /// same file again.
    #[test]
    fn hostile_sections_never_panic(
        values in prop::collection::vec(any::<u8>(), 16),
        scales in prop::collection::vec(any::<u32>(), 2),
        kind in 0usize..3,
        by_rows in any::<bool>(),
        tame in any::<bool>(),
    ) {
        let number = |bytes: &[u8]| f32::from_bytes(bytes);
        // Half of the time scales pass, so that the checks behind them are reached.
        let scales: Vec<f32> = scales
            .into_iter()
            .map(|bits| f32::from_bits(if tame { bits & 0x3f80_0000 | 0x2000_0000 } else { bits }))
            .collect();
        let file = match kind {
            0 => file_with(&values.chunks(4).map(number).collect::<Vec<_>>(), &scales),
            1 => file_with(
                &values[..8].chunks(2).map(f16::from_bytes).collect::<Vec<_>>(),
                &scales,
            ),
            _ => file_with(
                &values[..4].iter().map(|&b| b as i8).collect::<Vec<_>>(),
                &scales,
            ),
        };
        let modes = if by_rows { ModeAxis::Rows } else { ModeAxis::Columns };
        if let Ok(stored) = read(&file, &section(2, 2, modes)) {
            prop_assert!(stored.to_matrix().data().iter().all(|x| x.is_finite()));
            let again = file_of(&stored);
            prop_assert_eq!(&file_of(&stored.clone().into_owned()), &again);
            prop_assert_eq!(&read(&again, &section(2, 2, modes)).unwrap(), &stored);
        }
    }

    #[test]
    fn matrices_come_back_and_give_the_same_bytes(
        data in prop::collection::vec(-1e6f32..1e6, 12),
        storage in prop::sample::select(&Storage::ALL[..]),
        by_rows in any::<bool>(),
    ) {
        let modes = if by_rows { ModeAxis::Rows } else { ModeAxis::Columns };
        let matrix = Matrix::from_column_major(4, 3, data);
        let stored = StoredMatrix::encode(&matrix, storage, modes);
        let file = file_of(&stored);
        prop_assert_eq!(&file_of(&StoredMatrix::encode(&matrix, storage, modes)), &file);
        let found = read(&file, &section(4, 3, modes)).unwrap();
        prop_assert_eq!(found.to_matrix(), stored.to_matrix());
        prop_assert_eq!(found, stored);
    }
}
