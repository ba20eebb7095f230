//! Lights that a game sets every frame, and what is refused about them.

use crate::modular::scene::Scene;
use glam::{DVec3, Vec3};

/// Intensities, irradiances, radii and coordinates above this are refused: together with the smallest
/// distance that counts, 1e-6 m, and sums over lights and texels, results stay in the range of `f32`.
pub const MAX_LIGHT_VALUE: f32 = 1e9;

/// A light may stand outside every block by this many block widths, and counts as in the first such block.
pub const WALL_TOLERANCE: f64 = 1e-4;

/// A source of direct light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A diffuse sphere: irradiance is `intensity cos θ / max(d², radius²)`.
    ///
    /// Keep the radius at 1.6 texels or more where a light may touch a wall: direct light is sampled at
    /// texel centres, and a smaller hot spot falls between them.
    Sphere {
        /// Centre, metres.
        position: Vec3,
        /// Metres, at least 0.
        radius: f32,
        /// Radiant intensity per colour channel, W/sr.
        intensity: Vec3,
    },
    /// A sphere that shines into a cone.
    Spot {
        /// Centre, metres.
        position: Vec3,
        /// Metres, at least 0.
        radius: f32,
        /// Radiant intensity on the axis per colour channel, W/sr.
        intensity: Vec3,
        /// Along the axis, away from the light; need not be of unit length.
        direction: Vec3,
        /// Full intensity within this angle from the axis, radians.
        inner_angle: f32,
        /// No light beyond this angle, radians, from the inner angle to π.
        outer_angle: f32,
    },
    /// Parallel light that enters through openings that lead outside.
    Directional {
        /// In which the light travels; need not be of unit length.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, per colour channel, W/m².
        irradiance: Vec3,
    },
}

/// Why a light is refused. Nothing of the frame has changed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LightError {
    /// NaN, infinite, negative where it must not be, or absurdly large.
    #[error("light {light}: {what} is {found}; expected a number in [{low}, {high}]")]
    OutOfRange {
        /// Which light.
        light: usize,
        /// Which property.
        what: &'static str,
        /// Smallest accepted.
        low: f32,
        /// Largest accepted.
        high: f32,
        /// The value given.
        found: f32,
    },
    /// A direction of no length.
    #[error("light {light}: direction is {found}; expected a vector that is not zero")]
    NoDirection {
        /// Which light.
        light: usize,
        /// The vector given.
        found: Vec3,
    },
    /// In a wall, or outside the level.
    #[error(
        "light {light}: position {found} m lies in no block; expected a point inside the level"
    )]
    OutsideBlocks {
        /// Which light.
        light: usize,
        /// The position given.
        found: Vec3,
    },
    /// In the cube of a tube, outside its wall.
    #[error(
        "light {light}: position {found} m lies in the cube of block {block}, outside the round wall of its tube; \
         expected a point inside the tube"
    )]
    OutsideTube {
        /// Which light.
        light: usize,
        /// The tube.
        block: usize,
        /// The position given.
        found: Vec3,
    },
}

/// A light whose values have been checked, and the block that it stands in. Made by [`place`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedLight {
    pub(crate) light: Light,
    /// `None` for directional lights.
    pub(crate) block: Option<usize>,
}

/// Checks one light, number `index` of the caller's, and finds its block.
///
/// # Errors
/// [`LightError`].
pub fn place(scene: &Scene, index: usize, light: Light) -> Result<PlacedLight, LightError> {
    let check = |what, value: f32, low, high| {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(LightError::OutOfRange {
                light: index,
                what,
                low,
                high,
                found: value,
            })
        }
    };
    let check_all = |what, values: Vec3, low, high| {
        values
            .to_array()
            .into_iter()
            .try_for_each(|value| check(what, value, low, high))
    };
    let check_direction = |direction: Vec3| {
        check_all("direction", direction, -MAX_LIGHT_VALUE, MAX_LIGHT_VALUE)?;
        if direction.as_dvec3().try_normalize().is_none() {
            return Err(LightError::NoDirection {
                light: index,
                found: direction,
            });
        }
        Ok(())
    };
    let find_block = |position: Vec3, radius: f32, intensity: Vec3| {
        check_all("position", position, -MAX_LIGHT_VALUE, MAX_LIGHT_VALUE)?;
        check("radius", radius, 0.0, MAX_LIGHT_VALUE)?;
        check_all("intensity", intensity, 0.0, MAX_LIGHT_VALUE)?;
        let point: DVec3 = position.as_dvec3();
        scene
            .block_at(point, WALL_TOLERANCE)
            .map(Some)
            .ok_or_else(|| match scene.tube_around(point) {
                Some(block) => LightError::OutsideTube {
                    light: index,
                    block,
                    found: position,
                },
                None => LightError::OutsideBlocks {
                    light: index,
                    found: position,
                },
            })
    };
    let block = match light {
        Light::Sphere {
            position,
            radius,
            intensity,
        } => find_block(position, radius, intensity)?,
        Light::Spot {
            position,
            radius,
            intensity,
            direction,
            inner_angle,
            outer_angle,
        } => {
            check_direction(direction)?;
            check("outer angle", outer_angle, 0.0, std::f32::consts::PI)?;
            check("inner angle", inner_angle, 0.0, outer_angle)?;
            find_block(position, radius, intensity)?
        }
        Light::Directional {
            direction,
            irradiance,
        } => {
            check_direction(direction)?;
            check_all("irradiance", irradiance, 0.0, MAX_LIGHT_VALUE)?;
            None
        }
    };
    Ok(PlacedLight { light, block })
}
