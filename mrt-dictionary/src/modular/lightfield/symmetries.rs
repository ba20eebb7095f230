//! What the symmetries of an opening make of lightfields (samples x modes). All of them are exact: they exchange samples.

use crate::modular::lightfield::grid::{LightfieldGrid, SamplePlace};
use mrt_core::linalg::matrix::Matrix;

/// Lightfields with u and v exchanged.
pub fn exchanged(grid: &LightfieldGrid, fields: &Matrix<f64>) -> Matrix<f64> {
    with_sources(grid, fields, |place| SamplePlace {
        u: place.v,
        v: place.u,
        x: place.y,
        y: place.x,
    })
}

/// Lightfields mirrored in u.
pub fn mirrored(grid: &LightfieldGrid, fields: &Matrix<f64>) -> Matrix<f64> {
    with_sources(grid, fields, |place| grid.mirrored_u(place))
}

/// Lightfields turned by a quarter about their heading: what was on the left (+u) goes up (+v).
///
/// Bends that lead up and down are the bend to the side between two such rolls.
pub fn rolled(grid: &LightfieldGrid, fields: &Matrix<f64>) -> Matrix<f64> {
    // What is at (u, v) afterwards was at (v, -u).
    with_sources(grid, fields, |place| {
        grid.mirrored_v(SamplePlace {
            u: place.v,
            v: place.u,
            x: place.y,
            y: place.x,
        })
    })
}

/// Lightfields in which each sample has the value that its source had.
fn with_sources(
    grid: &LightfieldGrid,
    fields: &Matrix<f64>,
    source: impl Fn(SamplePlace) -> SamplePlace,
) -> Matrix<f64> {
    let rows: Vec<usize> = (0..grid.sample_count())
        .map(|sample| grid.sample(source(grid.place(sample))))
        .collect();
    fields.selected_rows(&rows)
}
