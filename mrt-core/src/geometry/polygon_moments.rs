//! Moments over the solid angle of a planar polygon, in closed form: the integrals of 1, ω and ω ωᵀ over
//! the directions ω in which a point sees the polygon. They determine the first three bands of the
//! spherical harmonics of a uniformly bright polygon, and rotate as a vector and a matrix do.
//!
//! Source: J. Arvo, "Applications of Irradiance Tensors to the Simulation of Non-Lambertian Phenomena",
//! SIGGRAPH 1995. Stokes' theorem reduces each moment to the one two orders below and a sum over the
//! edges. Let n be the unit normal of an edge's great circle, pointing into the polygon, θ the angle that
//! the edge subtends, and s the integral of ω along its arc. Then
//!
//! ```text
//! 2 ∫ω dω = Σ θ n          3 ∫ω ωᵀ dω = I ∫dω + Σ s nᵀ
//! ```
//!
//! The solid angle is from A. van Oosterom and J. Strackee, "The Solid Angle of a Plane Triangle", IEEE
//! Trans. Biomed. Eng. 1983. The sums cancel for small polygons: terms as large as the polygon's angular
//! size leave a result as large as the square of that size. So below the size `SMALL` a quadrature, which
//! loses no digits, takes over.

use glam::DVec3;
use std::f64::consts::PI;

/// Ratio of a polygon's size to its distance below which it is integrated by quadrature.
///
/// At this ratio both ways err by about 1e-13: the sums by rounding, the quadrature by the sixth power of
/// the ratio.
const SMALL: f64 = 1.0 / 128.0;

/// Integrals over the solid angle that a polygon covers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// ∫ dω, in steradians, 0 to 2π for one polygon.
    pub solid_angle: f64,
    /// ∫ ω dω.
    pub first: DVec3,
    /// ∫ ωᵢ ωⱼ dω, in the order xx, yy, zz, xy, yz, zx. The first three add up to the solid angle.
    pub second: [f64; 6],
}

impl Moments {
    /// The moments of one steradian of light from a unit `direction`.
    #[cfg(test)]
    pub(crate) fn of_direction(direction: DVec3) -> Moments {
        let DVec3 { x, y, z } = direction;
        Moments {
            solid_angle: 1.0,
            first: direction,
            second: [x * x, y * y, z * z, x * y, y * z, z * x],
        }
    }

    /// Adds the moments of `other` times `weight`. With radiances as weights, sums over many polygons are
    /// the moments of the light that they send.
    pub fn add(&mut self, other: &Moments, weight: f64) {
        self.solid_angle += weight * other.solid_angle;
        self.first += other.first * weight;
        for (sum, term) in self.second.iter_mut().zip(other.second) {
            *sum += weight * term;
        }
    }

    /// The moments in the coordinates along three orthonormal `axes`.
    pub fn in_frame(&self, axes: &[DVec3; 3]) -> Moments {
        let [xx, yy, zz, xy, yz, zx] = self.second;
        let image = axes.map(|a| {
            DVec3::new(
                xx * a.x + xy * a.y + zx * a.z,
                xy * a.x + yy * a.y + yz * a.z,
                zx * a.x + yz * a.y + zz * a.z,
            )
        });
        let entry = |i: usize, j: usize| axes[i].dot(image[j]);
        Moments {
            solid_angle: self.solid_angle,
            first: DVec3::from_array(axes.map(|a| a.dot(self.first))),
            second: [
                entry(0, 0),
                entry(1, 1),
                entry(2, 2),
                entry(0, 1),
                entry(1, 2),
                entry(2, 0),
            ],
        }
    }

    /// ∫ Y dω of the nine functions Y of [`sh`](crate::lighting::sh) with l <= 2: the coefficients of
    /// radiance 1 from the polygon.
    pub fn sh9(&self) -> [f64; 9] {
        let [xx, yy, zz, xy, yz, zx] = self.second;
        let constant = (0.25 / PI).sqrt();
        let linear = (0.75 / PI).sqrt();
        let mixed = (3.75 / PI).sqrt();
        // 3 z² - 1 integrates to 2 zz - xx - yy.
        let zonal = (0.3125 / PI).sqrt();
        [
            constant * self.solid_angle,
            linear * self.first.y,
            linear * self.first.z,
            linear * self.first.x,
            mixed * xy,
            mixed * yz,
            zonal * (2.0 * zz - xx - yy),
            mixed * zx,
            0.5 * mixed * (xx - yy),
        ]
    }

