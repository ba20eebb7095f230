//! What arrives at a shape: the response modes behind one of its openings.

use crate::modular::paths::ends::{PathFrame, RECEIVER};
use crate::modular::paths::response::ResponseBasis;
use crate::modular::surface::output_grid::OutputGrid;
use crate::modular::surface::probes::{DIRECTIONS, probe_points, probe_sample};
use crate::modular::surface::walls::cube::{texel_at, texel_axes};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::Shape;

/// Light that enters through one opening of a shape, in one of the frames there.
#[derive(Clone, Debug)]
pub struct ArrivingLight {
    /// Outputs of the shape (irradiance of texels, then weighted samples of probes) x response modes.
    pub outputs: Matrix<f64>,
    /// Vector irradiance: 4 texels x response modes, or no rows.
    pub vector: Matrix<f64>,
}

/// The response modes on the walls, at the probes and in the vector irradiance of a shape, behind each of its openings in
/// each of the given frames: opening by opening, frame by frame.
pub fn arriving_light(
    shape: &Shape,
    frames: &[PathFrame],
    response: &ResponseBasis,
    grid: &OutputGrid,
) -> Vec<ArrivingLight> {
    let openings = shape.openings.iter();
    openings
        .flat_map(|opening| frames.iter().map(|&frame| (opening.face, frame)))
        .map(|(opening, frame)| {
            let arrival = Arrival::new(shape, opening, frame, grid.resolution);
            ArrivingLight {
                outputs: arrival.outputs(response, grid.probes),
                vector: arrival.vector(response),
            }
        })
        .collect()
}

/// How a shape's texels lie in the canonical receiver behind an opening.
pub struct Arrival<'a> {
    shape: &'a Shape,
    resolution: usize,
    /// From the receiver's frame to the shape's.
    frame: CubeSymmetry,
    /// The receiver's texel for each texel of the shape; `None` in holes, and on the wall around the opening.
    texels: Vec<Option<usize>>,
}

impl<'a> Arrival<'a> {
    /// Behind one opening, in one of its frames.
    pub fn new(shape: &'a Shape, opening: Face, frame: PathFrame, resolution: usize) -> Self {
        let frame = frame.of_heading(opening.opposite());
        let back = frame.inverse();
        let texels = shape.texels(resolution).map(|(face, center)| {
            if shape.is_in_hole(face, center) {
                return None;
            }
            texel_at(&RECEIVER, back.face(face), back.point(center), resolution)
        });
        Self {
            shape,
            resolution,
            frame,
            texels: texels.collect(),
        }
    }

    /// The response modes on the texels, then at the samples of `probes`³ probes.
    pub fn outputs(&self, response: &ResponseBasis, probes: usize) -> Matrix<f64> {
        let back = self.frame.inverse();
        let first_sample = RECEIVER.texel_count(self.resolution);
        let samples = probe_points(probes).flat_map(|point| {
            DIRECTIONS.iter().map(move |direction| {
                let direction = back.direction(direction.as_dvec3()).as_ivec3();
                Some(first_sample + probe_sample(back.point(point), direction, probes))
            })
        });
        let sources: Vec<Option<usize>> = self.texels.iter().copied().chain(samples).collect();
        Matrix::from_fn(sources.len(), response.basis.columns(), |i, j| {
            sources[i].map_or(0.0, |row| response.basis[(row, j)])
        })
    }

    /// The vector irradiance of the response modes; no rows where they have none.
    pub fn vector(&self, response: &ResponseBasis) -> Matrix<f64> {
        let modes = response.basis.columns();
        if response.vector.rows() == 0 {
            return Matrix::zeros(0, modes);
        }
        let back = self.frame.inverse();
        // Images of the receiver's tangents u and v in the tangents of the shape's texel.
        let tangents: Vec<[[f64; 2]; 2]> = self
            .shape
            .texels(self.resolution)
            .map(|(face, _)| {
                let [u, v, _] = texel_axes(face);
                let [from_u, from_v, _] = texel_axes(back.face(face));
                [from_u, from_v].map(|from: DVec3| {
                    let image = self.frame.direction(from);
                    [image.dot(u), image.dot(v)]
                })
            })
            .collect();
        Matrix::from_fn(4 * self.texels.len(), modes, |i, j| {
            let Some(row) = self.texels[i / 4] else {
                return 0.0;
            };
            let at = |k: usize| response.vector[(4 * row + k, j)];
            let [from_u, from_v] = tangents[i / 4];
            // The order of coefficients is 1, v, normal, u.
            match i % 4 {
                1 => at(3) * from_u[1] + at(1) * from_v[1],
                3 => at(3) * from_u[0] + at(1) * from_v[0],
                k => at(k),
            }
        })
    }
}
