//! A beam's light on the texels of its block, many texels at once.
//!
//! The formulas are those of [`irradiance`](crate::light::direct_light::irradiance) in `f32`; a polynomial gives the
//! angle from a spot's axis.

use crate::light::beam::Beam;
use crate::light::limits::MIN_RADIUS;
use crate::light::placed::PlacedLight;
use crate::light::source::Light;
use glam::Vec3;
use mrt_core::simd::{Kernel, Lanes, SimdLevel, WIDEST};
use std::f32::consts::PI;

/// Texels of a block, coordinate by coordinate, padded to a multiple of [`WIDEST`]. Padding has zero normals and finite
/// positions.
#[derive(Clone, Copy, Debug)]
pub struct TexelPlanes<'a> {
    /// x, y and z of the world positions, metres.
    pub positions: [&'a [f32]; 3],
    /// x, y and z of the unit normals into the block.
    pub normals: [&'a [f32]; 3],
}

/// Adds the irradiance, W/m², of one beam to `out`: red, green and blue, as long as the slices of `texels`. Padding
/// gets exactly
/// 0. The beam must not be [exact](Beam::exact).
///
/// At lit texels, the result differs from [`irradiance`](crate::light::direct_light::irradiance) by a factor of at most
/// 1 ± 1e-5 and, since cosines are rounded, by 1e-6 of the irradiance on a surface that faces the light. Between the
/// angles of a spot, the falloff is that of an angle within 2e-6 rad. A texel within 1e-15 m of a light's centre gets
/// too little; at the centre it gets nothing.
///
/// Cost: 20 to 40 instructions for each group of texels that fills the lanes of `level`, and 4 for each plane of the
/// beam.
///
/// # Panics
/// If the slices differ in length, or if their length is not a multiple of [`WIDEST`].
pub fn add_beam(
    level: SimdLevel,
    texels: &TexelPlanes<'_>,
    light: &PlacedLight,
    beam: &Beam,
    out: [&mut [f32]; 3],
) {
    debug_assert!(!beam.exact, "planes do not bound the beam");
    let count = texels.positions[0].len();
    let lengths = texels.positions.iter().chain(&texels.normals);
    assert!(lengths.map(|s| s.len()).all(|n| n == count), "texel slices");
    assert!(out.iter().all(|s| s.len() == count), "output slices");
    assert_eq!(count % WIDEST, 0, "padding");
    let (texels, fraction) = (*texels, beam.fraction);
    match light.light {
        Light::Directional {
            direction,
            irradiance,
        } => level.run(AddBeam {
            source: Parallel {
                toward: -direction.as_dvec3().normalize().as_vec3(),
            },
            texels,
            beam,
            color: irradiance * fraction,
            out,
        }),
        Light::Sphere {
            radius, intensity, ..
        } => level.run(AddBeam {
            source: Sphere::new(radius),
            texels,
            beam,
            color: intensity * fraction,
            out,
        }),
        Light::Spot {
            radius,
            intensity,
            direction,
            inner_angle,
            outer_angle,
            ..
        } => level.run(AddBeam {
            source: Spot {
                sphere: Sphere::new(radius),
                axis: direction.as_dvec3().normalize().as_vec3(),
                inner: inner_angle,
                per_radian: 1.0 / (outer_angle - inner_angle).max(NARROWEST),
            },
            texels,
            beam,
            color: intensity * fraction,
            out,
        }),
    }
}

/// Smallest difference, radians, between the angles of a spot: the polynomial resolves no less. A spot with a hard edge
/// gets it.
const NARROWEST: f32 = 1e-6;

/// Smallest distance, metres, at which directions from a light keep all their digits: its square is a normal number.
const NEAREST: f32 = 1e-15;

/// A light whose irradiance on texels is computed without shadows.
trait Unshadowed: Copy {
    /// Irradiance on texels per intensity, or per irradiance of a light at infinity. `offset` leads from the beam's
    /// origin to the texels.
    fn factor<L: Lanes>(self, l: L, offset: [L::V; 3], normal: [L::V; 3]) -> L::V;
}

#[derive(Clone, Copy)]
struct Parallel {
    toward: Vec3,
}

#[derive(Clone, Copy)]
struct Sphere {
    radius_squared: f32,
}

#[derive(Clone, Copy)]
struct Spot {
    sphere: Sphere,
    axis: Vec3,
    inner: f32,
    per_radian: f32,
}

struct AddBeam<'a, S> {
    source: S,
    texels: TexelPlanes<'a>,
    beam: &'a Beam,
    color: Vec3,
    out: [&'a mut [f32]; 3],
}

impl<S: Unshadowed> Kernel for AddBeam<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let origin = splat3(l, self.beam.origin);
        let color = splat3(l, self.color);
        let planes = self.beam.planes();
        let [red, green, blue] = self.out;
        let count = red.len();
        let (green, blue) = (&mut green[..count], &mut blue[..count]);
        let [px, py, pz] = self.texels.positions.map(|s| &s[..count]);
        let [nx, ny, nz] = self.texels.normals.map(|s| &s[..count]);
        for at in (0..count).step_by(L::N) {
            let offset = [
                l.sub(l.load(&px[at..]), origin[0]),
                l.sub(l.load(&py[at..]), origin[1]),
                l.sub(l.load(&pz[at..]), origin[2]),
            ];
            let mut inside = l.splat(0.0);
            for &[x, y, z, w] in planes {
                let across = dot(l, offset, splat3(l, Vec3::new(x, y, z)));
                inside = l.min(inside, l.add(across, l.splat(w)));
            }
            // Half of a beam's texels and more may be in shadow, and computing their light costs more than this test.
            if !planes.is_empty() && l.largest(inside) < 0.0 {
                continue;
            }
            let normal = [l.load(&nx[at..]), l.load(&ny[at..]), l.load(&nz[at..])];
            let factor = self.source.factor(l, offset, normal);
            let factor = l.keep_where_ge(inside, l.splat(0.0), factor);
            for (c, out) in [&mut *red, &mut *green, &mut *blue].into_iter().enumerate() {
                let sum = l.mul_add(color[c], factor, l.load(&out[at..]));
                l.store(&mut out[at..], sum);
            }
        }
    }
}

