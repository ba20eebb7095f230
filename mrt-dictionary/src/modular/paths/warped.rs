//! Light through the openings of a warped block, in the terms of the canonical ones.
//!
//! The operators between openings are those of unit cubes. What passes an opening is a lightfield, and that of a
//! long block differs from a cube's: its walls end further away, and a far wall sees less of the opening. The paper
//! scales the canonical operators with the block and leaves it at that. Here both ends are corrected, from the
//! middle of the opening, in coordinates in which the opening is the unit square and depth has the scale of its area:
//!
//! - light that leaves is the radiosity of a unit cube behind the opening that looks the same from there;
//! - light that enters falls on a wall where a ray from there would go on to the wall of a unit cube, times the
//!   form factor of the opening on the true wall over that on the cube's.
//!
//! Both are exact for cubes of any size and angle, and give even light its true level for every warp. In a dead end
//! four times as long as wide behind a cube they leave 7 % of error where scaled operators err by 135. Light that passes
//! *through* a warped block is corrected as a level is assembled (`mrt-runtime/src/propagate/transit.rs`).

use crate::modular::joint::{ForeignLight, response_at};
use crate::modular::one_bounce::cube::wall_fraction;
use crate::modular::one_bounce::warped::WarpedWalls;
use crate::modular::outputs::cube::{DIRECTIONS, PROBE_WEIGHT, ProbeSamples, SH9, probe_points};
use crate::modular::paths::emission::opening_frame;
use crate::modular::paths::response::{ResponseBasis, rows, stack};
use crate::modular::paths::transport::{EMITTER, RECEIVER};
use glam::{DMat3, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
use mrt_core::geometry::polar_decomposition::rotation_part;
use mrt_core::geometry::polygon_moments::polygon_moments;
use mrt_core::lighting::sh;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::Aperture;
use mrt_runtime::low_level::modular::path::frame_of_heading;
use rayon::prelude::*;

/// Rays along each axis of a texel of the canonical emitter.
const RAYS: usize = 3;

/// Halvings in search of the wall that a ray ends on: 1e-9 of the block.
const HALVINGS: usize = 32;

/// Steps of the polar decomposition. Ten reach rounding from a stretch of 1:100.
const POLAR_STEPS: usize = 16;

/// A view from the middle of an opening of a warped block.
pub struct OpeningView<'a> {
    shape: &'static Shape,
    walls: &'a WarpedWalls,
    aperture: &'static Aperture,
    /// Middle of the opening, in the unit cube and in the world.
    unit_eye: DVec3,
    eye: DVec3,
    /// From directions of the unit cube to those of the world.
    world: DMat3,
}

impl<'a> OpeningView<'a> {
    /// From an opening of a shape whose walls these are.
    pub fn new(shape: &'static Shape, walls: &'a WarpedWalls, aperture: &'static Aperture) -> Self {
        let face = aperture.face;
        let corners = aperture.corners();
        let unit_eye = corners.iter().copied().sum::<DVec3>() / corners.len() as f64;
        let jacobian = walls.warp.jacobian(unit_eye);
        let (u, v) = (jacobian.col(face.u_axis()), jacobian.col(face.v_axis()));
        let across = u.cross(v);
        let outwards = jacobian * face.outward();
        let depth = across.normalize() * across.length().sqrt();
        let mut world = DMat3::ZERO;
        *world.col_mut(face.u_axis()) = u;
        *world.col_mut(face.v_axis()) = v;
        let is_outward = (across.dot(outwards) > 0.0) == face.is_positive();
        *world.col_mut(face.axis()) = if is_outward { depth } else { -depth };
        Self {
            shape,
            walls,
            aperture,
            unit_eye,
            eye: walls.warp.point(unit_eye),
            world,
        }
    }

    /// Radiosity of the walls (texels x signals) as that of the canonical emitter behind the opening, in the frame of
    /// its heading or in that with x and y exchanged.
    pub fn emitter_radiosity(&self, is_exchanged: bool, radiosity: &Matrix<f64>) -> Matrix<f64> {
        let resolution = self.walls.resolution;
        let frame = opening_frame(self.aperture.face, is_exchanged);
        let texels: Vec<(Face, DVec3)> = EMITTER.texels(resolution).collect();
        let seen: Vec<Vec<(usize, f64)>> = texels
            .par_iter()
            .map(|&(face, center)| self.seen_behind(frame.face(face), frame.point(center)))
            .collect();
        Matrix::from_fn(seen.len(), radiosity.columns(), |i, j| {
            seen[i].iter().map(|&(k, w)| w * radiosity[(k, j)]).sum()
        })
    }

