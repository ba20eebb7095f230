//! Where the lamps of `mrt light` stand.

use super::args::{LightArg, LightArgs};
use super::error::LightCommandError;
use crate::render::lit::Lamp;
use crate::render::placement::{Surroundings, block_width, light_places};
use glam::Vec3;
use mrt_runtime::Level;
use mrt_runtime::low_level::output::receiver::ReceiverMap;

/// A lamp's radius where none is given, in widths of its block: 1.6 texels of the standard dictionary.
const LAMP_RADIUS: f64 = 0.1;

/// Colours that default lamps take in turn, warm and cool, so that one sees whose light is where.
const DEFAULT_TINTS: [Vec3; 2] = [Vec3::new(1.0, 0.85, 0.65), Vec3::new(0.7, 0.85, 1.0)];

/// Blocks for each lamp that is placed when none is given, and lamps at most.
const BLOCKS_A_LAMP: usize = 12;
const MOST_DEFAULT_LAMPS: usize = 6;

/// Distance outside a block, in its widths, up to which a lamp counts as inside.
const SLACK: f64 = 1e-3;

/// The lamps asked for, or a few in the largest blocks.
pub(super) fn lamps(
    args: &LightArgs,
    level: &Level,
    receivers: &ReceiverMap,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<Lamp>, LightCommandError> {
    if args.light.is_empty() {
        return default_lamps(args, level, surroundings);
    }
    let mut lamps = Vec::with_capacity(args.light.len());
    for (index, light) in args.light.iter().enumerate() {
        // The frame refuses all other faulty numbers by name.
        let radius = if light.position.is_finite() {
            let block = check_place(index, light, level, receivers, surroundings)?;
            block.map_or(0.0, |block| radius_in(level, block))
        } else {
            0.0
        };
        lamps.push(Lamp {
            position: light.position,
            radius: args.light_radius.unwrap_or(radius),
            intensity: light.colour * light.intensity,
        });
    }
    Ok(lamps)
}

fn default_lamps(
    args: &LightArgs,
    level: &Level,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<Lamp>, LightCommandError> {
    let wanted = level.blocks.len().div_ceil(BLOCKS_A_LAMP);
    let places = light_places(surroundings, level, wanted.min(MOST_DEFAULT_LAMPS));
    if places.is_empty() {
        return Err(LightCommandError::NoPlace);
    }
    let lamps = places.into_iter().enumerate().map(|(index, place)| {
        let width = block_width(&level.blocks[place.block].warp);
        let radius = radius_in(level, place.block);
        Lamp {
            position: place.position,
            radius: args.light_radius.unwrap_or(radius),
            // About 1 W/m² on the walls of its block.
            intensity: DEFAULT_TINTS[index % DEFAULT_TINTS.len()] * (0.25 * width * width) as f32,
        }
    });
    Ok(lamps.collect())
}

/// The block that a light is in; an error if it is outside the level or inside a wall.
fn check_place(
    index: usize,
    light: &LightArg,
    level: &Level,
    receivers: &ReceiverMap,
    surroundings: &Surroundings<'_>,
) -> Result<Option<usize>, LightCommandError> {
    let position = light.position;
    let Some((block, distance)) = receivers.nearest_block(position) else {
        return Ok(None);
    };
    let block = block.get();
    if distance > SLACK * block_width(&level.blocks[block].warp) {
        return Err(LightCommandError::OutsideBlocks {
            light: index,
            position,
            block,
            distance,
        });
    }
    if surroundings.is_in_wall(position) {
        return Err(LightCommandError::InWall {
            light: index,
            position,
            backs: 100.0 * surroundings.look_around(position).backs,
        });
    }
    Ok(Some(block))
}

/// Metres.
fn radius_in(level: &Level, block: usize) -> f32 {
    (LAMP_RADIUS * block_width(&level.blocks[block].warp)) as f32
}
