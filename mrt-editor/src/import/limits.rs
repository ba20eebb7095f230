//! What a scene may measure.

/// Larger files are refused before they are read.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// Only this much of a material library is read.
pub const MAX_LIBRARY_BYTES: u64 = 16 << 20;

/// Larger coordinates, in metres, are refused: squared distances have to stay finite.
pub const MAX_COORDINATE_M: f64 = 1e9;

/// Mean albedos of walls are moved into this range: a wall of albedo 0 never shows a bounce, and between walls of albedo 1
/// light never dies out.
pub const ALBEDO_RANGE: [f32; 2] = [0.05, 0.9];

/// Images with a longer side, in texels, are not read.
pub const MAX_IMAGE_SIDE: u32 = 16_384;

/// Images that need more memory to decode are not read.
pub const MAX_DECODED_BYTES: u64 = 512 << 20;

/// Albedo of what states no colour.
pub const UNSTATED_ALBEDO: f32 = 0.53;
