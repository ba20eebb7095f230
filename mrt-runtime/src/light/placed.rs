//! A light together with the block that contains it.

use crate::level::block_index::BlockIndex;
use crate::level::placed::PlacedLevel;
use crate::light::source::{Light, LightError};
use glam::Vec3;

/// A light whose values have been checked, and the block that contains it. Made by [`place`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedLight {
    pub(crate) light: Light,
    /// `None` for directional lights, and for lights that are off.
    pub(crate) block: Option<BlockIndex>,
}

impl PlacedLight {
    /// A light that is off. It stands for a light that was removed or is skipped.
    pub(crate) const OFF: Self = Self {
        light: Light::sphere(Vec3::ZERO, 0.0, Vec3::ZERO),
        block: None,
    };
}

/// Checks the values of a light and finds its block. Cost: independent of the number of blocks.
///
/// # Errors
/// [`LightError`], if a value is out of range or the light is in no block.
pub fn place(level: &PlacedLevel, light: Light) -> Result<PlacedLight, LightError> {
    light.check()?;
    let position = match light {
        Light::Sphere { position, .. } | Light::Spot { position, .. } => position,
        Light::Directional { .. } => return Ok(PlacedLight { light, block: None }),
    };
    let point = position.as_dvec3();
    if let Some(block) = level.block_at(point) {
        let block = Some(block);
        return Ok(PlacedLight { light, block });
    }
    Err(match level.tube_around(point) {
        Some(block) => LightError::OutsideTube {
            block,
            found: position,
        },
        None => LightError::OutsideBlocks { found: position },
    })
}
