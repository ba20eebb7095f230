//! Light straight from a lamp, as a frame computes it at texels.

use glam::Vec3;
use mrt_core::lighting::sampling::{sphere_from_square, square_from_unit};
use mrt_runtime::Light;

/// Centre of a lamp, metres; `None` for the sun.
pub fn position(light: &Light) -> Option<Vec3> {
    match *light {
        Light::Sphere { position, .. } | Light::Spot { position, .. } => Some(position),
        Light::Directional { .. } => None,
    }
}

/// Irradiance without shadows on a surface with a unit normal, W/m².
pub fn unshadowed(light: &Light, point: Vec3, normal: Vec3) -> Vec3 {
    match *light {
        Light::Sphere {
            position,
            radius,
            intensity,
        } => intensity * of_sphere(position - point, normal, radius),
        Light::Spot {
            position,
            radius,
            intensity,
            direction,
            inner_angle,
            outer_angle,
        } => {
            let angle = (point - position).angle_between(direction);
            let t = (outer_angle - angle) / (outer_angle - inner_angle).max(f32::EPSILON);
            let t = t.clamp(0.0, 1.0);
            let in_cone = t * t * (3.0 - 2.0 * t);
            intensity * (in_cone * of_sphere(position - point, normal, radius))
        }
        Light::Directional {
            direction,
            irradiance,
        } => irradiance * normal.dot(-direction.normalize_or_zero()).max(0.0),
    }
}

/// Irradiance by unit intensity: `cos θ / max(d², radius²)`.
fn of_sphere(offset: Vec3, normal: Vec3, radius: f32) -> f32 {
    let squared = offset.length_squared().max(radius * radius);
    if squared == 0.0 {
        return 0.0;
    }
    normal.dot(offset.normalize_or_zero()).max(0.0) / squared
}

/// The way from a point to a place on the lamp that a point of the unit square chooses; for the sun, to a place `reach`
/// metres away.
pub fn way_to(light: &Light, point: Vec3, unit: glam::DVec2, reach: f32) -> Vec3 {
    match *light {
        Light::Sphere {
            position, radius, ..
        }
        | Light::Spot {
            position, radius, ..
        } => {
            let on_lamp = sphere_from_square(square_from_unit(unit)).as_vec3() * radius;
            position + on_lamp - point
        }
        Light::Directional { direction, .. } => -direction.normalize_or_zero() * reach,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_fade_from_the_inner_to_the_outer_angle_and_the_sun_nowhere() {
        let spot = Light::spot(Vec3::Y, 0.1, Vec3::splat(2.0), Vec3::NEG_Y, [0.2, 0.6]);
        let at = |angle: f32| unshadowed(&spot, Vec3::X * angle.tan(), Vec3::Y).x;
        let sphere = Light::sphere(Vec3::Y, 0.1, Vec3::splat(2.0));
        let all = |angle: f32| unshadowed(&sphere, Vec3::X * angle.tan(), Vec3::Y).x;
        assert_eq!(at(0.0), 2.0);
        assert_eq!(at(0.1), all(0.1));
        // In the middle a smooth step is at one half; angles are good to some 1e-4 rad in f32.
        assert!((at(0.4) / all(0.4) - 0.5).abs() < 1e-3);
        assert_eq!(at(0.7), 0.0);
        let sun = Light::directional(2.0 * Vec3::NEG_Y, Vec3::ONE);
        assert_eq!(unshadowed(&sun, Vec3::splat(99.0), Vec3::Y), Vec3::ONE);
        assert_eq!(unshadowed(&sun, Vec3::ZERO, Vec3::NEG_Y), Vec3::ZERO);
        assert_eq!(
            way_to(&sun, Vec3::ZERO, glam::DVec2::ZERO, 5.0),
            5.0 * Vec3::Y
        );
    }
}
