//! The lights of a game, and why a frame skips one.

use crate::level::block_index::BlockIndex;
use crate::light::limits::{MAX_LIGHT_VALUE, MAX_LIGHTS};
use glam::Vec3;
use std::f32::consts::PI;

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
        /// Radius, metres, at least 0.
        radius: f32,
        /// Radiant intensity per colour channel, W/sr.
        intensity: Vec3,
    },
    /// A sphere that shines into a cone.
    Spot {
        /// Centre, metres.
        position: Vec3,
        /// Radius, metres, at least 0.
        radius: f32,
        /// Radiant intensity on the axis per colour channel, W/sr.
        intensity: Vec3,
        /// Direction of the axis, away from the light; need not be of unit length.
        direction: Vec3,
        /// Angle from the axis, radians, within which the intensity is full.
        inner_angle: f32,
        /// Angle from the axis, radians, beyond which there is no light; from the inner angle to π.
        outer_angle: f32,
    },
    /// Parallel light that enters through openings that lead outside.
    Directional {
        /// Direction in which the light travels; need not be of unit length.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, per colour channel, W/m².
        irradiance: Vec3,
    },
}

impl Light {
    /// A diffuse sphere; see [`Light::Sphere`] for units.
    pub const fn sphere(position: Vec3, radius: f32, intensity: Vec3) -> Self {
        Light::Sphere {
            position,
            radius,
            intensity,
        }
    }

    /// A sphere that shines along `direction`. `cone` has the inner and the outer angle, radians. See [`Light::Spot`]
    /// for the meaning and units of all values.
    pub const fn spot(
        position: Vec3,
        radius: f32,
        intensity: Vec3,
        direction: Vec3,
        cone: [f32; 2],
    ) -> Self {
        Light::Spot {
            position,
            radius,
            intensity,
            direction,
            inner_angle: cone[0],
            outer_angle: cone[1],
        }
    }

    /// Parallel light; see [`Light::Directional`] for units.
    pub const fn directional(direction: Vec3, irradiance: Vec3) -> Self {
        Light::Directional {
            direction,
            irradiance,
        }
    }

    /// Checks every value of the light, but not whether it is in a block.
    pub(crate) fn check(&self) -> Result<(), LightError> {
        let number = |what, value: f32, low, high| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(LightError::OutOfRange {
                    what,
                    low,
                    high,
                    found: value,
                })
            }
        };
        let numbers = |what, values: Vec3, low: f32| {
            let mut values = values.to_array().into_iter();
            values.try_for_each(|value| number(what, value, low, MAX_LIGHT_VALUE))
        };
        let axis = |direction: Vec3| {
            numbers("direction", direction, -MAX_LIGHT_VALUE)?;
            match direction.as_dvec3().try_normalize() {
                Some(_) => Ok(()),
                None => Err(LightError::NoDirection { found: direction }),
            }
        };
        let sphere = |position: Vec3, radius: f32, intensity: Vec3| {
            numbers("position", position, -MAX_LIGHT_VALUE)?;
            number("radius", radius, 0.0, MAX_LIGHT_VALUE)?;
            numbers("intensity", intensity, 0.0)
        };
        match *self {
            Light::Sphere {
                position,
                radius,
                intensity,
            } => sphere(position, radius, intensity),
            Light::Spot {
                position,
                radius,
                intensity,
                direction,
                inner_angle,
                outer_angle,
            } => {
                axis(direction)?;
                number("outer angle", outer_angle, 0.0, PI)?;
                number("inner angle", inner_angle, 0.0, outer_angle)?;
                sphere(position, radius, intensity)
            }
            Light::Directional {
                direction,
                irradiance,
            } => {
                axis(direction)?;
                numbers("irradiance", irradiance, 0.0)
            }
        }
    }
}

/// Why a frame skips a light. Its other lights shine nevertheless.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LightError {
    /// A value is NaN, infinite, too large, or negative where it must not be.
    #[error("{what} is {found}; expected a number in [{low}, {high}]")]
    OutOfRange {
        /// Which property.
        what: &'static str,
        /// Smallest accepted.
        low: f32,
        /// Largest accepted.
        high: f32,
        /// The value given.
        found: f32,
    },
    /// A direction has length 0.
    #[error("direction is {found}; expected a vector that is not zero")]
    NoDirection {
        /// The vector given.
        found: Vec3,
    },
    /// The light is in a wall or outside the level.
    #[error("position {found} m lies in no block; expected a point inside the level")]
    OutsideBlocks {
        /// The position given.
        found: Vec3,
    },
    /// The light is in the cube of a tube, but outside the round wall.
    #[error(
        "position {found} m lies in the cube of block {block}, outside the round wall of its tube; expected a point \
         inside the tube"
    )]
    OutsideTube {
        /// The tube.
        block: BlockIndex,
        /// The position given.
        found: Vec3,
    },
    /// The frame has [`MAX_LIGHTS`] other lights already.
    #[error("the frame has {MAX_LIGHTS} other lights; expected at most {MAX_LIGHTS} in all")]
    TooMany,
}