    /// Fraction of the cosine-weighted hemisphere around unit `normal` that the polygon covers. A part
    /// below the horizon counts as negative; without one, this is
    /// [`point_to_polygon`](crate::geometry::form_factor::point_to_polygon).
    pub fn irradiance_factor(&self, normal: DVec3) -> f64 {
        self.first.dot(normal) / PI
    }
}

/// The moments of a planar convex polygon seen from `point`.
///
/// The polygon may wind either way, and may have repeated or collinear corners. With fewer than three
/// corners its moments are zero. It must not contain `point`: the results would be finite but meaningless.
///
/// Measured errors, relative to each moment's own length, were at most 1e-12. The polygons had sizes from
/// 1e-8 of their distance to more than it, and were seen under more than 10 degrees. From a height h over
/// the plane or over an edge, in units of the nearest corner's distance, rounding adds an error of a few
/// times 1e-16 / h; rounding the corners alone adds as much.
///
/// Cost: an arc tangent for each edge and one more, about 290 ns for a square. For a small and far
/// polygon: seven square roots for each corner but two, about 180 ns for a square.
pub fn polygon_moments(point: DVec3, polygon: &[DVec3]) -> Moments {
    if polygon.len() < 3 {
        return Moments::default();
    }
    // Subtracting the point from the nearest corner loses the fewest digits.
    let (mut nearest, mut distance_squared) = (0, f64::INFINITY);
    for (k, &corner) in polygon.iter().enumerate() {
        let candidate = (corner - point).length_squared();
        if candidate < distance_squared {
            (nearest, distance_squared) = (k, candidate);
        }
    }
    let reach_squared = polygon.iter().fold(0.0, |reach: f64, &corner| {
        reach.max((corner - polygon[nearest]).length_squared())
    });
    let moments = if reach_squared < SMALL * SMALL * distance_squared {
        quadrature(point, polygon, nearest)
    } else {
        closed_form(point, polygon, nearest)
    };
    let mut positive = Moments::default();
    positive.add(&moments, moments.solid_angle.signum());
    positive
}

/// A corner of a polygon, as it is seen.
#[derive(Clone, Copy)]
struct Corner {
    position: DVec3,
    /// From the point that it is seen from.
    offset: DVec3,
    /// 1 / length of the offset.
    inverse: f64,
    /// The offset at unit length.
    direction: DVec3,
}

impl Corner {
    fn new(point: DVec3, position: DVec3) -> Self {
        let offset = position - point;
        let inverse = inverse_length(offset);
        Self {
            position,
            offset,
            inverse,
            direction: offset * inverse,
        }
    }
}

/// Moments with the sign of the winding, by sums over the edges.
fn closed_form(point: DVec3, polygon: &[DVec3], nearest: usize) -> Moments {
    let apex = Corner::new(point, polygon[nearest]);
    let mut sums = Moments::default();
    // Half the solid angle is the argument of a product of complex numbers, one for each triangle of the
    // fan around the apex. For the whole polygon it is less than π.
    let (mut real, mut imaginary) = (1.0, 0.0);
    let mut from = apex;
    let mut next = nearest;
    for step in 0..polygon.len() {
        next = if next + 1 == polygon.len() {
            0
        } else {
            next + 1
        };
        let to = Corner::new(point, polygon[next]);
        add_edge(&mut sums, &from, &to);
        // The first and the last edge meet the apex and have no triangle.
        if step > 0 && step + 1 < polygon.len() {
            let (a, b) = triangle_factor(&apex, &from, &to);
            (real, imaginary) = (real * a - imaginary * b, real * b + imaginary * a);
        }
        from = to;
    }
    let solid_angle = 2.0 * libm::atan2(imaginary, real);
    for diagonal in &mut sums.second[..3] {
        *diagonal += solid_angle;
    }
    Moments {
        solid_angle,
        first: sums.first * 0.5,
        second: sums.second.map(|entry| entry / 3.0),
    }
}

