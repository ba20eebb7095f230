//! What a lightfield does to the walls of the tube that it enters (Loos et al. 2011, section 5.1).
//!
//! Each tube answers with its own texels, so there is one response operator for each shape and opening. As in
//! [`crate::modular::lightfield::wall_response::cube`], each cell of the interface counts with its form factor and the
//! radiance that the lightfield has from the cell's centre towards the texel. Here cells are cut off at the texel's
//! horizon, and in a bend they count if the texel sees their centre.

use crate::modular::lightfield::grid::{LightfieldGrid, turn_to_heading};
use crate::modular::lightfield::interface::tube::point_of_uv;
use crate::modular::lightfield::transfer::{add_interpolated, radiance_by_sample};
use crate::modular::surface::area_weights::AreaWeights;
use crate::modular::surface::mirrors::tube::tube_entry_parity_classes;
use crate::modular::surface::walls::tube::TubeWall;
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
use mrt_core::geometry::tube::{SurfacePoint, TUBE_RADIUS, TubeForm};
use mrt_core::linalg::matrix::{Matrix, transpose_multiply};
use mrt_core::linalg::parity_modes::{ModeChoice, ParityBasis};
use mrt_core::linalg::svd::{Svd, svd};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Cells along each axis of the square into which the disc is cut to light the walls.
const RESPONSE_CELLS: usize = 24;
/// Cells nearer to the texel than this number of cell widths are cut once more.
const NEAR_CELLS: f64 = 4.0;
/// Parts along each axis of a near cell.
const NEAR_PARTS: usize = 4;

/// Irradiance at a tube's texel centres, texels x modes, from lightfields (flux-weighted, samples x modes) that
/// enter at one opening.
///
/// Cost: some 10³ cells a texel, 16 products a cell and mode; 1.4 s for an opening at 32² texels a chart
/// and 128 modes on two cores.
pub fn tube_wall_response(
    grid: &LightfieldGrid,
    lightfields: &Matrix<f64>,
    wall: &TubeWall,
    opening: Face,
) -> Matrix<f64> {
    let by_sample = radiance_by_sample(grid, lightfields);
    let modes = lightfields.columns();
    let cells = DiscCells::new(opening);
    let frame = turn_to_heading(opening.opposite()).inverse();
    let rows: Vec<Vec<f64>> = wall
        .texels
        .par_iter()
        .map(|texel| {
            let at = &texel.center;
            let mut row = vec![0.0; modes];
            let mut clip = Clip::default();
            cells.for_each(at.position, |cell| {
                let factor = clip.visible_factor(wall.form, at, cell);
                if factor > 0.0 {
                    let direction = (at.position - cell.center).normalize();
                    let taps = grid.taps(cell.uv, frame.direction(direction));
                    add_interpolated(&by_sample, &taps, PI * factor, &mut row);
                }
            });
            row
        })
        .collect();
    Matrix::from_fn(rows.len(), modes, |i, j| rows[i][j])
}

/// The disc of an opening in cells of two sizes.
struct DiscCells {
    /// `RESPONSE_CELLS`² cells.
    coarse: Vec<DiscCell>,
    /// `NEAR_PARTS`² for each coarse cell.
    fine: Vec<DiscCell>,
}

impl DiscCells {
    fn new(opening: Face) -> Self {
        Self {
            coarse: disc_cells(opening, RESPONSE_CELLS),
            fine: disc_cells(opening, RESPONSE_CELLS * NEAR_PARTS),
        }
    }

    /// Visits all cells, fine ones near a point.
    fn for_each(&self, point: DVec3, mut visit: impl FnMut(&DiscCell)) {
        let width = 2.0 * TUBE_RADIUS / RESPONSE_CELLS as f64;
        for (k, cell) in self.coarse.iter().enumerate() {
            if cell.center.distance(point) >= NEAR_CELLS * width {
                visit(cell);
                continue;
            }
            let (j, i) = (k / RESPONSE_CELLS, k % RESPONSE_CELLS);
            for part in 0..NEAR_PARTS * NEAR_PARTS {
                let j = j * NEAR_PARTS + part / NEAR_PARTS;
                let i = i * NEAR_PARTS + part % NEAR_PARTS;
                visit(&self.fine[j * RESPONSE_CELLS * NEAR_PARTS + i]);
            }
        }
    }
}

