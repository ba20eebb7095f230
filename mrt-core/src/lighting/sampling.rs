//! Low-discrepancy points in the unit square, and maps from the square to the disk, the hemisphere and the
//! sphere.
//!
//! Every result has the same bits on every machine: it is made of integers, exactly rounded operations, and
//! `libm` for the rest.
//!
//! The maps start from the square [-1, 1]², where the concentric map is odd in both coordinates. So a
//! quarter turn of the square is a quarter turn of the image, bit for bit, and grids of directions made with
//! [`cell_center`] have exactly the symmetry of the square. [`square_from_unit`] takes points of [0, 1)² to
//! this square. Hemispheres are around +z.
//!
//! Sources: P. Shirley and K. Chiu, "A Low Distortion Map Between Disk and Square", Journal of
//! Graphics Tools 2(3), 1997; B. Burley, "Practical Hash-based Owen Scrambling", Journal of Computer
//! Graphics Techniques 9(4), 2020.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4, PI, SQRT_2};

/// Point `index` of a Sobol' sequence in [0, 1)². `seed` chooses its Owen scrambling and shuffled order.
///
/// Any 2^k points that start at a multiple of 2^k are a (0, k, 2)-net: each elementary box of area 2^-k
/// contains exactly one. Sequences of different seeds are uncorrelated, so pairs of them make points of more
/// than two dimensions.
pub fn sobol_point(index: u32, seed: u32) -> DVec2 {
    let index = nested_uniform_scramble(index, hash(seed, 0));
    let x = nested_uniform_scramble(index.reverse_bits(), hash(seed, 1));
    let y = nested_uniform_scramble(sobol_second_dimension(index), hash(seed, 2));
    DVec2::new(unit_from_bits(x), unit_from_bits(y))
}

/// Point `index` of the `count` points of Hammersley's set in [0, 1)²: x is evenly spaced, y is the index with
/// its bits reversed.
pub fn hammersley_point(index: u32, count: u32) -> DVec2 {
    DVec2::new(
        f64::from(index) / f64::from(count),
        unit_from_bits(index.reverse_bits()),
    )
}

/// Mixes two integers into one, such as a seed and a texel's index into a seed of [`sobol_point`].
pub fn hash(a: u32, b: u32) -> u32 {
    // The finaliser of MurmurHash3 after each word.
    let mix = |mut x: u32| {
        x ^= x >> 16;
        x = x.wrapping_mul(0x85eb_ca6b);
        x ^= x >> 13;
        x = x.wrapping_mul(0xc2b2_ae35);
        x ^ (x >> 16)
    };
    mix(mix(a ^ 0x9e37_79b9).wrapping_add(b ^ 0x7f4a_7c15))
}

/// Maps [0, 1]² onto [-1, 1]².
pub fn square_from_unit(point: DVec2) -> DVec2 {
    2.0 * point - DVec2::ONE
}

/// Centre in [-1, 1]² of cell (row, column) of a `resolution`² grid, with columns along x and rows along y.
/// Opposite cells have exactly opposite centres.
pub fn cell_center(resolution: usize, row: usize, column: usize) -> DVec2 {
    let n = resolution as f64;
    let along = |k: usize| ((2 * k + 1) as f64 - n) / n;
    DVec2::new(along(column), along(row))
}

/// The concentric map of Shirley and Chiu from [-1, 1]² onto the unit disk. It keeps ratios of areas and
/// takes concentric squares to concentric circles.
pub fn disk_from_square(square: DVec2) -> DVec2 {
    let DVec2 { x: a, y: b } = square;
    if a.abs() > b.abs() {
        let (sine, cosine) = libm::sincos(FRAC_PI_4 * (b / a));
        DVec2::new(a * cosine, a * sine)
    } else if a.abs() < b.abs() {
        let (sine, cosine) = libm::sincos(FRAC_PI_4 * (a / b));
        DVec2::new(b * sine, b * cosine)
    } else {
        // Sine and cosine of π/4 round to different numbers, which would break the symmetry.
        FRAC_1_SQRT_2 * square
    }
}

/// Inverse of [`disk_from_square`].
pub fn square_from_disk(disk: DVec2) -> DVec2 {
    let DVec2 { x, y } = disk;
    let radius = (x * x + y * y).sqrt();
    if x.abs() > y.abs() {
        let across = libm::atan(y / x) / FRAC_PI_4;
        DVec2::new(radius.copysign(x), radius.copysign(x) * across)
    } else if x.abs() < y.abs() {
        let across = libm::atan(x / y) / FRAC_PI_4;
        DVec2::new(radius.copysign(y) * across, radius.copysign(y))
    } else {
        SQRT_2 * disk
    }
}

/// Unit direction with z >= 0, of density cos θ / π per steradian: the disk lifted onto the hemisphere
/// (Malley's method).
pub fn cosine_hemisphere_from_square(square: DVec2) -> DVec3 {
    let radius = square.x.abs().max(square.y.abs());
    // Near the rim this product keeps the digits of z that 1 - radius² would lose.
    let z = ((1.0 - radius) * (1.0 + radius)).max(0.0).sqrt();
    disk_from_square(square).extend(z)
}

