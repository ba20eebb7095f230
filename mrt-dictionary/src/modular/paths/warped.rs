//! Light through the openings of a warped block, in the terms of the canonical ones.
//!
//! The operators between openings are those of unit cubes. But the lightfield at an opening of a long block differs from
//! that of a cube: the block's walls end further away, and a far wall sees less of the opening. The paper
//! scales the canonical operators with the block and does no more. Here both ends are corrected, as seen from the
//! middle of the opening, in coordinates in which the opening is the unit square and depth is scaled by the root of
//! its area:
//!
//! - light that leaves is the radiosity of a unit cube behind the opening that looks the same from there;
//! - light that enters falls on a wall where a ray from there would go on to the wall of a unit cube, times the
//!   form factor of the opening on the true wall over that on the cube's.
//!
//! Both are exact for cubes of any size and angle, and give even light its true level for every warp. In a dead end
//! four times as long as wide behind a cube they err by 7 % where scaled operators err by 135. Light that passes
//! *through* a warped block is corrected as a level is assembled (`propagate/transit.rs` in `mrt-runtime`).

use crate::matrix_parts::{rows, stack};
use crate::modular::outputs::polygon_light::SH9;
use crate::modular::outputs::probe_samples::{PROBE_WEIGHT, ProbeSamples};
use crate::modular::paths::arrival::{Arrival, ArrivingLight};
use crate::modular::paths::ends::{EMITTER, PathFrame, RECEIVER};
use crate::modular::paths::response::ResponseBasis;
use crate::modular::surface::probes::{DIRECTIONS, probe_points};
use crate::modular::surface::walls::cube::wall_fraction;
use crate::modular::surface::walls::warped::WarpedWalls;
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
use rayon::prelude::*;

/// Rays along each axis of a texel of the canonical emitter.
const RAYS: usize = 3;

/// Halvings in search of the wall that a ray ends on: 1e-9 of the block.
const HALVINGS: usize = 32;

/// Form factors below this are grazing, and quotients of them are rounding errors.
const LEAST_FACTOR: f64 = 1e-9;

/// Steps of the polar decomposition. Ten reach rounding from a stretch of 1:100.
const POLAR_STEPS: usize = 16;

/// A view from the middle of an opening of a warped block.
pub struct OpeningView<'a> {
    shape: &'static Shape,
    walls: &'a WarpedWalls,
    face: Face,
    /// Corners of the opening in the unit cube.
    unit_corners: Vec<DVec3>,
    /// Corners of the opening in the world.
    corners: Vec<DVec3>,
    /// Middle of the opening in the unit cube.
    unit_eye: DVec3,
    /// Middle of the opening in the world.
    eye: DVec3,
    /// From directions of the unit cube to those of the world.
    world: DMat3,
}

