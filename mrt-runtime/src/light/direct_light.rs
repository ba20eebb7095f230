//! Direct light at the texels: the first stage of a frame (Loos et al. 2011, section 7.3, step 1).
//!
//! [`irradiance`] is the reference, one point at a time and with any shadows; `add_beam` does a whole block with
//! vector instructions.

mod add_beam;

pub use add_beam::{TexelPlanes, add_beam};

use crate::light::placed::{Light, PlacedLight};
use crate::light::visibility::{Openings, Receiver, Toward, Visibility};
use crate::modular::scene::Scene;
use glam::{DVec3, Vec3};
use mrt_core::lighting::sphere_light::sphere_light_irradiance;

/// Irradiance, W/m² per channel, from one light at one point of a surface with unit `normal`.
pub fn irradiance<V: Visibility>(
    scene: &Scene,
    placed: &PlacedLight,
    doors: &[f32],
    receiver: Receiver,
    normal: DVec3,
    visibility: &V,
) -> Vec3 {
    let (toward, unshadowed) = match (placed.light, placed.block) {
        (
            Light::Directional {
                direction,
                irradiance,
            },
            _,
        ) => {
            let to_light = -direction.as_dvec3().normalize();
            let cosine = normal.dot(to_light).max(0.0) as f32;
            (Toward::Infinity(to_light), irradiance * cosine)
        }
        (
            Light::Sphere {
                position,
                radius,
                intensity,
            },
            Some(block),
        ) => {
            let position = position.as_dvec3();
            let offset = position - receiver.position;
            let factor = bounded_irradiance(offset, normal, radius);
            (Toward::Point { position, block }, intensity * factor)
        }
        (
            Light::Spot {
                position,
                radius,
                intensity,
                direction,
                inner_angle,
                outer_angle,
            },
            Some(block),
        ) => {
            let position = position.as_dvec3();
            let offset = position - receiver.position;
            let cone = cone_falloff(-offset, direction.as_dvec3(), inner_angle, outer_angle);
            let factor = cone * bounded_irradiance(offset, normal, radius);
            (Toward::Point { position, block }, intensity * factor)
        }
        // Lights with a position always have a block; see `light::place`.
        _ => return Vec3::ZERO,
    };
    if unshadowed == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let fraction = visibility.fraction(scene, doors, receiver, toward);
    // Callers' functions may return anything: what is not a positive number lets no light through.
    if fraction > 0.0 {
        unshadowed * fraction.min(1.0)
    } else {
        Vec3::ZERO
    }
}

/// Adds one light's irradiance in a block, found texel by texel with the shadows of `Openings`: what an
/// [exact](crate::light::beam::Beam::exact) beam asks for.
///
/// `place` is the block's in the scene's [`Layout`](crate::modular::scene::Layout); `out` has red, green and blue, one value a slot.
/// Cost: up to microseconds a texel.
///
/// # Panics
/// If the block has more slots than `out`.
pub fn add_exact(
    scene: &Scene,
    place: usize,
    light: &PlacedLight,
    doors: &[f32],
    out: [&mut [f32]; 3],
) {
    let slots = scene.layout.slots[place].clone();
    let block = scene.layout.order[place] as usize;
    let [red, green, blue] = out;
    for slot in 0..slots.len() {
        let normal = scene.surface.normals.get(slots.start + slot).as_dvec3();
        if normal == DVec3::ZERO {
            continue;
        }
        let position = scene.surface.positions.get(slots.start + slot).as_dvec3();
        let receiver = Receiver { block, position };
        let found = irradiance(scene, light, doors, receiver, normal, &Openings);
        red[slot] += found.x;
        green[slot] += found.y;
        blue[slot] += found.z;
    }
}

/// Distance, metres, below which a light of smaller radius no longer gets brighter: it keeps products
/// with the brightest light finite in `f32`.
pub(crate) const MIN_RADIUS: f64 = 1e-6;

fn bounded_irradiance(offset: DVec3, normal: DVec3, radius: f32) -> f32 {
    sphere_light_irradiance(offset, normal, f64::from(radius).max(MIN_RADIUS)) as f32
}

/// 1 within the inner angle, 0 beyond the outer one, smooth between.
fn cone_falloff(from_light: DVec3, axis: DVec3, inner: f32, outer: f32) -> f32 {
    // A receiver at the light's centre is in no direction from it, and gets no light anyway.
    if from_light == DVec3::ZERO {
        return 0.0;
    }
    let angle = from_light.angle_between(axis) as f32;
    if angle <= inner {
        return 1.0;
    }
    if angle >= outer {
        return 0.0;
    }
    let t = (outer - angle) / (outer - inner);
    t * t * (3.0 - 2.0 * t)
}
