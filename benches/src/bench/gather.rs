//! One-bounce gathering by ray tracing: rays of cosine density from each texel, and direct light where they end.

use super::rays::{RayScene, Traced, WallPoint};
use super::setting::ALBEDO;
use glam::Vec3;
use mrt_core::lighting::sampling::{cosine_hemisphere_from_square, sobol_point, square_from_unit};
use std::time::Instant;

/// Irradiance at points of walls from `count` rays each.
pub fn trace(scene: &RayScene, receivers: &[WallPoint], count: usize) -> Traced {
    let start = Instant::now();
    let gather = |(seed, receiver): (u32, &WallPoint)| {
        let (tangent, bitangent) = receiver.normal.any_orthonormal_pair();
        let mut sum = Vec3::ZERO;
        for k in 0..count as u32 {
            let square = square_from_unit(sobol_point(k, seed));
            let local = cosine_hemisphere_from_square(square).as_vec3();
            let direction = local.x * tangent + local.y * bitangent + local.z * receiver.normal;
            if let Some(hit) = scene.first_hit(receiver.position, direction) {
                sum += ALBEDO * scene.direct(&hit);
            }
        }
        (sum / count.max(1) as f32).to_array().map(f64::from)
    };
    let irradiance = (0u32..).zip(receivers).map(gather).collect();
    Traced {
        start_seconds: 0.0,
        receiver_seconds: start.elapsed().as_secs_f64() / receivers.len().max(1) as f64,
        irradiance,
    }
}
