//! The one-bounce operator F between the walls of one warped block, in closed form (Loos et al. 2011,
//! equation 1, on the warped shapes of section 6.2 and figure 12).
//!
//! A receiver is the image of a texel's centre, a source the loop through the images of a texel's four
//! corners. Lambert's formula needs only that loop, planar or not: grid lines of a trilinear face
//! are straight, so neighbouring loops share their edges and leave no gap. Loops that face away from
//! the receiver send it nothing.
//!
//! This is exact for affine warps, whose images are convex. Bent faces may hide parts of the block from
//! each other, and that is neglected: behind every hidden wall stands the wall that hides it, so such a
//! receiver finds more than a whole hemisphere of walls. The row is scaled down by that excess, which keeps
//! a closed block from gaining energy and makes the error three times smaller. The error that is left is 0.3 % of the
//! first bounce where corners move by 0.3, and 0.6 and 1.9 % for towers twisted by 45 and 70 degrees
//! (`tests/tests/modular/warped/bent.rs`).

use crate::modular::one_bounce::orbits::{from_orbit_rows, orbit_receivers};
use crate::modular::surface::mirrors::warped::warped_parity_classes;
use crate::modular::surface::walls::warped::WarpedWalls;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon};
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Fraction of a block's diagonal by which a face may miss its plane and still count as planar.
const PLANAR_TOLERANCE: f64 = 1e-9;

/// F of warped walls, texels x texels.
///
/// Cost: one polygon evaluation for each pair of texels, spread over the threads and divided by the number of the
/// block's own symmetries that are used. A closed block without symmetry takes 0.25 s at 16² on two cores.
pub fn warped_bounce(walls: &WarpedWalls) -> Matrix<f64> {
    let classes = warped_parity_classes(walls);
    let rows = warped_bounce_rows(walls, &orbit_receivers(&classes));
    from_orbit_rows(&classes, &rows)
}

/// Rows of F, one for each of the given receiving texels: the factors from all texels to it.
pub fn warped_bounce_rows(walls: &WarpedWalls, receivers: &[usize]) -> Vec<Vec<f64>> {
    let grids: Vec<FaceGrid> = Face::ALL
        .into_iter()
        .map(|face| FaceGrid::new(face, walls))
        .collect();
    receivers
        .par_iter()
        .map_init(Scratch::default, |scratch, &texel| {
            receiver_row(walls, &grids, texel, scratch)
        })
        .collect()
}

/// Factors from all texels to one. Faces that are openings are evaluated too, for the excess over a hemisphere.
fn receiver_row(
    walls: &WarpedWalls,
    grids: &[FaceGrid],
    texel: usize,
    scratch: &mut Scratch,
) -> Vec<f64> {
    let per_face = walls.resolution * walls.resolution;
    let own_face = walls.faces[texel / per_face];
    let receiver = Receiver {
        point: walls.centers[texel],
        normal: walls.normals[texel],
    };
    let mut row = vec![0.0; walls.texel_count()];
    let mut behind_openings = vec![0.0; per_face];
    let mut total = 0.0;
    for grid in grids {
        let wall = walls.faces.iter().position(|&face| face == grid.face);
        let out = match wall {
            Some(wall) => &mut row[wall * per_face..][..per_face],
            None => behind_openings.as_mut_slice(),
        };
        if grid.face != own_face {
            grid.factors(&receiver, scratch, out);
        } else if !grid.is_planar {
            grid.factors(&receiver, scratch, out);
            // Its own loop runs around the point, where Lambert's formula has no meaning.
            out[texel % per_face] = 0.0;
        }
        total += out.iter().sum::<f64>();
    }
    if total > 1.0 && grids.iter().any(|grid| !grid.is_planar) {
        row.iter_mut().for_each(|factor| *factor /= total);
    }
    row
}

/// The point that light arrives at, and the normal of its wall into the block.
struct Receiver {
    point: DVec3,
    normal: DVec3,
}

/// Buffers that one receiver after another uses.
#[derive(Default)]
struct Scratch {
    /// Corners of one face's texels, relative to the receiver.
    corners: Vec<DVec3>,
    /// Lambert's terms of the edges along u.
    along_u: Vec<f64>,
    /// Lambert's terms of the edges along v.
    along_v: Vec<f64>,
    polygon: Vec<DVec3>,
    clipped: Vec<DVec3>,
}

