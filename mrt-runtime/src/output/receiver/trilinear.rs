//! A hexahedron's map in monomials, for millions of inverse lookups.

use glam::{DMat3, DVec3};
use mrt_core::geometry::hexahedron::Hexahedron;

/// Steps of Newton's method after which a point counts as out of reach.
const MOST_STEPS: usize = 16;

/// `c0 + cx x + cy y + cz z + cxy xy + cxz xz + cyz yz + cxyz xyz`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trilinear {
    constant: DVec3,
    linear: [DVec3; 3],
    /// Of yz, xz and xy: by the axis that is missing.
    mixed: [DVec3; 3],
    cubic: DVec3,
    /// Square of the distance at which a lookup is near enough.
    tolerance_squared: f64,
}

impl Trilinear {
    /// The hexahedron's map.
    pub fn new(warp: &Hexahedron) -> Self {
        let c = &warp.corners;
        // About a ten-thousandth of a texel.
        let tolerance = 1e-6 * warp.diagonal();
        Self {
            constant: c[0],
            linear: [c[1] - c[0], c[2] - c[0], c[4] - c[0]],
            mixed: [
                c[6] - c[4] - c[2] + c[0],
                c[5] - c[4] - c[1] + c[0],
                c[3] - c[2] - c[1] + c[0],
            ],
            cubic: c[7] - c[6] - c[5] - c[3] + c[1] + c[2] + c[4] - c[0],
            tolerance_squared: tolerance * tolerance,
        }
    }

    /// World position of a point of the unit cube.
    pub fn point(&self, DVec3 { x, y, z }: DVec3) -> DVec3 {
        self.constant
            + self.linear[0] * x
            + self.linear[1] * y
            + self.linear[2] * z
            + self.mixed[0] * (y * z)
            + self.mixed[1] * (x * z)
            + self.mixed[2] * (x * y)
            + self.cubic * (x * y * z)
    }

    /// Derivatives by x, y and z, as columns.
    fn jacobian(&self, DVec3 { x, y, z }: DVec3) -> DMat3 {
        let [x_line, y_line, z_line] = self.linear;
        let [yz, xz, xy] = self.mixed;
        DMat3::from_cols(
            x_line + xz * z + xy * y + self.cubic * (y * z),
            y_line + yz * z + xy * x + self.cubic * (x * z),
            z_line + yz * y + xz * x + self.cubic * (x * y),
        )
    }

    /// The point of the unit cube that maps to `world`; `None` where Newton's method finds none from the guess.
    pub fn inverse(&self, guess: DVec3, world: DVec3) -> Option<DVec3> {
        let mut unit = guess;
        for _ in 0..MOST_STEPS {
            let miss = self.point(unit) - world;
            if miss.length_squared() <= self.tolerance_squared {
                return Some(unit);
            }
            let [x, y, z] = self.gradients(unit)?;
            let step = DVec3::new(x.dot(miss), y.dot(miss), z.dot(miss));
            // Limited, so that a far start cannot jump into a folded region.
            unit -= step.clamp(DVec3::splat(-2.0), DVec3::splat(2.0));
        }
        None
    }

    /// Gradients of x, y and z in the world: normals of the surfaces on which each is constant, towards larger values.
    /// `None` where the map is singular.
    pub fn gradients(&self, unit: DVec3) -> Option<[DVec3; 3]> {
        let jacobian = self.jacobian(unit);
        let [x, y, z] = [jacobian.x_axis, jacobian.y_axis, jacobian.z_axis];
        let normals = [y.cross(z), z.cross(x), x.cross(y)];
        let determinant = x.dot(normals[0]);
        (determinant != 0.0 && determinant.is_finite()).then(|| normals.map(|n| n / determinant))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_core::geometry::cube::Face;

    #[test]
    fn points_and_their_inverses_are_those_of_the_hexahedron() {
        let mut warp = Hexahedron::cuboid(DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 4.0, 9.0));
        for (k, corner) in warp.corners.iter_mut().enumerate() {
            *corner += 0.2
                * DVec3::new(
                    (k as f64).sin(),
                    (3.0 * k as f64).cos(),
                    (5.0 * k as f64).sin(),
                );
        }
        let map = Trilinear::new(&warp);
        for k in 0..50 {
            let unit = DVec3::new(0.31 * k as f64, 0.17 * k as f64, 0.07 * k as f64).fract();
            let world = warp.point(unit);
            // Roundings of sums of eight terms.
            assert!(map.point(unit).distance(world) < 1e-13);
            let back = map.inverse(DVec3::splat(0.5), world).expect("converges");
            assert!(back.distance(unit) < 1e-5);
            let [x, ..] = map.gradients(unit).expect("regular");
            let normal = warp.face_normal(Face::NegX, unit.z, unit.y);
            assert!(x.normalize().dot(normal) > 0.9);
        }
    }
}