/// Inverse of [`cosine_hemisphere_from_square`] for a unit direction with z >= 0.
pub fn square_from_cosine_hemisphere(direction: DVec3) -> DVec2 {
    square_from_disk(direction.truncate())
}

/// Unit direction with z >= 0, of density 1 / 2π per steradian: equal areas of the square become equal solid
/// angles.
pub fn uniform_hemisphere_from_square(square: DVec2) -> DVec3 {
    let radius = square.x.abs().max(square.y.abs());
    let squared = radius * radius;
    let disk = disk_from_square(square);
    ((2.0 - squared).max(0.0).sqrt() * disk).extend((1.0 - squared).max(0.0))
}

/// Inverse of [`uniform_hemisphere_from_square`] for a unit direction with z >= 0.
pub fn square_from_uniform_hemisphere(direction: DVec3) -> DVec2 {
    square_from_disk(direction.truncate() / (1.0 + direction.z).sqrt())
}

/// Unit direction of density 1 / 4π per steradian. x of the square is the azimuth in units of π, and y is the
/// z coordinate (Archimedes).
pub fn sphere_from_square(square: DVec2) -> DVec3 {
    let z = square.y;
    let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let (sine, cosine) = libm::sincos(PI * square.x);
    DVec3::new(radius * cosine, radius * sine, z)
}

/// Inverse of [`sphere_from_square`] for a unit direction.
pub fn square_from_sphere(direction: DVec3) -> DVec2 {
    DVec2::new(libm::atan2(direction.y, direction.x) / PI, direction.z)
}

/// The second dimension of the Sobol' sequence, in units of 2^-32. Its generator matrix belongs to the
/// polynomial x + 1; the columns are rows of Pascal's triangle modulo 2.
fn sobol_second_dimension(mut index: u32) -> u32 {
    let mut bits = 0;
    let mut column = 1 << 31;
    while index != 0 {
        if index & 1 != 0 {
            bits ^= column;
        }
        column ^= column >> 1;
        index >>= 1;
    }
    bits
}

/// Owen's scrambling of a binary fraction: a hash of the bits above a bit decides whether it is flipped
/// (Burley, section 3, with the permutation of Laine and Karras).
fn nested_uniform_scramble(fraction: u32, seed: u32) -> u32 {
    let mut x = fraction.reverse_bits().wrapping_add(seed);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6] {
        x ^= x.wrapping_mul(factor);
    }
    x.reverse_bits()
}

