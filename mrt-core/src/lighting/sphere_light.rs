//! Irradiance from spherical lights.

use glam::DVec3;

/// Irradiance per unit of radiant intensity, in 1/m², from an isotropic sphere of the given `radius` (m) on
/// a surface with unit `normal`. `offset` (m) leads from the surface point to the centre of the sphere.
///
/// It is `cos θ / max(d², r²)`: exact for an unoccluded diffuse sphere that is wholly above the horizon, and
/// at most 1/r² where a surface touches or enters the sphere. Zero behind the surface.
pub fn sphere_light_irradiance(offset: DVec3, normal: DVec3, radius: f64) -> f64 {
    let squared = offset.length_squared();
    let bounded = squared.max(radius * radius);
    if squared == 0.0 {
        return 0.0;
    }
    let cosine = normal.dot(offset) / squared.sqrt();
    cosine.max(0.0) / bounded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn irradiance_falls_with_the_square_of_the_distance_and_is_bounded() {
        let at = |d: f64| sphere_light_irradiance(DVec3::Y * d, DVec3::Y, 0.1);
        assert_eq!(at(2.0), 0.25);
        assert_eq!(at(0.01), at(0.1));
        assert_eq!(at(-1.0), 0.0);
        assert_eq!(at(0.0), 0.0);
    }
}
