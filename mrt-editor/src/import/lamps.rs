//! Lamps of a file as lights of a level.

use super::raw_mesh::{LampKind, RawLamp};
use glam::{DAffine3, Vec3};
use mrt_runtime::Light;

/// Spheres and spots get a radius of 0, since files state none. `level_from_file` takes points of the file to those of the
/// level.
///
/// Intensities are multiplied by the square of the scale: light on the surfaces is then the same in any unit.
///
/// `None` for a lamp with a value that is not finite, or whose direction has no length.
pub(super) fn light(lamp: &RawLamp, level_from_file: &DAffine3) -> Option<Light> {
    let position = level_from_file.transform_point3(lamp.position).as_vec3();
    let turned = level_from_file.transform_vector3(lamp.direction);
    let scale_squared = level_from_file.matrix3.determinant().cbrt().powi(2);
    let intensity = (lamp.intensity.as_dvec3() * scale_squared).as_vec3();
    let direction = || turned.try_normalize().map(|unit| unit.as_vec3());
    let is_sound = |values: Vec3| values.is_finite();
    if !is_sound(lamp.intensity) || lamp.intensity.min_element() < 0.0 {
        return None;
    }
    match lamp.kind {
        LampKind::Sun => Some(Light::directional(direction()?, lamp.intensity)),
        _ if !(is_sound(position) && is_sound(intensity)) => None,
        LampKind::Point => Some(Light::sphere(position, 0.0, intensity)),
        LampKind::Spot {
            inner_angle,
            outer_angle,
        } => {
            let outer = outer_angle.clamp(0.0, std::f32::consts::PI);
            let cone = [inner_angle.clamp(0.0, outer), outer];
            let is_cone = !(inner_angle.is_nan() || outer_angle.is_nan());
            is_cone.then_some(Light::spot(position, 0.0, intensity, direction()?, cone))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use mrt_core::geometry::mesh::Y_UP_FROM_Z_UP;

    fn lamp(kind: LampKind) -> RawLamp {
        RawLamp {
            kind,
            position: DVec3::new(100.0, 0.0, 300.0),
            direction: DVec3::NEG_Z,
            intensity: Vec3::splat(40.0),
        }
    }

    #[test]
    fn lamps_are_scaled_turned_and_moved_with_the_mesh() {
        let scale = DAffine3::from_scale(DVec3::splat(0.01));
        let turn = DAffine3::from_mat3(Y_UP_FROM_Z_UP);
        let level_from_file = DAffine3::from_translation(-DVec3::X) * turn * scale;
        let spot = lamp(LampKind::Spot {
            inner_angle: 0.5,
            outer_angle: 0.25,
        });
        let Some(Light::Spot {
            position,
            intensity,
            direction,
            inner_angle,
            outer_angle,
            ..
        }) = light(&spot, &level_from_file)
        else {
            panic!("expected a spot");
        };
        assert!(position.distance(Vec3::new(0.0, 3.0, 0.0)) < 1e-6);
        assert!(direction.distance(Vec3::NEG_Y) < 1e-6);
        // 40 W/sr at a distance of 100 units lights like 0.004 W/sr at 1 m.
        assert!((intensity.x - 0.004).abs() < 1e-6, "{intensity}");
        assert_eq!([inner_angle, outer_angle], [0.25, 0.25]);
        let sun = light(&lamp(LampKind::Sun), &level_from_file).expect("a sun");
        let Light::Directional { irradiance, .. } = sun else {
            panic!("expected a sun, found {sun:?}");
        };
        assert_eq!(irradiance, Vec3::splat(40.0));
    }

    #[test]
    fn lamps_with_values_that_are_no_numbers_are_none() {
        for kind in [LampKind::Point, LampKind::Sun] {
            let faulty = RawLamp {
                intensity: Vec3::NAN,
                ..lamp(kind)
            };
            assert_eq!(light(&faulty, &DAffine3::IDENTITY), None);
        }
        let nowhere = RawLamp {
            direction: DVec3::ZERO,
            ..lamp(LampKind::Sun)
        };
        assert_eq!(light(&nowhere, &DAffine3::IDENTITY), None);
    }
}
