//! Limits of lights and surfaces.

/// Largest intensity, irradiance, radius, coordinate and emission. Since distances count as 1e-6 m at least, sums over
/// lights and texels then stay in the range of `f32`.
pub const MAX_LIGHT_VALUE: f32 = 1e9;

/// Most lights that shine in one frame.
pub const MAX_LIGHTS: usize = 1024;

/// Smallest radius of a light, metres; smaller radii count as this. Products with the brightest light then stay finite
/// in `f32`.
pub(crate) const MIN_RADIUS: f64 = 1e-6;