impl Unshadowed for Parallel {
    #[inline(always)]
    fn factor<L: Lanes>(self, l: L, _: [L::V; 3], normal: [L::V; 3]) -> L::V {
        l.max(dot(l, normal, splat3(l, self.toward)), l.splat(0.0))
    }
}

impl Sphere {
    fn new(radius: f32) -> Self {
        let radius = f64::from(radius).max(MIN_RADIUS);
        Self {
            radius_squared: (radius * radius) as f32,
        }
    }

    /// The irradiance per intensity, and the distance from the light.
    #[inline(always)]
    fn at<L: Lanes>(self, l: L, offset: [L::V; 3], normal: [L::V; 3]) -> (L::V, L::V) {
        let squared = l.max(dot(l, offset, offset), l.splat(NEAREST * NEAREST));
        let distance = l.sqrt(squared);
        let bounded = l.max(squared, l.splat(self.radius_squared));
        // The offset leads away from the light.
        let height = l.max(l.sub(l.splat(0.0), dot(l, normal, offset)), l.splat(0.0));
        (l.div(height, l.mul(distance, bounded)), distance)
    }
}

impl Unshadowed for Sphere {
    #[inline(always)]
    fn factor<L: Lanes>(self, l: L, offset: [L::V; 3], normal: [L::V; 3]) -> L::V {
        self.at(l, offset, normal).0
    }
}

impl Unshadowed for Spot {
    #[inline(always)]
    fn factor<L: Lanes>(self, l: L, offset: [L::V; 3], normal: [L::V; 3]) -> L::V {
        let (factor, distance) = self.sphere.at(l, offset, normal);
        let per_metre = l.div(l.splat(1.0), distance);
        let direction = [
            l.mul(offset[0], per_metre),
            l.mul(offset[1], per_metre),
            l.mul(offset[2], per_metre),
        ];
        let angle = angle_between(l, direction, splat3(l, self.axis));
        // t is 1 up to the inner angle, and 0 from the outer angle on.
        let past = l.mul(l.sub(angle, l.splat(self.inner)), l.splat(self.per_radian));
        let t = l.min(l.max(l.sub(l.splat(1.0), past), l.splat(0.0)), l.splat(1.0));
        let smooth = l.mul(l.mul(t, t), l.sub(l.splat(3.0), l.add(t, t)));
        l.mul(factor, smooth)
    }
}