/// A part of an opening, in the tube's coordinates.
struct DiscCell {
    corners: [DVec3; 4],
    center: DVec3,
    /// (u, v) of the centre in the frame of light that enters.
    uv: DVec2,
    /// Area of the cell, whose outer edges may be arcs, divided by the area of the quadrilateral of its corners.
    area_ratio: f64,
}

/// The disc of an opening in `n`² cells of equal area, row by row.
fn disc_cells(opening: Face, n: usize) -> Vec<DiscCell> {
    let frame = turn_to_heading(opening.opposite());
    let at = |u: f64, v: f64| {
        let uv = DVec2::new(u, v) / n as f64;
        (uv, frame.point(point_of_uv(uv).extend(0.0)))
    };
    (0..n * n)
        .map(|k| {
            let (i, j) = ((k % n) as f64, (k / n) as f64);
            let corners =
                [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| at(i + u, j + v).1);
            let diagonals = [corners[2] - corners[0], corners[3] - corners[1]];
            let area = 0.5 * diagonals[0].cross(diagonals[1]).length();
            let (uv, center) = at(i + 0.5, j + 0.5);
            DiscCell {
                corners,
                center,
                uv,
                area_ratio: PI * TUBE_RADIUS * TUBE_RADIUS / ((n * n) as f64 * area),
            }
        })
        .collect()
}

/// Buffers for clipping cells.
#[derive(Default)]
struct Clip {
    polygon: Vec<DVec3>,
    scratch: Vec<DVec3>,
}

impl Clip {
    /// Form factor of what a point of the wall sees of a cell.
    fn visible_factor(&mut self, form: TubeForm, at: &SurfacePoint, cell: &DiscCell) -> f64 {
        let horizon = HalfSpace::through(at.position, at.normal);
        let above = cell.corners.map(|corner| horizon.side(corner) >= 0.0);
        if above == [false; 4] || !form.segment_is_free(at.position, cell.center) {
            return 0.0;
        }
        self.polygon.clear();
        self.polygon.extend(cell.corners);
        if above != [true; 4] {
            clip_polygon(&mut self.polygon, &horizon, &mut self.scratch);
        }
        point_to_polygon(at.position, at.normal, &self.polygon) * cell.area_ratio
    }
}

/// `T_rlf->r` and `U_r` of one tube for light that enters at one opening.
#[derive(Clone, Debug)]
pub struct TubeResponse {
    /// Response modes x lightfield modes.
    pub response_from_lightfield: Matrix<f64>,
    /// Texels x response modes: columns orthonormal under the areas of the texels over their mean.
    pub response_basis: Matrix<f64>,
    /// All singular values of the response, largest first.
    pub singular_values: Vec<f64>,
    /// Fraction that the modes left out hold of the response's energy beyond its first mode.
    pub dropped_energy: f64,
}

/// Decomposes the response of a tube to the lightfield basis at one opening, in the measure of area, and keeps at most
/// `modes` modes.
pub fn tube_response(
    grid: &LightfieldGrid,
    basis: &ParityBasis,
    wall: &TubeWall,
    opening: Face,
    modes: usize,
) -> TubeResponse {
    let weights = AreaWeights::of_tube(wall);
    let response = tube_wall_response(grid, &basis.vectors, wall, opening);
    let response = weights.weigh(&response);
    let scaled = response.scaled_columns(&basis.scales);
    let classes = tube_entry_parity_classes(wall);
    let parts: Vec<Svd> = (0..classes.class_count())
        .map(|class| svd(classes.fold_columns(class, &scaled).view()))
        .collect();
    let values = parts.iter().map(|part| &part.singular_values[..]);
    let choice = ModeChoice::largest(values, modes);
    let vectors = choice
        .basis(&classes, |mode| {
            parts[mode.class].u.column(mode.position).to_vec()
        })
        .vectors;
    TubeResponse {
        response_from_lightfield: transpose_multiply(vectors.view(), response.view()),
        response_basis: weights.unweigh(&vectors),
        dropped_energy: choice.dropped_energy(),
        singular_values: choice.singular_values,
    }
}
