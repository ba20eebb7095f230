//! Tests of the errors of stored matrices.

use super::*;
use crate::container::ElementType;
use crate::linalg::matrix::{Matrix, multiply};
use proptest::prelude::*;

/// As stated for `f16`: random mantissas give 0.02 %.
const F16_TOLERANCE: f64 = 3e-4;
/// Half a unit in the last place of one number. A mode of equal numbers errs as that number does.
const F16_MODE_TOLERANCE: f64 = 4.89e-4;
/// As stated for `int8`, where a mode's largest entry is at most twice its root mean square. Rounding
/// errs by 1 / sqrt(12) of a step, and a step is a 127th of the largest entry: 0.23 % times the ratio.
const INT8_TOLERANCE: f64 = 5e-3;
/// The same for a ratio of 4.5: the largest of 49,152 normal numbers is about 4.2 standard deviations.
const INT8_GAUSSIAN_TOLERANCE: f64 = 1.04e-2;

const TEXELS: usize = 1536;
const MODES: usize = 32;

/// Approximately normal numbers, from a fixed seed.
fn gaussian_columns() -> Matrix<f32> {
    let mut state = 7u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    // Twelve uniform numbers have variance 1 and mean 6.
    Matrix::from_fn(TEXELS, MODES, |_, _| {
        (0..12).map(|_| uniform()).sum::<f32>() - 6.0
    })
}

/// Waves of all wavelengths, like the modes of a wall.
fn smooth_columns() -> Matrix<f32> {
    Matrix::from_fn(TEXELS, MODES, |i, j| {
        let (i, j) = (i as f64 + 0.5, j as f64);
        libm::cos(std::f64::consts::PI * j * i / TEXELS as f64) as f32
    })
}

/// L2 norm of the difference over that of `expected`.
fn relative_l2(found: &[f32], expected: &[f32]) -> f64 {
    let square = |x: f64| x * x;
    let pairs = found.iter().zip(expected);
    let error: f64 = pairs
        .map(|(&a, &b)| square(f64::from(a) - f64::from(b)))
        .sum();
    let size: f64 = expected.iter().map(|&x| square(f64::from(x))).sum();
    (error / size).sqrt()
}

/// Largest relative error of a column.
fn worst_column(matrix: &Matrix<f32>, storage: Storage) -> f64 {
    let decoded = StoredMatrix::encode(matrix, storage, ModeAxis::Columns).to_matrix();
    let errors = (0..matrix.columns()).map(|j| relative_l2(decoded.column(j), matrix.column(j)));
    errors.fold(0.0, f64::max)
}

#[test]
fn names_and_types_come_back() {
    for storage in Storage::ALL {
        assert_eq!(Storage::from_name(storage.name()), Some(storage));
        let element_type = storage.element_type();
        assert_eq!(Storage::from_element_type(element_type), Some(storage));
    }
    assert_eq!(Storage::from_name("F32"), None);
    assert_eq!(Storage::from_element_type(ElementType::U16), None);
}

#[test]
fn f32_is_exact() {
    let matrix = gaussian_columns();
    let stored = StoredMatrix::encode(&matrix, Storage::F32, ModeAxis::Rows);
    assert_eq!(stored.to_matrix(), matrix);
}

#[test]
fn errors_are_as_stated_at_every_magnitude() {
    for magnitude in [1.0, 1e-8, 1e9, 1e-30, 1e37, 3.7e-5] {
        let gaussian = gaussian_columns().scaled_columns(&[magnitude; MODES]);
        let smooth = smooth_columns().scaled_columns(&[magnitude; MODES]);
        for (matrix, int8_tolerance) in [
            (gaussian, INT8_GAUSSIAN_TOLERANCE),
            (smooth, INT8_TOLERANCE),
        ] {
            let half = StoredMatrix::encode(&matrix, Storage::F16, ModeAxis::Columns).to_matrix();
            let half = relative_l2(half.data(), matrix.data());
            assert!(half <= F16_TOLERANCE, "f16 of {magnitude:e}: {half:e}");
            let half = worst_column(&matrix, Storage::F16);
            assert!(
                half <= F16_MODE_TOLERANCE,
                "a mode of {magnitude:e}: {half:e}"
            );
            let int8 = worst_column(&matrix, Storage::Int8);
            assert!(int8 <= int8_tolerance, "int8 of {magnitude:e}: {int8:e}");
        }
    }
}

/// One strong mode must not decide how exactly a weak one is stored.
#[test]
fn each_mode_has_its_own_scale() {
    let magnitudes: Vec<f32> = (0..MODES)
        .map(|j| libm::powf(10.0, j as f32 - 16.0))
        .collect();
    let basis = smooth_columns().scaled_columns(&magnitudes);
    for (storage, tolerance) in [
        (Storage::F16, F16_MODE_TOLERANCE),
        (Storage::Int8, INT8_TOLERANCE),
    ] {
        assert!(worst_column(&basis, storage) <= tolerance);
        let by_column = StoredMatrix::encode(&basis, storage, ModeAxis::Columns);
        let by_row = StoredMatrix::encode(&basis.transposed(), storage, ModeAxis::Rows);
        assert_eq!(by_row.to_matrix(), by_column.to_matrix().transposed());
        assert_eq!(by_row.scales(), by_column.scales());
    }
}

