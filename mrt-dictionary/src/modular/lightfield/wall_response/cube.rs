//! What a lightfield does to the walls and the probes of the canonical receiver (Loos et al. 2011, section 5.1).

use crate::matrix_parts::{from_row_groups, stack};
use crate::modular::lightfield::grid::LightfieldGrid;
use crate::modular::lightfield::transfer::{add_interpolated, radiance_by_sample};
use crate::modular::outputs::polygon_light::{SH9, sh_of_unit_radiosity};
use crate::modular::outputs::probe_samples::{PROBE_WEIGHT, ProbeSamples};
use crate::modular::paths::ends::RECEIVER;
use crate::modular::surface::output_grid::OutputGrid;
use crate::modular::surface::probes::probe_points;
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::geometry::polygon_moments::polygon_moments;
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Cells along each axis into which the interface is cut to light the walls.
const RESPONSE_CELLS: usize = 24;
/// Cells nearer to the receiving point than this number of cell widths are cut once more.
const NEAR_CELLS: f64 = 4.0;
/// Parts along each axis of a near cell.
const NEAR_PARTS: usize = 4;

/// Irradiance on the receiver's texels, then weighted samples of its probes, from lightfields (flux-weighted, samples x
/// modes) that enter at z = 0.
///
/// Each cell of the interface counts with its exact form factor, or with its exact moments at a probe, and with the
/// radiance that the lightfield has from the cell's centre towards the receiver.
pub fn wall_response(
    grid: &LightfieldGrid,
    lightfields: &Matrix<f64>,
    outputs: &OutputGrid,
) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, lightfields);
    let modes = lightfields.columns();
    let texels: Vec<(Face, DVec3)> = RECEIVER.texels(outputs.resolution).collect();
    let walls: Vec<Vec<f64>> = texels
        .par_iter()
        .map(|&(face, point)| {
            let mut row = vec![0.0; modes];
            for_each_cell(point, |cell| {
                let factor = point_to_polygon(point, -face.outward(), &cell.corners);
                let taps = grid.taps(cell.center, cell.direction);
                add_interpolated(&by_sample, &taps, PI * factor, &mut row);
            });
            row
        })
        .collect();
    let points: Vec<DVec3> = probe_points(outputs.probes).collect();
    let probes: Vec<Vec<f64>> = points
        .par_iter()
        .map(|&point| {
            let mut rows = vec![0.0; SH9 * modes];
            for_each_cell(point, |cell| {
                let sh = sh_of_unit_radiosity(&polygon_moments(point, &cell.corners));
                let taps = grid.taps(cell.center, cell.direction);
                for (row, weight) in rows.chunks_exact_mut(modes).zip(sh) {
                    add_interpolated(&by_sample, &taps, PI * weight, row);
                }
            });
            rows
        })
        .collect();
    let probes = from_row_groups(&probes, SH9, modes);
    stack(&[
        &from_row_groups(&walls, 1, modes),
        &ProbeSamples::default().from_sh(&probes, PROBE_WEIGHT),
    ])
}

/// A square part of the interface, as a point behind the interface sees it.
struct Cell {
    corners: [DVec3; 4],
    center: DVec2,
    /// From its centre to the point.
    direction: DVec3,
}

/// Cuts the interface into cells, finer near a point behind it.
fn for_each_cell(point: DVec3, mut visit: impl FnMut(&Cell)) {
    let cell = 1.0 / RESPONSE_CELLS as f64;
    for j in 0..RESPONSE_CELLS {
        for i in 0..RESPONSE_CELLS {
            let low = DVec2::new(i as f64, j as f64) * cell;
            let center = (low + 0.5 * cell).extend(0.0);
            let parts = if center.distance(point) < NEAR_CELLS * cell {
                NEAR_PARTS
            } else {
                1
            };
            let width = cell / parts as f64;
            for k in 0..parts * parts {
                let step = DVec2::new((k % parts) as f64, (k / parts) as f64);
                let low = low + step * width;
                let center = low + 0.5 * width;
                visit(&Cell {
                    corners: Face::NegZ.rectangle([low.x, low.x + width], [low.y, low.y + width]),
                    center,
                    direction: (point - center.extend(0.0)).normalize(),
                });
            }
        }
    }
}