    /// The texels that are seen in place of one of the unit cube, with their weights.
    fn seen_behind(&self, face: Face, center: DVec3) -> Vec<(usize, f64)> {
        let resolution = self.walls.resolution;
        let step = 1.0 / (resolution * RAYS) as f64;
        let along = |k: usize| (k as f64 - 0.5 * (RAYS - 1) as f64) * step;
        let mut seen: Vec<(usize, f64)> = Vec::with_capacity(RAYS * RAYS);
        for k in 0..RAYS * RAYS {
            let mut target = center;
            target[face.u_axis()] += along(k % RAYS);
            target[face.v_axis()] += along(k / RAYS);
            let Some((wall, unit)) = self.end_of_ray(self.world * (target - self.unit_eye)) else {
                continue;
            };
            let Some(offset) = self.shape.wall_offset(wall, resolution) else {
                continue;
            };
            let index = wall.texel_index(unit, resolution);
            let center = wall.texel_center(resolution, index / resolution, index % resolution);
            let weight = wall_fraction(self.shape, wall, center, resolution);
            seen.push((offset + index, weight / (RAYS * RAYS) as f64));
        }
        seen
    }

    /// The face that a ray from the eye ends on, and where in the unit cube.
    fn end_of_ray(&self, direction: DVec3) -> Option<(Face, DVec3)> {
        let warp = &self.walls.warp;
        let inside = |s: f64| {
            warp.inverse(self.eye + direction * s)
                .filter(|unit| unit.cmpge(DVec3::ZERO).all() && unit.cmple(DVec3::ONE).all())
        };
        let (mut low, mut high) = (0.0, 2.0 * warp.diagonal() / direction.length());
        let mut end = None;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match inside(middle) {
                Some(unit) => (low, end) = (middle, Some(unit)),
                None => high = middle,
            }
        }
        let unit = end?;
        let distance = |face: &Face| {
            let x = unit[face.axis()];
            if face.is_positive() { 1.0 - x } else { x }
        };
        Face::ALL
            .into_iter()
            .filter(|&face| face != self.aperture.face)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .map(|face| (face, unit))
    }

    /// The response modes on the walls and at the probes, entering through the opening.
    ///
    /// `canonical_vector` is their vector irradiance on the canonical shape (4 texels x modes), or has no rows.
    pub fn response(
        &self,
        is_exchanged: bool,
        response: &ResponseBasis,
        probes: usize,
        canonical_vector: &Matrix<f64>,
    ) -> ForeignLight {
        let resolution = self.walls.resolution;
        let face = self.aperture.face;
        let mut frame = frame_of_heading(face.opposite());
        if is_exchanged {
            frame = frame.after(CubeSymmetry::exchange(0, 1));
        }
        let back = frame.inverse();
        let portal = self
            .aperture
            .corners()
            .into_iter()
            .map(|corner| self.walls.warp.point(corner))
            .collect::<Vec<_>>();
        let canonical = self.aperture.corners();
        let texels: Vec<(Face, DVec3)> = self.walls.unit_texels().collect();
        let received: Vec<Vec<(usize, f64)>> = (0..texels.len())
            .into_par_iter()
            .map(|texel| {
                let (wall, unit) = texels[texel];
                if self.shape.is_in_hole(wall, unit) {
                    return Vec::new();
                }
                let Some((there, point)) = self.wall_of_cube(self.walls.centers[texel]) else {
                    return Vec::new();
                };
                let factor = point_to_polygon(point, -there.outward(), &canonical);
                if factor < LEAST_FACTOR {
                    return Vec::new();
                }
                let normal = self.walls.normals[texel];
                let share = factor_above(self.walls.centers[texel], normal, &portal) / factor;
                bilinear(back.face(there), back.point(point), resolution)
                    .into_iter()
                    .map(|(row, weight)| (row, share * weight))
                    .collect()
            })
            .collect();
        let basis = &response.basis;
        let walls = Matrix::from_fn(received.len(), basis.columns(), |i, j| {
            received[i].iter().map(|&(k, w)| w * basis[(k, j)]).sum()
        });
        let at_cube = response_at(self.shape, face, is_exchanged, response, resolution, probes).0;
        let samples = rows(&at_cube, texels.len()..at_cube.rows());
        let shares: Vec<f64> = texels
            .iter()
            .zip(&self.walls.centers)
            .zip(&self.walls.normals)
            .map(|((&(wall, unit), &center), &normal)| {
                let factor = if wall == face {
                    0.0
                } else {
                    point_to_polygon(unit, -wall.outward(), &canonical)
                };
                if factor < LEAST_FACTOR {
                    0.0
                } else {
                    factor_above(center, normal, &portal) / factor
                }
            })
            .collect();
        ForeignLight {
            field: stack(&walls, &self.turned_probes(&samples, probes, &portal)),
            vector: Matrix::from_fn(
                canonical_vector.rows(),
                canonical_vector.columns(),
                |i, j| shares[i / 4] * canonical_vector[(i, j)],
            ),
        }
    }

    /// Samples of the cube's probes (26 a probe) with the opening's true solid angle, turned as the warp turns.
    fn turned_probes(&self, samples: &Matrix<f64>, probes: usize, portal: &[DVec3]) -> Matrix<f64> {
        let convert = ProbeSamples::default();
        let mut light = convert.to_sh(samples, PROBE_WEIGHT);
        let canonical = self.aperture.corners();
        let turns: Vec<(f64, Vec<Matrix<f64>>)> = probe_points(probes)
            .map(|unit| {
                let there = polygon_moments(unit, &canonical).solid_angle;
                let here = polygon_moments(self.walls.warp.point(unit), portal).solid_angle;
                let turn = rotation_part(&self.walls.warp.jacobian(unit), POLAR_STEPS);
                (here / there, sh::rotation_matrices(3, &turn))
            })
            .collect();
        let columns = light.columns();
        let per_column = turns.len() * SH9;
        for j in 0..columns {
            let column = &mut light.data_mut()[j * per_column..][..per_column];
            for (probe, (share, bands)) in column.chunks_exact_mut(SH9).zip(&turns) {
                probe.iter_mut().for_each(|x| *x *= share);
                sh::rotate(bands, probe);
            }
        }
        debug_assert_eq!(samples.rows(), turns.len() * DIRECTIONS.len());
        convert.from_sh(&light, PROBE_WEIGHT)
    }

    /// Where the ray from the eye through a point of the world meets the unit cube.
    fn wall_of_cube(&self, point: DVec3) -> Option<(Face, DVec3)> {
        let direction = self.world.inverse() * (point - self.eye);
        if direction.dot(self.aperture.face.outward()) >= 0.0 {
            return None;
        }
        let (face, reach) = Face::ALL
            .into_iter()
            .filter(|face| direction.dot(face.outward()) > 0.0)
            .map(|face| {
                let axis = face.axis();
                let wall = if face.is_positive() { 1.0 } else { 0.0 };
                (face, (wall - self.unit_eye[axis]) / direction[axis])
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut end = self.unit_eye + direction * reach;
        end[face.axis()] = if face.is_positive() { 1.0 } else { 0.0 };
        Some((face, end))
    }
}

/// Form factors below this are grazing, and quotients of them rounding.
const LEAST_FACTOR: f64 = 1e-9;

/// Form factor of a polygon, as far as it is above the point's horizon.
fn factor_above(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let mut polygon = polygon.to_vec();
    let horizon = HalfSpace::through(point, normal);
    clip_polygon(&mut polygon, &horizon, &mut Vec::new());
    point_to_polygon(point, normal, &polygon)
}

/// Rows of [`RECEIVER`] around a point of a wall, with bilinear weights; constant beyond the outermost centres.
fn bilinear(face: Face, point: DVec3, resolution: usize) -> Vec<(usize, f64)> {
    let Some(offset) = RECEIVER.wall_offset(face, resolution) else {
        return Vec::new();
    };
    let along = |axis: usize| {
        let last = resolution - 1;
        let x = (point[axis] * resolution as f64 - 0.5).clamp(0.0, last as f64);
        let low = (x.floor() as usize).min(last);
        (low, (low + 1).min(last), x - low as f64)
    };
    let (i, next_i, u) = along(face.u_axis());
    let (j, next_j, v) = along(face.v_axis());
    [
        (j, i, (1.0 - u) * (1.0 - v)),
        (j, next_i, u * (1.0 - v)),
        (next_j, i, (1.0 - u) * v),
        (next_j, next_i, u * v),
    ]
    .into_iter()
    .map(|(j, i, weight)| (offset + j * resolution + i, weight))
    .collect()
}
