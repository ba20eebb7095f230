//! Dense products by several libraries, all called in the same way.

#![allow(
    unsafe_code,
    reason = "both libraries take pointers; lengths are checked before each call"
)]

use mrt_core::linalg::matrix::{MatrixView, multiply_add};

/// A library of dense products.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Library {
    /// The crate `gemm`.
    Gemm,
    /// The crate `matrixmultiply`.
    MatrixMultiply,
    /// The reference's own loops, which are faster than both where products are tiny.
    Loops,
}

impl Library {
    /// All libraries.
    pub const ALL: [Library; 3] = [Library::Gemm, Library::MatrixMultiply, Library::Loops];

    /// Name of the crate, or "loops".
    pub fn name(self) -> &'static str {
        match self {
            Library::Gemm => "gemm",
            Library::MatrixMultiply => "matrixmultiply",
            Library::Loops => "loops",
        }
    }
}

/// What a product does to the numbers that its output holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// They are overwritten.
    Replace,
    /// The product is added to them.
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
    output: Output,
) {
    let (m, k, n) = (a.rows(), a.columns(), b.columns());
    assert_eq!(k, b.rows(), "inner size");
    assert_eq!(a.data().len(), m * k, "first factor");
    assert_eq!(b.data().len(), k * n, "second factor");
    assert_eq!(out.len(), m * n, "product");
    match library {
        Library::Gemm => by_gemm(a, b, out, output),
        Library::MatrixMultiply => by_matrixmultiply(a, b, out, output),
        Library::Loops => {
            if output == Output::Replace {
                out.fill(0.0);
            }
            multiply_add(a, b, out);
        }
    }
}

/// [`product`] with sizes that fit.
fn by_gemm(a: MatrixView<f32>, b: MatrixView<f32>, out: &mut [f32], output: Output) {
    let (m, k, n) = (a.rows(), a.columns(), b.columns());
    let adds = output == Output::Add;
    // SAFETY: the three slices hold m x k, k x n and m x n numbers, and the strides stay inside them.
    unsafe {
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
    }
}

/// [`product`] with sizes that fit.
fn by_matrixmultiply(a: MatrixView<f32>, b: MatrixView<f32>, out: &mut [f32], output: Output) {
    let (m, k, n) = (a.rows(), a.columns(), b.columns());
    let adds = output == Output::Add;
    // SAFETY: the three slices hold m x k, k x n and m x n numbers, and the strides stay inside them.
    unsafe {
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
    use mrt_core::linalg::matrix::{Matrix, multiply};

    #[test]
    fn all_libraries_compute_and_add_products() {
        let a = Matrix::from_fn(5, 40, |i, j| ((i * j) % 11) as f32 - 4.0);
        let b = Matrix::from_fn(40, 3, |i, j| ((i + j) % 5) as f32);
        let once = multiply(a.view(), b.view());
        for library in Library::ALL {
            let mut out = vec![f32::NAN; 15];
            product(library, a.view(), b.view(), &mut out, Output::Replace);
            assert!(difference(&out, once.data()) < 1e-6, "{library:?}");
            product(library, a.view(), b.view(), &mut out, Output::Add);
            let twice: Vec<f32> = once.data().iter().map(|x| 2.0 * x).collect();
            assert!(difference(&out, &twice) < 1e-6, "{library:?}");
        }
    }
}