/// Adds what an edge brings to the sums: θ n to `first`, and the symmetric part of s nᵀ to `second`.
fn add_edge(sums: &mut Moments, from: &Corner, to: &Corner) {
    // The cross product of both offsets, from the shorter one and the edge itself: the difference of two
    // long vectors would lose digits.
    let shorter = if from.inverse > to.inverse { from } else { to };
    let across = shorter.offset.cross(to.position - from.position);
    let sine = across.length();
    // An edge in line with the point subtends no angle.
    if sine > 0.0 {
        let normal = across / sine;
        let cosine = from.offset.dot(to.offset);
        sums.first += normal * libm::atan2(sine, cosine);
        let along = if cosine > 0.0 {
            // The tangent of half the angle keeps the digits of short edges.
            let scaled = from.inverse * to.inverse;
            (from.direction + to.direction) * (sine * scaled / (1.0 + cosine * scaled))
        } else {
            (to.direction - from.direction).cross(normal)
        };
        let second = &mut sums.second;
        second[0] += along.x * normal.x;
        second[1] += along.y * normal.y;
        second[2] += along.z * normal.z;
        second[3] += 0.5 * (along.x * normal.y + along.y * normal.x);
        second[4] += 0.5 * (along.y * normal.z + along.z * normal.y);
        second[5] += 0.5 * (along.z * normal.x + along.x * normal.z);
    }
}

/// The complex number (real, imaginary) whose argument is half the solid angle of a triangle.
fn triangle_factor(apex: &Corner, from: &Corner, to: &Corner) -> (f64, f64) {
    let volume = apex
        .offset
        .dot((from.position - apex.position).cross(to.position - apex.position));
    let imaginary = 0.25 * volume * apex.inverse * from.inverse * to.inverse;
    let real = 0.25
        * (1.0
            + apex.direction.dot(from.direction)
            + from.direction.dot(to.direction)
            + to.direction.dot(apex.direction));
    (real, imaginary)
}

/// Moments with the sign of the winding, by Radon's rule: seven points per triangle, exact for polynomials
/// of degree five.
fn quadrature(point: DVec3, polygon: &[DVec3], nearest: usize) -> Moments {
    let root = 15f64.sqrt();
    let rule = [
        (1.0 / 3.0, 0.225),
        ((6.0 - root) / 21.0, (155.0 - root) / 1200.0),
        ((6.0 + root) / 21.0, (155.0 + root) / 1200.0),
    ];
    let apex = polygon[nearest];
    let to_apex = apex - point;
    let mut moments = Moments::default();
    let corner = |k: usize| polygon[(nearest + k) % polygon.len()];
    for k in 1..polygon.len() - 1 {
        let (u, v) = (corner(k) - apex, corner(k + 1) - apex);
        // Area times distance from the plane: dω is that distance / |x|³ times dA.
        let scale = 0.5 * to_apex.dot(u.cross(v));
        let mut add = |i: f64, j: f64, weight: f64| {
            let x = to_apex + u * i + v * j;
            let inverse = 1.0 / x.length();
            let solid_angle = weight * scale * inverse * inverse * inverse;
            let omega = x * inverse;
            let part = omega * solid_angle;
            moments.solid_angle += solid_angle;
            moments.first += part;
            moments.second[0] += part.x * omega.x;
            moments.second[1] += part.y * omega.y;
            moments.second[2] += part.z * omega.z;
            moments.second[3] += part.x * omega.y;
            moments.second[4] += part.y * omega.z;
            moments.second[5] += part.z * omega.x;
        };
        add(rule[0].0, rule[0].0, rule[0].1);
        for (a, weight) in [rule[1], rule[2]] {
            let rest = 1.0 - 2.0 * a;
            add(a, a, weight);
            add(rest, a, weight);
            add(a, rest, weight);
        }
    }
    moments
}

