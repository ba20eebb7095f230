//! The one-bounce operator F in closed form (Loos et al. 2011, equation 1).
//!
//! F maps outgoing radiosity, given by its value at the texel centres, to incident irradiance at the
//! texel centres. A cube with missing faces is convex, so every texel sees every wall whole and Lambert's
//! polygon formula gives each element exactly. The paper traces rays instead.

use crate::modular::one_bounce::orbits::{from_orbit_rows, orbit_receivers};
use crate::modular::surface::mirrors::cube::texel_parity_classes;
use crate::modular::surface::walls::cube::part_in_hole;
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::{SHAPES, Shape};
use rayon::prelude::*;

/// How radiosity between texel centres is reconstructed from the values there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reconstruction {
    /// Every texel has the value of its centre. Bakes use this. On the cube's reference file at 16² it errs by 0.22 %,
    /// against 0.35 % with each texel's mean estimated from its neighbours' values and 0.40 % with
    /// [`Reconstruction::Bilinear`].
    Constant,
    /// Bilinear between centres, constant beyond the outermost. The paper's table 2 was probably measured like this.
    Bilinear,
}

/// Number of parts, along each axis, into which a texel is cut to integrate a bilinear reconstruction.
const BILINEAR_PARTS: usize = 4;

/// The operator of the closed cube at `resolution`² texels a face, texels x texels.
///
/// Cost: resolution⁴ x 30 polygon evaluations, an eighth of that by symmetry; 0.2 s at 16².
///
/// # Errors
/// [`Cancelled`], if the caller has asked to stop.
pub fn closed_cube_bounce(
    resolution: usize,
    reconstruction: Reconstruction,
    progress: &Progress,
) -> Result<Matrix<f64>, Cancelled> {
    let shape = &SHAPES[0];
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    let classes = texel_parity_classes(shape, resolution);
    let rows: Vec<Vec<f64>> = orbit_receivers(&classes)
        .into_par_iter()
        .map(|receiver| {
            progress.check()?;
            let (face, point) = texels[receiver];
            Ok(receiver_row(face, point, resolution, reconstruction))
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(from_orbit_rows(&classes, &rows))
}

/// The operator of a shape, from that of the closed cube: without the rows and columns of missing faces, and with holes
/// cut out of the texels that they touch.
pub fn restrict_to_shape(closed: &Matrix<f64>, shape: &Shape, resolution: usize) -> Matrix<f64> {
    let kept: Vec<usize> = shape
        .walls()
        .flat_map(|face| {
            let start = face.index() * resolution * resolution;
            start..start + resolution * resolution
        })
        .collect();
    let mut bounce = Matrix::from_fn(kept.len(), kept.len(), |i, j| closed[(kept[i], kept[j])]);
    cut_holes(&mut bounce, shape, resolution);
    bounce
}

/// Subtracts the part of each source texel that is in a hole, exactly, and clears the rows of receivers in a hole.
fn cut_holes(bounce: &mut Matrix<f64>, shape: &Shape, resolution: usize) {
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    for (source, &(face, center)) in texels.iter().enumerate() {
        let Some(hole) = part_in_hole(shape, face, center, resolution) else {
            continue;
        };
        for (receiver, &(wall, point)) in texels.iter().enumerate() {
            if wall != face {
                let factor = point_to_polygon(point, -wall.outward(), &hole);
                // Where the hole takes the whole texel, what is left is rounding.
                let rest = bounce[(receiver, source)] - factor;
                bounce[(receiver, source)] = if rest < 1e-13 { 0.0 } else { rest };
            }
        }
    }
    for (receiver, &(face, center)) in texels.iter().enumerate() {
        if shape.is_in_hole(face, center) {
            for source in 0..texels.len() {
                bounce[(receiver, source)] = 0.0;
            }
        }
    }
}

/// Factors from all texels of the closed cube to one receiver.
fn receiver_row(
    receiver: Face,
    point: DVec3,
    resolution: usize,
    reconstruction: Reconstruction,
) -> Vec<f64> {
    let normal = -receiver.outward();
    let per_face = resolution * resolution;
    let mut row = vec![0.0; 6 * per_face];
    for face in Face::ALL.into_iter().filter(|&face| face != receiver) {
        let out = &mut row[face.index() * per_face..][..per_face];
        match reconstruction {
            Reconstruction::Constant => {
                out.copy_from_slice(&face_factors(face, point, normal, resolution));
            }
            Reconstruction::Bilinear => {
                let fine = resolution * BILINEAR_PARTS;
                let factors = face_factors(face, point, normal, fine);
                for j in 0..fine {
                    for i in 0..fine {
                        for (jj, wj) in bilinear_weights(j, resolution) {
                            for (ii, wi) in bilinear_weights(i, resolution) {
                                out[jj * resolution + ii] += wj * wi * factors[j * fine + i];
                            }
                        }
                    }
                }
            }
        }
    }
    row
}

/// Factors from each of the `resolution`² texels of one face.
fn face_factors(face: Face, point: DVec3, normal: DVec3, resolution: usize) -> Vec<f64> {
    let line = |k: usize| k as f64 / resolution as f64;
    let mut factors = Vec::with_capacity(resolution * resolution);
    for j in 0..resolution {
        for i in 0..resolution {
            let texel = face.rectangle([line(i), line(i + 1)], [line(j), line(j + 1)]);
            factors.push(point_to_polygon(point, normal, &texel));
        }
    }
    factors
}

/// The two texels, with weights, between whose centres part `k` of the fine grid lies.
fn bilinear_weights(k: usize, resolution: usize) -> [(usize, f64); 2] {
    let x = (k as f64 + 0.5) / BILINEAR_PARTS as f64 - 0.5;
    let low = x.floor();
    let weight = x - low;
    let clamp = |i: f64| i.clamp(0.0, (resolution - 1) as f64) as usize;
    [(clamp(low), 1.0 - weight), (clamp(low + 1.0), weight)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_cube_gathers_all_light_and_gains_none() {
        for reconstruction in [Reconstruction::Constant, Reconstruction::Bilinear] {
            let bounce =
                closed_cube_bounce(6, reconstruction, &Progress::silent()).expect("nobody cancels");
            for i in 0..bounce.rows() {
                let sum: f64 = (0..bounce.columns()).map(|j| bounce[(i, j)]).sum();
                // Sums of up to 4 * 180 angles.
                assert!(
                    (sum - 1.0).abs() < 1e-12,
                    "{reconstruction:?}: row {i}: {sum}"
                );
            }
        }
    }

    #[test]
    fn symmetry_fills_the_rows_that_direct_evaluation_gives() {
        let resolution = 5;
        let bounce = closed_cube_bounce(resolution, Reconstruction::Constant, &Progress::silent())
            .expect("nobody cancels");
        for (k, (face, point)) in SHAPES[0].texels(resolution).enumerate() {
            let row = receiver_row(face, point, resolution, Reconstruction::Constant);
            for (j, factor) in row.into_iter().enumerate() {
                // Mirrored corners differ by rounding of 1 - x.
                assert!((bounce[(k, j)] - factor).abs() < 1e-14);
            }
        }
    }
}