/// Images of the corners of all texels of a face.
struct FaceGrid {
    face: Face,
    is_planar: bool,
    /// Lambert's sum of a loop that faces the receiver, times this, is the form factor: positive.
    scale: f64,
    resolution: usize,
    /// (resolution + 1)² corners, row by row.
    corners: Vec<DVec3>,
}

impl FaceGrid {
    fn new(face: Face, walls: &WarpedWalls) -> Self {
        let lines = walls.resolution + 1;
        let along = |k: usize| k as f64 / walls.resolution as f64;
        let corners = (0..lines * lines).map(|k| {
            let unit = face.point(along(k % lines), along(k / lines));
            walls.warp.point(unit)
        });
        let [a, b, c, d] = walls.warp.face_corners(face);
        let normal = (c - a).cross(d - b).normalize();
        let [u, v] = [face.u_axis(), face.v_axis()].map(|axis| DVec3::AXES[axis]);
        // Seen from inside, a loop that runs around the outward direction runs clockwise.
        let facing = u.cross(v).dot(face.outward());
        Self {
            face,
            is_planar: (b - a).dot(normal).abs() <= PLANAR_TOLERANCE * walls.warp.diagonal(),
            scale: facing * (0.5 / PI),
            resolution: walls.resolution,
            corners: corners.collect(),
        }
    }

    /// Writes the form factor of each texel.
    fn factors(&self, receiver: &Receiver, scratch: &mut Scratch, out: &mut [f64]) {
        let corners = self.corners.iter().map(|&corner| corner - receiver.point);
        scratch.corners.clear();
        scratch.corners.extend(corners);
        let is_below = |corner: &DVec3| corner.dot(receiver.normal) < 0.0;
        if scratch.corners.iter().any(is_below) {
            self.clipped_factors(receiver.normal, scratch, out);
        } else {
            self.factors_by_edges(receiver.normal, scratch, out);
        }
    }

    /// Where the receiver's horizon cuts the face: each texel is clipped to what is above it.
    fn clipped_factors(&self, normal: DVec3, scratch: &mut Scratch, out: &mut [f64]) {
        let (resolution, lines) = (self.resolution, self.resolution + 1);
        let horizon = HalfSpace {
            normal,
            offset: 0.0,
        };
        for (k, factor) in out.iter_mut().enumerate() {
            let low = k / resolution * lines + k % resolution;
            let corners = [low, low + 1, low + lines + 1, low + lines];
            scratch.polygon.clear();
            let polygon = corners.map(|k| scratch.corners[k]);
            scratch.polygon.extend(polygon);
            clip_polygon(&mut scratch.polygon, &horizon, &mut scratch.clipped);
            *factor = (loop_sum(&scratch.polygon, normal) * self.scale).max(0.0);
        }
    }

    /// Where the whole face is above the horizon: every edge is evaluated once for the two texels that share it.
    fn factors_by_edges(&self, normal: DVec3, scratch: &mut Scratch, out: &mut [f64]) {
        let (resolution, lines) = (self.resolution, self.resolution + 1);
        let corners = &scratch.corners;
        let (along_u, along_v) = (&mut scratch.along_u, &mut scratch.along_v);
        along_u.clear();
        along_v.clear();
        for j in 0..lines {
            for i in 0..resolution {
                let from = j * lines + i;
                along_u.push(edge_term(corners[from], corners[from + 1], normal));
            }
        }
        for from in 0..resolution * lines {
            along_v.push(edge_term(corners[from], corners[from + lines], normal));
        }
        for (k, factor) in out.iter_mut().enumerate() {
            let (j, i) = (k / resolution, k % resolution);
            let sum = along_u[k] + along_v[j * lines + i + 1]
                - along_u[k + resolution]
                - along_v[j * lines + i];
            *factor = (sum * self.scale).max(0.0);
        }
    }
}

/// Lambert's sum over a loop, with its sign; corners are relative to the receiver.
fn loop_sum(polygon: &[DVec3], normal: DVec3) -> f64 {
    let ends = polygon.iter().skip(1).chain(polygon.first());
    polygon
        .iter()
        .zip(ends)
        .map(|(&from, &to)| edge_term(from, to, normal))
        .sum()
}

