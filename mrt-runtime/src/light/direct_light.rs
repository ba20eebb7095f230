//! Direct light at the texels: the first stage of a frame (Loos et al. 2011, section 7.3, step 1).
//!
//! [`irradiance`] is the reference: one point at a time, with any shadows. `add_beam` lights a whole block with vector
//! instructions.

pub mod add_beam;

use crate::level::block_index::BlockIndex;
use crate::level::placed::PlacedLevel;
use crate::light::direct_light::add_beam::TexelPlanes;
use crate::light::limits::MIN_RADIUS;
use crate::light::placed::PlacedLight;
use crate::light::source::Light;
use crate::light::visibility::{Receiver, Toward, Visibility};
use glam::{DVec3, Vec3};
use mrt_core::lighting::sphere_light::sphere_light_irradiance;

/// What shadows depend on: walls and openings, doors, and the test of visibility.
#[derive(Debug)]
pub struct Shadows<'a, V> {
    /// Blocks and openings of the level.
    pub level: &'a PlacedLevel,
    /// Fraction of light that each door lets through.
    pub doors: &'a [f32],
    /// Decides which part of a light reaches a point.
    pub visibility: &'a V,
}

impl<V> Clone for Shadows<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Shadows<'_, V> {}

/// Irradiance, W/m² per channel, from one light at one point of a surface with unit `normal`.
pub fn irradiance<V: Visibility>(
    shadows: Shadows<'_, V>,
    placed: &PlacedLight,
    receiver: Receiver,
    normal: DVec3,
) -> Vec3 {
    let Some((toward, unshadowed)) = unshadowed_irradiance(placed, receiver.position, normal)
    else {
        return Vec3::ZERO;
    };
    if unshadowed == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let visibility = shadows.visibility;
    let fraction = visibility.fraction(shadows.level, shadows.doors, receiver, toward);
    // A caller's function may return any number: NaN and negative numbers let no light through.
    if fraction > 0.0 {
        unshadowed * fraction.min(1.0)
    } else {
        Vec3::ZERO
    }
}

/// The way to a light from a point, and the light's irradiance there without shadows; `None` for a light that is off.
fn unshadowed_irradiance(
    placed: &PlacedLight,
    point: DVec3,
    normal: DVec3,
) -> Option<(Toward, Vec3)> {
    let (position, radius, intensity) = match placed.light {
        Light::Directional {
            direction,
            irradiance,
        } => {
            let to_light = -direction.as_dvec3().normalize();
            let cosine = normal.dot(to_light).max(0.0) as f32;
            return Some((Toward::Infinity(to_light), irradiance * cosine));
        }
        #[rustfmt::skip]
        Light::Sphere { position, radius, intensity }
        | Light::Spot { position, radius, intensity, .. } => (position.as_dvec3(), radius, intensity),
    };
    let block = placed.block?;
    let offset = position - point;
    let factor = match placed.light {
        Light::Spot {
            direction,
            inner_angle,
            outer_angle,
            ..
        } => cone_falloff(-offset, direction.as_dvec3(), inner_angle, outer_angle),
        _ => 1.0,
    };
    let factor = factor * bounded_irradiance(offset, normal, radius);
    Some((Toward::Point { position, block }, intensity * factor))
}

/// Adds the irradiance of one light in a block, with a test of shadow for each texel. For blocks with an
/// [exact](crate::light::beam::Beam::exact) beam.
///
/// `out` has red, green and blue, one value for each slot, as long as the slices of `texels`. Cost: up to microseconds
/// a texel.
///
/// # Panics
/// If the slices differ in length.
pub fn add_exact<V: Visibility>(
    shadows: Shadows<'_, V>,
    block: BlockIndex,
    texels: &TexelPlanes<'_>,
    light: &PlacedLight,
    out: [&mut [f32]; 3],
) {
    let [red, green, blue] = out;
    let vector = |planes: &[&[f32]; 3], slot: usize| {
        Vec3::new(planes[0][slot], planes[1][slot], planes[2][slot]).as_dvec3()
    };
    for slot in 0..red.len() {
        let normal = vector(&texels.normals, slot);
        if normal == DVec3::ZERO {
            continue;
        }
        let position = vector(&texels.positions, slot);
        let receiver = Receiver { block, position };
        let found = irradiance(shadows, light, receiver, normal);
        red[slot] += found.x;
        green[slot] += found.y;
        blue[slot] += found.z;
    }
}

/// Irradiance per intensity of a sphere light whose radius is at least [`MIN_RADIUS`].
fn bounded_irradiance(offset: DVec3, normal: DVec3, radius: f32) -> f32 {
    sphere_light_irradiance(offset, normal, f64::from(radius).max(MIN_RADIUS)) as f32
}

/// 1 within the inner angle from the axis, 0 beyond the outer angle, smooth between.
fn cone_falloff(from_light: DVec3, axis: DVec3, inner: f32, outer: f32) -> f32 {
    // A receiver at the light's centre has no direction from it, and gets no light anyway.
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
