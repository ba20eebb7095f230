//! The fastest library of dense products for each shape: each shape is timed once with each library, whose product is
//! compared with the reference.

use super::timing::fastest;
use crate::dense_product::{Library, Output, difference, product};
use mrt_core::linalg::matrix::{Matrix, MatrixView, multiply};
use std::collections::HashMap;
use std::time::Duration;

/// Rows, inner size and columns of a product.
type Size = [usize; 3];

/// Time to find the fastest library for one size.
const BUDGET: Duration = Duration::from_millis(4);

/// Relative difference from the reference above which a product is wrong: sums of thousands of `f32` differ by 1e-6.
const TOLERANCE: f64 = 1e-4;

/// A library computes something else than the product.
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
    /// The fastest library for products of `a` and a matrix of this number of columns.
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
            let mut multiply = || product(library, a, b.view(), &mut out, Output::Replace);
            multiply();
            let time = fastest(BUDGET, multiply);
            let found = difference(&out, expected.data());
            if found.is_nan() || found > TOLERANCE {
                return Err(WrongProduct {
                    library: library.name(),
                    size,
                    found,
                });
            }
            best = if time < best.0 { (time, library) } else { best };
        }
        self.0.insert(size, best.1);
        Ok(best.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_keeps_its_library() {
        let a = Matrix::from_fn(5, 40, |i, j| ((i * j) % 11) as f32 - 4.0);
        let mut libraries = Libraries::default();
        let first = libraries.fastest(a.view(), 3);
        assert!(first.is_ok());
        assert_eq!(libraries.fastest(a.view(), 3), first);
    }
}