/// Errors of elements are independent, so the relative error of a product is that of the matrix.
#[test]
fn products_err_as_stated() {
    let basis = smooth_columns();
    let coefficients = gaussian_columns().columns_view(0..1).column(0)[..MODES].to_vec();
    let coefficients = Matrix::from_column_major(MODES, 1, coefficients);
    let exact = multiply(basis.view(), coefficients.view());
    for (storage, tolerance) in [
        (Storage::F16, F16_TOLERANCE),
        (Storage::Int8, INT8_TOLERANCE),
    ] {
        let stored = StoredMatrix::encode(&basis, storage, ModeAxis::Columns).to_matrix();
        let product = multiply(stored.view(), coefficients.view());
        let error = relative_l2(product.data(), exact.data());
        assert!(error <= tolerance, "{}: {error:e}", storage.name());
    }
}

#[test]
fn zeros_and_empty_matrices_are_fine() {
    for storage in Storage::ALL {
        for modes in [ModeAxis::Rows, ModeAxis::Columns] {
            for (rows, columns) in [(3, 2), (0, 4), (4, 0), (0, 0)] {
                let zeros = Matrix::zeros(rows, columns);
                let stored = StoredMatrix::encode(&zeros, storage, modes);
                assert_eq!(stored.to_matrix(), zeros);
                assert!(stored.scales().iter().all(|&scale| scale == 1.0));
            }
        }
    }
}

#[test]
fn bytes_count_values_and_scales() {
    let matrix = Matrix::from_fn(10, 3, |i, j| (i + j) as f32);
    let bytes = |storage, modes| StoredMatrix::encode(&matrix, storage, modes).bytes();
    assert_eq!(bytes(Storage::F32, ModeAxis::Columns), 120);
    assert_eq!(bytes(Storage::F16, ModeAxis::Columns), 60 + 12);
    assert_eq!(bytes(Storage::F16, ModeAxis::Rows), 60 + 40);
    assert_eq!(bytes(Storage::Int8, ModeAxis::Columns), 30 + 12);
}

/// A change of rounding or of scales must not go unnoticed.
#[test]
fn bits_are_frozen() {
    let matrix = Matrix::from_column_major(2, 2, vec![1.0, -1.0 / 3.0, 1e-8, 3e-8]);
    let half = StoredMatrix::encode(&matrix, Storage::F16, ModeAxis::Columns);
    let bits = [0x7400, 0xed55, 0x6d5e, 0x7407].map(f16::from_bits);
    assert_eq!(half.values(), StoredValues::F16(&bits));
    assert_eq!(half.scales(), [2f32.powi(-14), 2f32.powi(-39)]);
    let int8 = StoredMatrix::encode(&matrix, Storage::Int8, ModeAxis::Columns);
    assert_eq!(int8.values(), StoredValues::Int8(&[127, -42, 42, 127]));
    assert_eq!(int8.scales(), [1.0 / 127.0, 3e-8 / 127.0]);
}

#[test]
#[should_panic = "must be finite"]
fn numbers_that_are_not_finite_are_not_encoded() {
    let matrix = Matrix::from_column_major(1, 2, vec![1.0, f32::INFINITY]);
    StoredMatrix::encode(&matrix, Storage::F16, ModeAxis::Columns);
}

fn any_finite_matrix() -> impl Strategy<Value = Matrix<f32>> {
    // Bit patterns, so that the ends of the range are as likely as its middle.
    let number = any::<u32>().prop_map(|bits| match f32::from_bits(bits) {
        x if x.is_finite() => x,
        _ => f32::MAX,
    });
    (0usize..7, 0usize..7).prop_flat_map(move |(rows, columns)| {
        let data = prop::collection::vec(number.clone(), rows * columns);
        data.prop_map(move |data| Matrix::from_column_major(rows, columns, data))
    })
}

/// Largest error of an element `x` that is stored with the given scale.
fn element_tolerance(storage: Storage, x: f64, scale: f64) -> f64 {
    match storage {
        Storage::F32 => 0.0,
        // Half a unit in the last place, of a normal number or of the subnormal ones.
        Storage::F16 => (x.abs() * 2f64.powi(-11)).max(scale * 2f64.powi(-25)),
        // Half a step, and the roundings of scale, quotient and product.
        Storage::Int8 => scale * 0.500_02,
    }
}

proptest! {
    #[test]
    fn every_finite_matrix_decodes_to_a_close_one(
        matrix in any_finite_matrix(),
        by_rows in any::<bool>(),
    ) {
        let modes = if by_rows { ModeAxis::Rows } else { ModeAxis::Columns };
        for storage in Storage::ALL {
            let stored = StoredMatrix::encode(&matrix, storage, modes);
            prop_assert_eq!(stored.storage(), storage);
            let decoded = stored.to_matrix();
            for j in 0..matrix.columns() {
                for i in 0..matrix.rows() {
                    let (x, found) = (f64::from(matrix[(i, j)]), decoded[(i, j)]);
                    prop_assert!(found.is_finite());
                    prop_assert_eq!(found.to_bits(), stored.get(i, j).to_bits());
                    let mode = if by_rows { i } else { j };
                    let scale = stored.scales().get(mode).copied().map_or(1.0, f64::from);
                    let tolerance = element_tolerance(storage, x, scale);
                    prop_assert!(
                        (f64::from(found) - x).abs() <= tolerance,
                        "{} of {:e}: {:e}", storage.name(), x, found
                    );
                }
            }
        }
    }
}
