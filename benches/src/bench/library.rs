//! Dense products by the fastest library for their shape.
//!
//! Each shape is timed once with each library, and the product of each is compared with the reference.

#![allow(
    unsafe_code,
    reason = "both libraries take pointers; lengths are checked before each call"
)]

use super::timing::fastest;
use mrt_core::linalg::matrix::{Matrix, MatrixView, multiply, multiply_add};
use std::collections::HashMap;
use std::time::Duration;

/// A library of dense products.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Library {
    /// The crate `gemm`.
    Gemm,
    /// The crate `matrixmultiply`.
    MatrixMultiply,
    /// The reference's own loops, which beat both where products are tiny.
    Loops,
}

impl Library {
    const ALL: [Library; 3] = [Library::Gemm, Library::MatrixMultiply, Library::Loops];

    /// Name of the crate, or "loops".
    pub fn name(self) -> &'static str {
        match self {
            Library::Gemm => "gemm",
            Library::MatrixMultiply => "matrixmultiply",
            Library::Loops => "loops",
        }
    }
}

/// Rows, inner size and columns of a product.
type Size = [usize; 3];

/// Time to find the fastest library for one size.
const BUDGET: Duration = Duration::from_millis(4);

/// Relative difference to the reference at which a product is wrong: sums of thousands of `f32` differ by 1e-6.
const TOLERANCE: f64 = 1e-4;

/// A library that computes something else than the product.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the product {size:?} by `{library}` differs by {found:.1e} from the reference; expected at most {TOLERANCE:e}"
)]
pub struct WrongProduct {
    /// Which library.
    pub library: &'static str,
    /// Rows, inner size, columns.
    pub size: Size,
    /// Relative difference.
    pub found: f64,
}

/// The fastest library of each size that was asked for.
#[derive(Clone, Debug, Default)]
pub struct Libraries(HashMap<Size, Library>);

impl Libraries {
    /// The fastest library for products of `a` and so many columns.
    ///
    /// # Errors
    /// [`WrongProduct`].
    pub fn fastest(&mut self, a: MatrixView<f32>, columns: usize) -> Result<Library, WrongProduct> {
        let size = [a.rows(), a.columns(), columns];
        if let Some(&known) = self.0.get(&size) {
            return Ok(known);
        }
        let b = Matrix::from_fn(a.columns(), columns, |i, j| ((i + 3 * j) % 7) as f32 - 2.5);
        let expected = multiply(a, b.view());
        let mut best = (Duration::MAX, Library::Gemm);
        for library in Library::ALL {
            let mut out = vec![0.0; a.rows() * columns];
            product(library, a, b.view(), &mut out, Sum::New);
            let found = difference(&out, expected.data());
            if found.is_nan() || found > TOLERANCE {
                return Err(WrongProduct {
                    library: library.name(),
                    size,
                    found,
                });
            }
            let time = fastest(BUDGET, || product(library, a, b.view(), &mut out, Sum::New));
            best = if time < best.0 { (time, library) } else { best };
        }
        self.0.insert(size, best.1);
        Ok(best.1)
    }
}

/// What becomes of what the output held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sum {
    /// It is overwritten.
    New,
    /// The product is added.
    Add,
}

/// `out = a b` or `out += a b`, all column-major.
///
/// # Panics
/// If sizes do not fit.
pub fn product(
    library: Library,
    a: MatrixView<f32>,
    b: MatrixView<f32>,
    out: &mut [f32],
    sum: Sum,
) {
    let (m, k, n) = (a.rows(), a.columns(), b.columns());
    assert_eq!(k, b.rows(), "inner size");
    assert_eq!(a.data().len(), m * k, "first factor");
    assert_eq!(b.data().len(), k * n, "second factor");
    assert_eq!(out.len(), m * n, "product");
    let adds = sum == Sum::Add;
    match library {
        // SAFETY: the three slices hold m x k, k x n and m x n numbers, and the strides stay inside them.
        Library::Gemm => unsafe {
            gemm::gemm(
                m,
                n,
                k,
                out.as_mut_ptr(),
                m as isize,
                1,
                adds,
                a.data().as_ptr(),
                m as isize,
                1,
                b.data().as_ptr(),
                k as isize,
                1,
                f32::from(u8::from(adds)),
                1.0,
                false,
                false,
                false,
                gemm::Parallelism::None,
            );
        },
        Library::Loops => {
            if !adds {
                out.fill(0.0);
            }
            multiply_add(a, b, out);
        }
        // SAFETY: as above.
        Library::MatrixMultiply => unsafe {
            matrixmultiply::sgemm(
                m,
                k,
                n,
                1.0,
                a.data().as_ptr(),
                1,
                m as isize,
                b.data().as_ptr(),
                1,
                k as isize,
                f32::from(u8::from(adds)),
                out.as_mut_ptr(),
                1,
                m as isize,
            );
        },
    }
}

/// Relative difference in the Euclidean norm.
pub fn difference(found: &[f32], expected: &[f32]) -> f64 {
    let widen = |values: &[f32]| values.iter().map(|&x| f64::from(x)).collect::<Vec<_>>();
    mrt_core::reference::error_measure::rel_l2(&widen(found), &widen(expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_libraries_compute_and_add_products() {
        let a = Matrix::from_fn(5, 40, |i, j| ((i * j) % 11) as f32 - 4.0);
        let b = Matrix::from_fn(40, 3, |i, j| ((i + j) % 5) as f32);
        let once = multiply(a.view(), b.view());
        for library in Library::ALL {
            let mut out = vec![f32::NAN; 15];
            product(library, a.view(), b.view(), &mut out, Sum::New);
            assert!(difference(&out, once.data()) < 1e-6, "{library:?}");
            product(library, a.view(), b.view(), &mut out, Sum::Add);
            let twice: Vec<f32> = once.data().iter().map(|x| 2.0 * x).collect();
            assert!(difference(&out, &twice) < 1e-6, "{library:?}");
        }
        let mut libraries = Libraries::default();
        assert!(libraries.fastest(a.view(), 3).is_ok());
    }
}
