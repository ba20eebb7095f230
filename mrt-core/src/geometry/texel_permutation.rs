//! What a symmetry of the cube does to the texels on its faces.

use crate::geometry::cube::Face;
use crate::geometry::cube_symmetry::CubeSymmetry;
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Where a symmetry takes texels of the unit cube: entry k is the index of the texel that texel k goes to.
///
/// `texels` lists the faces and centres of texels of `resolution`² grids, of the faces that are there.
///
/// # Panics
/// If some texel goes to a place where there is none.
pub fn texel_permutation(
    texels: &[(Face, DVec3)],
    resolution: usize,
    map: CubeSymmetry,
) -> Vec<u32> {
    // Centres are odd multiples of half a step: exact as integers.
    let key = |face: Face, center: DVec3| -> (Face, IVec3) {
        let half_steps = center * (2 * resolution) as f64;
        (face, half_steps.round().as_ivec3())
    };
    let index: HashMap<_, u32> = texels
        .iter()
        .map(|&(face, center)| key(face, center))
        .zip(0..)
        .collect();
    texels
        .iter()
        .map(|&(face, center)| index[&key(map.face(face), map.point(center))])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permutation_moves_texels_as_the_symmetry_moves_points() {
        let resolution = 3;
        let texels: Vec<(Face, DVec3)> = Face::ALL
            .into_iter()
            .flat_map(|face| {
                (0..resolution * resolution).map(move |k| {
                    let (row, column) = (k / resolution, k % resolution);
                    (face, face.texel_center(resolution, row, column))
                })
            })
            .collect();
        for map in CubeSymmetry::all() {
            let images = texel_permutation(&texels, resolution, map);
            let inverse = texel_permutation(&texels, resolution, map.inverse());
            for (k, &(face, center)) in texels.iter().enumerate() {
                let (image_face, image_center) = texels[images[k] as usize];
                assert_eq!(image_face, map.face(face));
                assert!((image_center - map.point(center)).length() < 1e-15);
                assert_eq!(inverse[images[k] as usize] as usize, k);
            }
        }
    }
}