impl<'a> OpeningView<'a> {
    /// The view from an opening of a shape, whose walls these are.
    pub fn new(shape: &'static Shape, walls: &'a WarpedWalls, aperture: &'static Aperture) -> Self {
        let face = aperture.face;
        let unit_corners: Vec<DVec3> = aperture.corners().into_iter().collect();
        let unit_eye = unit_corners.iter().copied().sum::<DVec3>() / unit_corners.len() as f64;
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
            face,
            corners: unit_corners.iter().map(|&c| walls.warp.point(c)).collect(),
            unit_corners,
            unit_eye,
            eye: walls.warp.point(unit_eye),
            world,
        }
    }

    /// Radiosity of the walls (texels x signals) carried over to the texels of [`EMITTER`], which takes the place of the
    /// block behind the opening, in one of the frames there.
    pub fn emitter_radiosity(&self, frame: PathFrame, radiosity: &Matrix<f64>) -> Matrix<f64> {
        let resolution = self.walls.resolution;
        let frame = frame.of_heading(self.face);
        let texels: Vec<(Face, DVec3)> = EMITTER.texels(resolution).collect();
        let seen: Vec<Vec<(usize, f64)>> = texels
            .par_iter()
            .map(|&(face, center)| self.seen_behind(frame.face(face), frame.point(center)))
            .collect();
        weighted_rows(&seen, radiosity)
    }

    /// The texels, with weights, that are seen from the eye in place of a texel of the unit cube.
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

    /// The face that a ray from the eye ends on, and the end of the ray in the unit cube.
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
            .filter(|&face| face != self.face)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .map(|face| (face, unit))
    }

    /// The response modes on the walls and at the probes, entering through the opening in one of the frames there.
    ///
    /// `canonical_vector` is their vector irradiance on the canonical shape (4 texels x modes), or has no rows.
    pub fn arriving_light(
        &self,
        frame: PathFrame,
        response: &ResponseBasis,
        probes: usize,
        canonical_vector: &Matrix<f64>,
    ) -> ArrivingLight {
        let resolution = self.walls.resolution;
        let back = frame.of_heading(self.face.opposite()).inverse();
        let texels: Vec<(Face, DVec3)> = self.walls.unit_texels().collect();
        let received: Vec<Vec<(usize, f64)>> = (0..texels.len())
            .into_par_iter()
            .map(|texel| self.received(texel, texels[texel], back))
            .collect();
        let walls = weighted_rows(&received, &response.basis);
        let arrival = Arrival::new(self.shape, self.face, frame, resolution);
        let at_cube = arrival.outputs(response, probes);
        let samples = rows(&at_cube, texels.len()..at_cube.rows());
        let shares: Vec<f64> = texels
            .iter()
            .enumerate()
            .map(|(texel, &(wall, unit))| {
                if wall == self.face {
                    0.0
                } else {
                    self.share_of_cube(texel, wall, unit).unwrap_or(0.0)
                }
            })
            .collect();
        ArrivingLight {
            outputs: stack(&[&walls, &self.turned_probes(&samples, probes)]),
            vector: Matrix::from_fn(
                canonical_vector.rows(),
                canonical_vector.columns(),
                |i, j| shares[i / 4] * canonical_vector[(i, j)],
            ),
        }
    }

    /// The receiver's texels, with weights, whose light a texel gets. `back` leads from the shape's frame to the
    /// receiver's.
    fn received(
        &self,
        texel: usize,
        (wall, unit): (Face, DVec3),
        back: CubeSymmetry,
    ) -> Vec<(usize, f64)> {
        if self.shape.is_in_hole(wall, unit) {
            return Vec::new();
        }
        let Some((face, point)) = self.wall_of_cube(self.walls.centers[texel]) else {
            return Vec::new();
        };
        let Some(share) = self.share_of_cube(texel, face, point) else {
            return Vec::new();
        };
        bilinear(back.face(face), back.point(point), self.walls.resolution)
            .into_iter()
            .map(|(row, weight)| (row, share * weight))
            .collect()
    }

    /// Form factor of the opening on a texel, divided by the form factor of the cube's opening on a point of the cube's
    /// wall; `None` where the latter is grazing.
    fn share_of_cube(&self, texel: usize, face: Face, point: DVec3) -> Option<f64> {
        let on_cube = point_to_polygon(point, -face.outward(), &self.unit_corners);
        if on_cube < LEAST_FACTOR {
            return None;
        }
        let (center, normal) = (self.walls.centers[texel], self.walls.normals[texel]);
        Some(factor_above(center, normal, &self.corners) / on_cube)
    }

    /// Samples of the cube's probes (26 a probe) with the opening's true solid angle, turned as the warp turns.
    fn turned_probes(&self, samples: &Matrix<f64>, probes: usize) -> Matrix<f64> {
        let convert = ProbeSamples::default();
        let mut light = convert.to_sh(samples, PROBE_WEIGHT);
        let turns: Vec<(f64, Vec<Matrix<f64>>)> = probe_points(probes)
            .map(|unit| {
                let there = polygon_moments(unit, &self.unit_corners).solid_angle;
                let world = self.walls.warp.point(unit);
                let here = polygon_moments(world, &self.corners).solid_angle;
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

    /// The wall and the point where the ray from the eye through a point of the world meets the unit cube.
    fn wall_of_cube(&self, point: DVec3) -> Option<(Face, DVec3)> {
        let direction = self.world.inverse() * (point - self.eye);
        if direction.dot(self.face.outward()) >= 0.0 {
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

/// Sums of a matrix's rows with weights: row i of the result has the rows and weights of `sums[i]`.
fn weighted_rows(sums: &[Vec<(usize, f64)>], matrix: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(sums.len(), matrix.columns(), |i, j| {
        sums[i].iter().map(|&(k, w)| w * matrix[(k, j)]).sum()
    })
}

/// Form factor of the part of a polygon that is above the point's horizon.
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