/// asin(√z) / √z for z in [0, 0.505], within 1.1e-7: the polynomial through its values at eight Chebyshev nodes.
const ASIN: [f32; 8] = [
    1.0,
    0.166_669_85,
    0.074_870_4,
    0.046_626_408,
    0.015_804_72,
    0.078_535_14,
    -0.094_843_99,
    0.112_620_25,
];

/// Angle between unit vectors, radians, within 2e-6 everywhere from 0 to π. It is computed from the chord, which is
/// twice the sine of half the angle, because the cosine loses its digits near 0 and π.
#[inline(always)]
fn angle_between<L: Lanes>(l: L, a: [L::V; 3], b: [L::V; 3]) -> L::V {
    let (zero, two) = (l.splat(0.0), l.splat(2.0));
    // 1 up to a right angle, else -1: the second vector is then reversed.
    let sign = l.sub(l.keep_where_ge(dot(l, a, b), zero, two), l.splat(1.0));
    let chord = [
        l.sub(a[0], l.mul(sign, b[0])),
        l.sub(a[1], l.mul(sign, b[1])),
        l.sub(a[2], l.mul(sign, b[2])),
    ];
    let squared = dot(l, chord, chord);
    let z = l.mul(squared, l.splat(0.25));
    let mut series = l.splat(ASIN[7]);
    for k in (0..7).rev() {
        series = l.mul_add(series, z, l.splat(ASIN[k]));
    }
    // Twice the arc sine of half the chord.
    let angle = l.mul(l.sqrt(squared), series);
    let turned = l.mul(l.sub(l.splat(1.0), sign), l.splat(0.5 * PI));
    l.mul_add(sign, angle, turned)
}

#[inline(always)]
fn splat3<L: Lanes>(l: L, v: Vec3) -> [L::V; 3] {
    [l.splat(v.x), l.splat(v.y), l.splat(v.z)]
}

#[inline(always)]
fn dot<L: Lanes>(l: L, a: [L::V; 3], b: [L::V; 3]) -> L::V {
    l.mul_add(a[2], b[2], l.mul_add(a[1], b[1], l.mul(a[0], b[0])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    struct Angles<'a>(&'a [Vec3; 16], Vec3, &'a mut [f32; 16]);

    impl Kernel for Angles<'_> {
        type Output = ();
        #[inline(always)]
        fn run<L: Lanes>(self, l: L) {
            for at in (0..16).step_by(L::N) {
                let coordinate = |c: usize| self.0.map(|v| v[c]);
                let a = [0, 1, 2].map(|c| l.load(&coordinate(c)[at..]));
                l.store(&mut self.2[at..], angle_between(l, a, splat3(l, self.1)));
            }
        }
    }

    #[test]
    fn angles_are_exact_from_0_to_pi() {
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        let aside = axis.any_orthonormal_vector();
        for level in SimdLevel::available() {
            let mut worst = 0.0f64;
            for k in 0..1000 {
                let angles: [f64; 16] = std::array::from_fn(|i| {
                    let t = f64::from(16 * k + i as i32) / 15999.0;
                    // Dense at both ends, where the cosine has no digits.
                    std::f64::consts::PI * t * t * (3.0 - 2.0 * t)
                });
                let vectors =
                    angles.map(|x| (x.cos() * axis + x.sin() * aside).normalize().as_vec3());
                let mut found = [0.0; 16];
                level.run(Angles(&vectors, axis.as_vec3(), &mut found));
                for (vector, found) in vectors.iter().zip(found) {
                    let expected = vector.as_dvec3().angle_between(axis);
                    worst = worst.max((f64::from(found) - expected).abs());
                }
            }
            assert!(worst < 2e-6, "{}: {worst:e}", level.name());
        }
    }
}