/// 1 / |v|, or 0 for a vector without length, so that a corner at the point itself adds nothing.
fn inverse_length(v: DVec3) -> f64 {
    let length = v.length();
    if length > 0.0 { 1.0 / length } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cube::Face;
    use crate::geometry::form_factor::{HalfSpace, clip_polygon, point_to_polygon};
    use crate::lighting::sh;

    /// Fixed pseudo-random numbers in [0, 1): the upper bits of a linear congruential generator.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn direction(&mut self) -> DVec3 {
            loop {
                let v = DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0;
                if v.length() > 0.1 && v.length() < 1.0 {
                    return v.normalize();
                }
            }
        }

        /// A convex polygon of 3 to 8 corners on an ellipse whose larger radius is `radius`.
        fn polygon(&mut self, center: DVec3, normal: DVec3, radius: f64) -> Vec<DVec3> {
            let u = normal.any_orthonormal_vector() * radius;
            let v = normal.cross(u) * (0.3 + 0.7 * self.next());
            let count = 3 + (self.next() * 6.0) as usize;
            let mut angles: Vec<f64> = (0..count).map(|_| 2.0 * PI * self.next()).collect();
            angles.sort_by(f64::total_cmp);
            if self.next() < 0.5 {
                angles.reverse();
            }
            let corner = |a: f64| center + u * a.cos() + v * a.sin();
            angles.into_iter().map(corner).collect()
        }
    }

    /// Moments by a composite Gauss rule: strips of five points in both coordinates of each triangle of a
    /// fan.
    fn numeric(point: DVec3, polygon: &[DVec3]) -> Moments {
        const STRIPS: usize = 12;
        let (inner, outer) = ((10.0f64 / 7.0).sqrt(), 70f64.sqrt());
        let near = (5.0 - 2.0 * inner).sqrt() / 3.0;
        let far = (5.0 + 2.0 * inner).sqrt() / 3.0;
        let near_weight = (322.0 + 13.0 * outer) / 900.0;
        let far_weight = (322.0 - 13.0 * outer) / 900.0;
        let rule = [
            (-far, far_weight),
            (-near, near_weight),
            (0.0, 128.0 / 225.0),
            (near, near_weight),
            (far, far_weight),
        ];
        let points: Vec<(f64, f64)> = (0..STRIPS)
            .flat_map(|strip| {
                rule.map(|(x, w)| {
                    let step = 0.5 / STRIPS as f64;
                    ((2.0 * strip as f64 + 1.0 + x) * step, w * step)
                })
            })
            .collect();
        let mut sum = Moments::default();
        let a = polygon[0] - point;
        for pair in polygon[1..].windows(2) {
            let (u, v) = (pair[0] - polygon[0], pair[1] - pair[0]);
            let scale = a.dot(u.cross(v));
            for &(s, ws) in &points {
                for &(t, wt) in &points {
                    let x = a + (u + v * t) * s;
                    let r = x.length();
                    let sample = Moments::of_direction(x / r);
                    sum.add(&sample, scale * s * ws * wt / (r * r * r));
                }
            }
        }
        let mut positive = Moments::default();
        positive.add(&sum, sum.solid_angle.signum());
        positive
    }

    /// Frobenius norm of the second moment.
    fn second_length(m: &Moments) -> f64 {
        let square = |k: usize| m.second[k] * m.second[k] * if k < 3 { 1.0 } else { 2.0 };
        (0..6).map(square).sum::<f64>().sqrt()
    }

    /// The largest difference of the three moments, each relative to its length in `b`.
    fn relative_error(a: &Moments, b: &Moments) -> f64 {
        let mut difference = *a;
        difference.add(b, -1.0);
        (difference.solid_angle / b.solid_angle)
            .abs()
            .max(difference.first.length() / b.first.length())
            .max(second_length(&difference) / second_length(b))
    }

    #[test]
    fn moments_equal_the_numeric_integral_at_every_size() {
        let mut numbers = Numbers(7);
        for exponent in 0..=32 {
            let radius = 10f64.powf(-0.25 * f64::from(exponent));
            let mut worst = 0.0f64;
            for _ in 0..20 {
                let toward = numbers.direction();
                let mut normal = numbers.direction();
                if normal.dot(toward).abs() < 0.2 {
                    normal = (normal + toward * 0.5).normalize();
                }
                let point = numbers.direction() * 0.5;
                let polygon = numbers.polygon(point + toward * 1.5, normal, radius);
                let got = polygon_moments(point, &polygon);
                worst = worst.max(relative_error(&got, &numeric(point, &polygon)));
            }
            // Corners that nearly coincide make slivers. Their conditioning multiplies the rounding of
            // corners near 1 by some hundred.
            assert!(worst < 1e-11 + 3e-15 / radius, "{radius}: {worst}");
        }
    }

    #[test]
    fn the_faces_of_a_cube_make_the_whole_sphere() {
        // From the last point, edges subtend nearly 180 degrees.
        for point in [[0.5, 0.5, 0.5], [0.1, 0.7, 0.9], [1e-6, 0.3, 1e-4]] {
            let mut sum = Moments::default();
            for face in Face::ALL {
                let polygon = face.rectangle([0.0, 1.0], [0.0, 1.0]);
                sum.add(&polygon_moments(DVec3::from_array(point), &polygon), 1.0);
            }
            let third = 4.0 * PI / 3.0;
            let expected = [third, third, third, 0.0, 0.0, 0.0];
            // At a distance h from an edge rounding grows to 1e-16 / h, here 1e-12.
            let tolerance = 2e-12;
            assert!((sum.solid_angle - 4.0 * PI).abs() < tolerance, "{sum:?}");
            assert!(sum.first.length() < tolerance, "{sum:?}");
            for (a, b) in sum.second.iter().zip(expected) {
                assert!((a - b).abs() < tolerance, "{sum:?}");
            }
        }
    }

    #[test]
    fn clipped_parts_add_up_to_the_whole() {
        let mut numbers = Numbers(3);
        let mut scratch = Vec::new();
        for _ in 0..2000 {
            let point = numbers.direction() * (0.2 + numbers.next());
            let normal = numbers.direction();
            let whole = numbers.polygon(DVec3::ZERO, normal, 1.0);
            // Rounding moves the plane by 1e-16, and changes the solid angle by that over the height.
            let height = point.dot(normal).abs();
            let cut = HalfSpace::through(numbers.direction() * 0.3, numbers.direction());
            let away = HalfSpace {
                normal: -cut.normal,
                offset: -cut.offset,
            };
            let mut sum = Moments::default();
            for half_space in [cut, away] {
                let mut part = whole.clone();
                clip_polygon(&mut part, &half_space, &mut scratch);
                sum.add(&polygon_moments(point, &part), 1.0);
            }
            let at_once = polygon_moments(point, &whole);
            sum.add(&at_once, -1.0);
            let error = sum.solid_angle.abs() + sum.first.length() + second_length(&sum);
            assert!(error < 1e-14 + 1e-14 / height, "{error} {height}");
        }
    }

    #[test]
    fn repeated_corners_and_winding_change_nothing() {
        let square = Face::PosZ.rectangle([0.0, 1.0], [0.0, 1.0]);
        let [a, b, c, d] = square;
        for point in [DVec3::new(0.2, 0.3, 0.1), DVec3::new(30.0, 200.0, -70.0)] {
            let plain = polygon_moments(point, &square);
            for other in [
                vec![a, a, b, c, d],
                vec![a, b, b, (b + c) * 0.5, c, d, d],
                vec![d, c, b, a],
            ] {
                // The same sums in another order.
                let error = relative_error(&polygon_moments(point, &other), &plain);
                assert!(error < 1e-12, "{error}");
            }
        }
        let nothing = Moments::default();
        assert_eq!(polygon_moments(DVec3::ZERO, &[a, b]), nothing);
        assert_eq!(polygon_moments(DVec3::ZERO, &[a, b, b]).solid_angle, 0.0);
    }

    #[test]
    fn the_trace_is_the_solid_angle_and_the_projection_the_form_factor() {
        let mut numbers = Numbers(11);
        for _ in 0..2000 {
            let point = numbers.direction() * 0.8;
            let center = point + DVec3::new(0.2, -0.1, 1.5);
            let normal = numbers.direction();
            let polygon = numbers.polygon(center, normal, 1.0);
            let m = polygon_moments(point, &polygon);
            let trace = m.second[0] + m.second[1] + m.second[2];
            assert!((trace - m.solid_angle).abs() < 1e-14);
            let factor = point_to_polygon(point, DVec3::Z, &polygon);
            assert!((m.irradiance_factor(DVec3::Z) - factor).abs() < 1e-14);
        }
    }

    #[test]
    fn a_far_polygon_is_a_point_light_of_its_solid_angle() {
        let center = DVec3::new(2.0, -1.0, 2.0);
        let omega = center / 3.0;
        let normal = DVec3::new(0.48, 0.6, 0.64);
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        for size in [1e-3, 1e-5, 1e-8] {
            let square = [-u - v, u - v, u + v, v - u].map(|corner| center + corner * size);
            let m = polygon_moments(DVec3::ZERO, &square);
            let expected = 4.0 * size * size * normal.dot(omega) / 9.0;
            // The next term is quadratic in size over distance; the corners round to 4e-16.
            let tolerance = size * size + 1e-15 / size;
            assert!((m.solid_angle / expected - 1.0).abs() < tolerance);
            assert!((m.first / expected - omega).length() < tolerance);
            let basis = m.sh9();
            let mut expected_basis = [0.0; 9];
            sh::evaluate(omega, &mut expected_basis);
            for (got, value) in basis.iter().zip(expected_basis) {
                assert!((got / expected - value).abs() < 3.0 * tolerance);
            }
        }
    }

    #[test]
    fn a_point_in_the_plane_or_at_a_corner_gives_finite_moments() {
        let square = Face::PosZ.rectangle([0.0, 1.0], [0.0, 1.0]);
        let beside = polygon_moments(DVec3::new(1.5, 0.5, 1.0), &square);
        assert!(beside.solid_angle < 1e-15 && beside.first.length() < 1e-15);
        for point in [square[0], (square[0] + square[1]) * 0.5] {
            let m = polygon_moments(point, &square);
            assert!(m.sh9().iter().all(|c| c.is_finite()));
        }
    }
}