/// The number `bits` / 2^32, exactly.
fn unit_from_bits(bits: u32) -> f64 {
    f64::from(bits) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quarter_turn(p: DVec2) -> DVec2 {
        DVec2::new(-p.y, p.x)
    }

    fn square() -> impl Strategy<Value = DVec2> {
        (-1.0..=1.0f64, -1.0..=1.0f64).prop_map(|(x, y)| DVec2::new(x, y))
    }

    proptest! {
        #[test]
        fn maps_are_undone_by_their_inverses(point in square()) {
            // A few roundings. Those of the sphere matter near the poles, where z hardly tells the radius.
            let close = |back: DVec2| (back - point).abs().max_element() < 1e-14;
            prop_assert!(close(square_from_disk(disk_from_square(point))));
            let cosine = cosine_hemisphere_from_square(point);
            prop_assert!(close(square_from_cosine_hemisphere(cosine)));
            let uniform = uniform_hemisphere_from_square(point);
            prop_assert!(close(square_from_uniform_hemisphere(uniform)));
            let sphere = sphere_from_square(point);
            prop_assert!(close(square_from_sphere(sphere)));
            for direction in [cosine, uniform, sphere] {
                prop_assert!((direction.length() - 1.0).abs() < 1e-15 * 4.0);
            }
        }

        #[test]
        fn disk_points_come_back(point in square()) {
            prop_assume!(point.length() <= 1.0);
            let back = disk_from_square(square_from_disk(point));
            prop_assert!((back - point).length() < 1e-14);
        }
    }

    #[test]
    fn the_center_stays_and_corners_map_to_the_rim() {
        assert_eq!(disk_from_square(DVec2::ZERO), DVec2::ZERO);
        assert_eq!(square_from_disk(DVec2::ZERO), DVec2::ZERO);
        let corner = disk_from_square(DVec2::ONE);
        assert_eq!(corner, DVec2::splat(FRAC_1_SQRT_2));
        assert_eq!(cosine_hemisphere_from_square(DVec2::ONE).z, 0.0);
        assert_eq!(uniform_hemisphere_from_square(DVec2::ZERO), DVec3::Z);
    }

    #[test]
    fn a_quarter_turn_of_a_grid_is_one_of_the_directions() {
        for resolution in [1, 2, 5, 12, 24] {
            for row in 0..resolution {
                for column in 0..resolution {
                    let point = cell_center(resolution, row, column);
                    let turned = cell_center(resolution, column, resolution - 1 - row);
                    assert_eq!(turned, quarter_turn(point));
                    let disk = disk_from_square(point);
                    assert_eq!(disk_from_square(turned), quarter_turn(disk));
                    for map in [
                        cosine_hemisphere_from_square,
                        uniform_hemisphere_from_square,
                    ] {
                        let (before, after) = (map(point), map(turned));
                        assert_eq!(after, quarter_turn(before.truncate()).extend(before.z));
                    }
                }
            }
        }
    }

    #[test]
    fn every_elementary_box_holds_one_point() {
        const LOG: u32 = 8;
        for (seed, block) in [(0, 0), (1, 0), (77, 5)] {
            let start = block << LOG;
            let points: Vec<_> = (start..start + (1 << LOG))
                .map(|i| sobol_point(i, seed))
                .collect();
            for log_x in 0..=LOG {
                let (across, up) = (1usize << log_x, 1usize << (LOG - log_x));
                let mut counts = vec![0; 1 << LOG];
                for p in &points {
                    counts[(p.x * across as f64) as usize * up + (p.y * up as f64) as usize] += 1;
                }
                assert!(
                    counts.iter().all(|&n| n == 1),
                    "{across} x {up}, seed {seed}"
                );
            }
        }
    }

    /// Root mean square of the discrepancy of boxes at the origin (Warnock's formula).
    fn l2_star_discrepancy(points: &[DVec2]) -> f64 {
        let n = points.len() as f64;
        let one: f64 = points
            .iter()
            .map(|p| (1.0 - p.x * p.x) * (1.0 - p.y * p.y))
            .sum();
        let two: f64 = points
            .iter()
            .flat_map(|p| points.iter().map(move |q| DVec2::ONE - p.max(*q)))
            .map(|rest| rest.x * rest.y)
            .sum();
        (1.0 / 9.0 - one / (2.0 * n) + two / (n * n))
            .max(0.0)
            .sqrt()
    }

    #[test]
    fn discrepancy_is_far_below_that_of_random_points() {
        let count = 1024;
        // For independent points the expected square is (1/4 - 1/9) / n.
        let random = ((0.25 - 1.0 / 9.0) / f64::from(count)).sqrt();
        let sobol: Vec<_> = (0..count).map(|i| sobol_point(i, 42)).collect();
        let hammersley: Vec<_> = (0..count).map(|i| hammersley_point(i, count)).collect();
        // Hammersley's set has points on both axes, which biases it. Scrambling removes the bias.
        for (points, factor) in [(sobol, 12.0), (hammersley, 5.0)] {
            let found = l2_star_discrepancy(&points);
            assert!(found < random / factor, "{found} against {random}");
        }
    }

    #[test]
    fn seeds_give_uncorrelated_sequences() {
        let count = 4096;
        let mean: f64 = (0..count)
            .map(|i| (sobol_point(i, 1).x - 0.5) * (sobol_point(i, 2).x - 0.5))
            .sum::<f64>()
            / f64::from(count);
        // For independent points the deviation of this mean is 1/12 / √4096.
        assert!(mean.abs() < 4.0 / 12.0 / 64.0, "{mean}");
    }

    #[test]
    fn moments_are_those_of_the_density() {
        let count = 1 << 12;
        let mean = |map: fn(DVec2) -> DVec3, f: fn(DVec3) -> f64| {
            let points = (0..count).map(|i| square_from_unit(sobol_point(i, 3)));
            points.map(|p| f(map(p))).sum::<f64>() / f64::from(count)
        };
        let cosine = |f| mean(cosine_hemisphere_from_square, f);
        let uniform = |f| mean(uniform_hemisphere_from_square, f);
        let sphere = |f| mean(sphere_from_square, f);
        let cases = [
            (cosine(|d| d.z), 2.0 / 3.0),
            (cosine(|d| d.z * d.z), 0.5),
            (cosine(|d| d.x * d.x), 0.25),
            (cosine(|d| d.x * d.y), 0.0),
            (uniform(|d| d.z), 0.5),
            (uniform(|d| d.z * d.z), 1.0 / 3.0),
            (uniform(|d| d.x), 0.0),
            (uniform(|d| d.y * d.y), 1.0 / 3.0),
            (sphere(|d| d.z), 0.0),
            (sphere(|d| d.x * d.x), 1.0 / 3.0),
            (sphere(|d| d.x * d.y), 0.0),
        ];
        for (k, (found, expected)) in cases.into_iter().enumerate() {
            // For smooth integrands a scrambled net errs by about n^-1.5 times a small factor.
            assert!(
                (found - expected).abs() < 2e-4,
                "case {k}: {found} and {expected}"
            );
        }
    }

    #[test]
    fn bits_are_frozen() {
        let mut digest = 0;
        for i in 0..256 {
            let p = square_from_unit(sobol_point(i, 9));
            let d = cosine_hemisphere_from_square(p) + uniform_hemisphere_from_square(p);
            for bits in [d.x.to_bits(), d.y.to_bits(), d.z.to_bits()] {
                digest = hash(hash(digest, bits as u32), (bits >> 32) as u32);
            }
        }
        assert_eq!(
            digest, FROZEN_DIGEST,
            "a map or a sequence changed: {digest:#x}"
        );
    }

    /// Recorded on x86-64. It is the same on every machine.
    const FROZEN_DIGEST: u32 = 0xcfa0_715a;
}
