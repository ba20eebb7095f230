//! Largest values that lights and surfaces may have.

/// Intensities, irradiances, radii, coordinates and emissions above this are refused. With distances that count from
/// 1e-6 m on, and sums over lights and texels, results then stay in the range of `f32`.
pub const MAX_LIGHT_VALUE: f32 = 1e9;

/// Most lights of one frame.
pub const MAX_LIGHTS: usize = 1024;

/// Distance, metres, below which a light of smaller radius no longer gets brighter: products with the brightest light
/// then stay finite in `f32`.
pub(crate) const MIN_RADIUS: f64 = 1e-6;
