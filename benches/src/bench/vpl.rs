//! Indirect light from virtual point lights with shadow rays (Keller, "Instant radiosity", SIGGRAPH 1997).
//!
//! Light paths end at their first wall, which makes one bounce. Close to a virtual light the geometric term is bounded: no
//! distance counts as less than the radius of the disc that the light stands for.

use super::lit_maze::ALBEDO;
use super::rays::{RayPoint, RayScene, Traced};
use glam::Vec3;
use mrt_core::lighting::sampling::{sobol_point, sphere_from_square, square_from_unit};
use std::f32::consts::PI;
use std::time::Instant;

/// Area of the walls around a lamp, m², which its virtual lights share.
const LIT_AREA: f32 = 6.0;

/// The light that a wall reflects where a ray from a lamp meets it.
struct VirtualLight {
    at: RayPoint,
    /// W, RGB.
    flux: Vec3,
}

/// Irradiance at points of walls from `count` virtual lights: the same number for each lamp, at least one.
pub fn trace(scene: &RayScene, receivers: &[RayPoint], count: usize) -> Traced {
    let start = Instant::now();
    let per_light = (count / scene.lamps().len()).max(1);
    let mut virtual_lights = Vec::with_capacity(per_light * scene.lamps().len());
    for (index, lamp) in (0u32..).zip(scene.lamps()) {
        for k in 0..per_light as u32 {
            let square = square_from_unit(sobol_point(k, index));
            let direction = sphere_from_square(square).as_vec3();
            if let Some(at) = scene.first_hit(lamp.position, direction) {
                let flux = ALBEDO * lamp.intensity * (4.0 * PI / per_light as f32);
                virtual_lights.push(VirtualLight { at, flux });
            }
        }
    }
    let least_squared = LIT_AREA / (PI * per_light as f32);
    let after_start = Instant::now();
    let gather = |receiver: &RayPoint| {
        let mut sum = Vec3::ZERO;
        for VirtualLight { at, flux } in &virtual_lights {
            let offset = at.position - receiver.position;
            let (here, there) = (offset.dot(receiver.normal), -offset.dot(at.normal));
            if here <= 0.0 || there <= 0.0 || !scene.sees(receiver.position, at.position) {
                continue;
            }
            let squared = offset.length_squared();
            // Both cosines, over the square of a distance that is not too small.
            let geometric = here * there / (squared * squared.max(least_squared));
            sum += *flux * (geometric / PI);
        }
        sum.to_array().map(f64::from)
    };
    let irradiance = receivers.iter().map(gather).collect();
    Traced {
        start_seconds: (after_start - start).as_secs_f64(),
        receiver_seconds: after_start.elapsed().as_secs_f64() / receivers.len().max(1) as f64,
        irradiance,
    }
}
