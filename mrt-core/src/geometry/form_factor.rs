//! Form factors from a point to a polygon in closed form, and the polygon clipping that makes them exact
//! behind openings.
//!
//! Lambert's formula: the fraction of the cosine-weighted hemisphere over a point that a polygon covers
//! is a sum over its edges. Each edge adds the angle that it subtends, times the component of the unit
//! normal of its plane through the point along the surface normal, over 2π. Irradiance from a polygon of
//! uniform radiosity B is that fraction times B.

use glam::DVec3;

/// Fraction of the cosine-weighted hemisphere at `point` around unit `normal` that a planar polygon
/// covers, in [0, 1].
///
/// The polygon may wind either way. It must lie in the half-space `(x - point) · normal >= 0` (clip it
/// with [`clip_polygon`] first where it may not), and must not contain `point`.
pub fn point_to_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    let Some(&last) = polygon.last() else {
        return 0.0;
    };
    let mut from = last - point;
    for &corner in polygon {
        let to = corner - point;
        let across = from.cross(to);
        let sine = across.length();
        // An edge in line with the point subtends no angle.
        if sine > 0.0 {
            let angle = libm::atan2(sine, from.dot(to));
            sum += angle * across.dot(normal) / sine;
        }
        from = to;
    }
    (sum * (0.5 / std::f64::consts::PI)).abs()
}

/// The side of a plane that clipping keeps: `normal · x >= offset`.
#[derive(Clone, Copy, Debug)]
pub struct HalfSpace {
    /// Points into the half-space. It need not have unit length.
    pub normal: DVec3,
    /// The value of `normal · x` on the plane.
    pub offset: f64,
}

impl HalfSpace {
    /// The half-space with the given normal whose plane passes through `point`.
    pub fn through(point: DVec3, normal: DVec3) -> Self {
        Self {
            normal,
            offset: normal.dot(point),
        }
    }

    /// Signed distance of a point from the plane, times the length of `normal`: positive inside.
    pub fn side(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// Fills `cone` with the half-spaces of the cone that starts at `apex` and passes through the edges of a
/// convex `portal`. The interior of the portal is on the kept side of each.
///
/// Edges shorter than rounding, or in line with the apex, bound nothing and are left out.
pub fn cone_through(apex: DVec3, portal: &[DVec3], cone: &mut Vec<HalfSpace>) {
    cone.clear();
    let center = portal.iter().copied().sum::<DVec3>() / portal.len() as f64;
    for (k, &a) in portal.iter().enumerate() {
        let b = portal[(k + 1) % portal.len()];
        let normal = (a - apex).cross(b - apex);
        let inward = normal.dot(center - apex);
        let length = normal.length();
        if length <= 1e-14 || inward == 0.0 {
            continue;
        }
        let normal = normal / (length * inward.signum());
        cone.push(HalfSpace::through(apex, normal));
    }
}

/// Cuts a convex polygon by a half-space (Sutherland and Hodgman). `polygon` becomes the part inside;
/// `scratch` is overwritten.
pub fn clip_polygon(polygon: &mut Vec<DVec3>, half_space: &HalfSpace, scratch: &mut Vec<DVec3>) {
    scratch.clear();
    let Some(&last) = polygon.last() else {
        return;
    };
    let mut from = last;
    let mut from_side = half_space.side(from);
    for &to in polygon.iter() {
        let to_side = half_space.side(to);
        if (from_side < 0.0) != (to_side < 0.0) {
            let t = from_side / (from_side - to_side);
            scratch.push(from + (to - from) * t);
        }
        if to_side >= 0.0 {
            scratch.push(to);
        }
        from = to;
        from_side = to_side;
    }
    std::mem::swap(polygon, scratch);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cube::Face;

    /// Mean over the -z face of the factor to another face, by a midpoint rule of 40² points.
    fn face_to_face(to: Face) -> f64 {
        const STEPS: usize = 40;
        let target = to.rectangle([0.0, 1.0], [0.0, 1.0]);
        let mut sum = 0.0;
        for j in 0..STEPS {
            for i in 0..STEPS {
                let point = Face::NegZ.texel_center(STEPS, j, i);
                sum += point_to_polygon(point, DVec3::Z, &target);
            }
        }
        sum / (STEPS * STEPS) as f64
    }

    #[test]
    fn opposite_faces_of_a_cube_match_the_closed_form() {
        // For unit squares at distance 1: F = 2/π (ln √(4/3) + 2 √2 atan(1/√2) - π/2). The midpoint rule
        // over 40² points errs by less than 1e-4.
        let exact = 2.0 / std::f64::consts::PI
            * ((4.0f64 / 3.0).sqrt().ln() + 2.0 * 2f64.sqrt() * (1.0 / 2f64.sqrt()).atan()
                - std::f64::consts::FRAC_PI_2);
        assert!((face_to_face(Face::PosZ) - exact).abs() < 1e-4);
        // The rest goes to the four sides in equal parts. Their factor has a kink at the shared edge, so
        // the midpoint rule errs more.
        assert!((face_to_face(Face::PosX) - (1.0 - exact) / 4.0).abs() < 1e-3);
    }

    #[test]
    fn a_closed_box_covers_the_hemisphere() {
        let point = Face::NegY.texel_center(16, 0, 3);
        let sum: f64 = Face::ALL
            .into_iter()
            .filter(|&face| face != Face::NegY)
            .map(|face| point_to_polygon(point, DVec3::Y, &face.rectangle([0.0, 1.0], [0.0, 1.0])))
            .sum();
        assert!((sum - 1.0).abs() < 1e-14, "{sum}");
    }

    #[test]
    fn clipped_parts_add_up_to_the_whole() {
        let square = Face::PosZ.rectangle([0.0, 1.0], [0.0, 1.0]);
        let point = DVec3::new(0.3, 0.4, 0.0);
        let cut = HalfSpace::through(DVec3::new(0.2, 0.7, 1.0), DVec3::new(1.0, -0.3, 0.1));
        let away = HalfSpace {
            normal: -cut.normal,
            offset: -cut.offset,
        };
        let mut scratch = Vec::new();
        let mut parts = 0.0;
        for half_space in [cut, away] {
            let mut polygon = square.to_vec();
            clip_polygon(&mut polygon, &half_space, &mut scratch);
            parts += point_to_polygon(point, DVec3::Z, &polygon);
        }
        assert!((parts - point_to_polygon(point, DVec3::Z, &square)).abs() < 1e-14);
    }

    #[test]
    fn the_cone_through_a_portal_keeps_its_inside() {
        let portal = Face::PosZ.rectangle([0.0, 1.0], [0.0, 1.0]);
        let mut cone = Vec::new();
        cone_through(DVec3::new(0.5, 0.5, 0.0), &portal, &mut cone);
        assert_eq!(cone.len(), 4);
        let inside = DVec3::new(0.5, 0.6, 3.0);
        let outside = DVec3::new(5.0, 0.5, 3.0);
        assert!(cone.iter().all(|half| half.side(inside) > 0.0));
        assert!(cone.iter().any(|half| half.side(outside) < 0.0));
    }
}
