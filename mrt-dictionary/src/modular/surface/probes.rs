//! Probes of a block: where they stand, and the directions in which their light is sampled.
//!
//! A probe stores spherical harmonics, but bases are computed with its radiance in [`DIRECTIONS`]. A symmetry of the cube
//! exchanges directions, where it would change signs of coefficients, so the samples of probes fold into parity classes
//! as texels do.

use glam::{DVec3, IVec3};
use std::f64::consts::PI;

/// The 26 directions to the faces, edges and corners of a cube, not normalised. With the weights of [`lebedev_weight`]
/// they integrate polynomials of degree seven exactly, and so products of two functions of the first three bands.
pub static DIRECTIONS: [IVec3; 26] = directions();

const fn directions() -> [IVec3; 26] {
    let mut out = [IVec3::ZERO; 26];
    let (mut next, mut k) = (0, 0);
    while k < 27 {
        let d = IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if d.x != 0 || d.y != 0 || d.z != 0 {
            out[next] = d;
            next += 1;
        }
        k += 1;
    }
    out
}

/// Weight of one of the [`DIRECTIONS`] in integrals over the sphere; all of them add up to 4π (Lebedev 1976).
pub fn lebedev_weight(direction: IVec3) -> f64 {
    let weight = match direction.length_squared() {
        1 => 1.0 / 21.0,
        2 => 4.0 / 105.0,
        _ => 9.0 / 280.0,
    };
    4.0 * PI * weight
}

/// Centres of the `per_axis`³ probes of a block in the unit cube: x fastest, then y, then z, at
/// (i + 0.5) / `per_axis`.
pub fn probe_points(per_axis: usize) -> impl Iterator<Item = DVec3> {
    let center = move |k: usize| (k as f64 + 0.5) / per_axis as f64;
    (0..per_axis * per_axis * per_axis).map(move |k| {
        let (x, y, z) = (
            k % per_axis,
            k / per_axis % per_axis,
            k / per_axis / per_axis,
        );
        DVec3::new(center(x), center(y), center(z))
    })
}

/// Number of samples of `per_axis`³ probes.
pub fn probe_sample_count(per_axis: usize) -> usize {
    per_axis * per_axis * per_axis * DIRECTIONS.len()
}

/// Index of a sample, given by its probe's centre and one of the [`DIRECTIONS`], among the samples of all probes of a
/// block: probe by probe, direction by direction.
pub fn probe_sample(point: DVec3, direction: IVec3, per_axis: usize) -> usize {
    let cell = (point * per_axis as f64).floor().as_uvec3();
    let probe = (cell.z as usize * per_axis + cell.y as usize) * per_axis + cell.x as usize;
    // Place in the 3 x 3 x 3 neighbours of a cell, whose middle one is no direction.
    let place = ((direction.z + 1) * 3 + direction.y + 1) * 3 + direction.x + 1;
    let direction = if place > 13 { place - 1 } else { place };
    probe * DIRECTIONS.len() + direction as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_numbered_as_they_are_listed() {
        let mut expected = 0;
        for point in probe_points(3) {
            for direction in DIRECTIONS {
                assert_eq!(probe_sample(point, direction, 3), expected);
                expected += 1;
            }
        }
        assert_eq!(expected, probe_sample_count(3));
    }

    #[test]
    fn weights_add_up_to_the_sphere() {
        let sum: f64 = DIRECTIONS.into_iter().map(lebedev_weight).sum();
        assert!((sum - 4.0 * PI).abs() < 1e-14);
    }
}
