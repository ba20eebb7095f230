//! Operators that respect the mirrors of a point set, from one row an orbit.

use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;

/// The first point of each orbit: the receivers whose rows [`from_orbit_rows`] asks for.
pub fn orbit_receivers(classes: &ParityClasses) -> Vec<usize> {
    classes.orbits().map(|orbit| orbit[0].0 as usize).collect()
}

/// The whole operator, points x points. The rows of the other points of an orbit are permutations of the given row of
/// its first point.
pub fn from_orbit_rows(classes: &ParityClasses, rows: &[Vec<f64>]) -> Matrix<f64> {
    let points = classes.point_count();
    let mut operator = Matrix::zeros(points, points);
    for (orbit, row) in classes.orbits().zip(rows) {
        for &(receiver, element) in orbit {
            for (source, &factor) in row.iter().enumerate() {
                let image = classes.image(element, source as u32);
                operator[(receiver as usize, image as usize)] = factor;
            }
        }
    }
    operator
}