/// The angle that an edge subtends times the part along `normal` of the unit normal of the plane through
/// it and the receiver.
fn edge_term(from: DVec3, to: DVec3, normal: DVec3) -> f64 {
    let across = from.cross(to);
    let sine = across.length();
    // An edge that the receiver lies in line with subtends no area.
    if sine > 0.0 {
        libm::atan2(sine, from.dot(to)) * across.dot(normal) / sine
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
    use crate::progress::Progress;
    use glam::DMat3;
    use mrt_core::geometry::hexahedron::Hexahedron;

    fn sheared() -> Hexahedron {
        let shear = DMat3::from_cols(
            DVec3::new(1.0, 0.0, 0.0),
            DVec3::new(0.5, 1.2, 0.1),
            DVec3::new(-0.2, 0.3, 3.0),
        );
        Hexahedron {
            corners: std::array::from_fn(|k| shear * Hexahedron::unit_corner(k)),
        }
    }

    /// Corners moved by at most 0.2 along each axis.
    fn bent() -> Hexahedron {
        Hexahedron {
            corners: std::array::from_fn(|k| {
                let moved = |axis: usize| ((7 * k + 3 * axis + k * axis) % 5) as f64 * 0.1 - 0.2;
                Hexahedron::unit_corner(k) + DVec3::new(moved(0), moved(1), moved(2))
            }),
        }
    }

    fn row_sum(bounce: &Matrix<f64>, i: usize) -> f64 {
        (0..bounce.columns()).map(|j| bounce[(i, j)]).sum()
    }

    #[test]
    fn an_unwarped_block_has_the_operator_of_the_cube() {
        let cube = closed_cube_bounce(5, Reconstruction::Constant, &Progress::silent())
            .expect("nobody cancels");
        let walls = WarpedWalls::new(&Face::ALL, 5, &Hexahedron::cell(DVec3::ZERO));
        for (a, b) in warped_bounce(&walls).data().iter().zip(cube.data()) {
            // Shared edges cancel in another order: roundings of angles of order one.
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
    }

    #[test]
    fn affine_images_gather_all_light_and_respect_reciprocity() {
        let walls = WarpedWalls::new(&Face::ALL, 12, &sheared());
        let bounce = warped_bounce(&walls);
        let mut exchanged = [[0.0; 6]; 6];
        for i in 0..bounce.rows() {
            // Sums of 5 * 144 factors.
            assert!((row_sum(&bounce, i) - 1.0).abs() < 1e-12);
            for j in 0..bounce.columns() {
                exchanged[i / 144][j / 144] += walls.areas[i] * bounce[(i, j)];
            }
        }
        for (a, b) in (0..6).flat_map(|a| (0..a).map(move |b| (a, b))) {
            let [there, back] = [exchanged[a][b], exchanged[b][a]];
            // Exact between areas. Here a receiver is a point, which texels that meet at an edge notice.
            assert!((there / back - 1.0).abs() < 0.02, "{there} {back}");
        }
    }

    #[test]
    fn openings_take_what_the_walls_do_not_send() {
        let all = WarpedWalls::new(&Face::ALL, 6, &sheared());
        let closed = warped_bounce(&all);
        let faces = [Face::NegX, Face::NegY, Face::PosY, Face::PosZ];
        let open = WarpedWalls::new(&faces, 6, &sheared());
        let kept: Vec<usize> = faces
            .iter()
            .flat_map(|face| face.index() * 36..(face.index() + 1) * 36)
            .collect();
        let bounce = warped_bounce(&open);
        for (i, &row) in kept.iter().enumerate() {
            let to_openings: f64 = (0..216)
                .filter(|column| !kept.contains(column))
                .map(|column| closed[(row, column)])
                .sum();
            assert!((row_sum(&bounce, i) + to_openings - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn bent_blocks_gain_no_energy_and_lose_little() {
        let walls = WarpedWalls::new(&Face::ALL, 8, &bent());
        assert_eq!(walls.warp.check(), Ok(()));
        let bounce = warped_bounce(&walls);
        for i in 0..bounce.rows() {
            let sum = row_sum(&bounce, i);
            // The receiver's own texel is missing, and what its horizon cuts of its neighbours.
            assert!(sum < 1.0 + 1e-12 && sum > 0.97, "row {i}: {sum}");
        }
    }
}
