//! Where the lamps of `mrt light` stand.

use super::args::{LightArg, LightArgs};
use super::error::LightCommandError;
use super::view::level_origin;
use crate::cli::output::warn;
use crate::render::lamp::position;
use crate::render::placement::{Surroundings, block_width, light_places};
use glam::{DVec3, Vec3};
use mrt_runtime::low_level::light::limits::MAX_LIGHTS;
use mrt_runtime::low_level::output::receiver::ReceiverMap;
use mrt_runtime::{Level, Light};

/// A lamp's radius where none is given, in widths of its block: 1.6 texels of the standard dictionary.
const LAMP_RADIUS: f64 = 0.1;

/// Colours that default lamps take in turn, warm and cool, so that one sees whose light is where.
const DEFAULT_TINTS: [Vec3; 2] = [Vec3::new(1.0, 0.85, 0.65), Vec3::new(0.7, 0.85, 1.0)];

/// Blocks for each lamp that is placed when none is given, and lamps at most.
const BLOCKS_A_LAMP: usize = 12;
const MOST_DEFAULT_LAMPS: usize = 6;

/// Distance outside a block, in its widths, up to which a lamp counts as inside.
const SLACK: f64 = 1e-3;

/// A level in its mesh.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) level: &'a Level,
    pub(super) receivers: &'a ReceiverMap,
    pub(super) surroundings: &'a Surroundings<'a>,
}

/// The lamps, and whether they are the mesh's.
pub(super) struct Lamps {
    pub(super) lights: Vec<Light>,
    pub(super) of_mesh: bool,
}

/// The lamps asked for; else those of the mesh's file; else, unless walls shine, a few in the largest blocks.
pub(super) fn lamps(
    args: &LightArgs,
    of_file: &[Light],
    place: Place<'_>,
) -> Result<Lamps, LightCommandError> {
    let not_of_mesh = |lights| Lamps {
        lights,
        of_mesh: false,
    };
    if !args.light.is_empty() {
        if !of_file.is_empty() {
            warn(format_args!(
                "the mesh's {} lamps are not used, since --light is given",
                of_file.len()
            ));
        }
        return lamps_asked_for(args, place).map(not_of_mesh);
    }
    let lights = lamps_of_file(args, of_file, place);
    if !lights.is_empty() {
        return Ok(Lamps {
            lights,
            of_mesh: true,
        });
    }
    if emissive_walls(place.level) > 0 {
        return Ok(not_of_mesh(Vec::new()));
    }
    default_lamps(args, place).map(not_of_mesh)
}

/// Walls that shine by themselves.
pub(super) fn emissive_walls(level: &Level) -> usize {
    let walls = level.blocks.iter().flat_map(|block| block.emission);
    walls.filter(|&emission| emission != Vec3::ZERO).count()
}

fn lamps_asked_for(args: &LightArgs, place: Place<'_>) -> Result<Vec<Light>, LightCommandError> {
    let origin = level_origin(place.level);
    let mut lamps = Vec::with_capacity(args.light.len());
    for (index, light) in args.light.iter().enumerate() {
        let position = (light.position - origin).as_vec3();
        // The frame refuses all other faulty numbers by name.
        let radius = if position.is_finite() {
            let block = block_of(position, place).map_err(|fault| fault.of(index, light))?;
            block.map_or(0.0, |block| radius_in(place.level, block))
        } else {
            0.0
        };
        let radius = args.light_radius.unwrap_or(radius);
        lamps.push(Light::sphere(
            position,
            radius,
            light.colour * light.intensity,
        ));
    }
    Ok(lamps)
}

/// The file's lamps that stand in the level's rooms. Says how many do not: nobody asked for them one by one.
fn lamps_of_file(args: &LightArgs, of_file: &[Light], place: Place<'_>) -> Vec<Light> {
    let mut lamps = Vec::new();
    let mut faults = [0; 2];
    for lamp in of_file.iter().take(MAX_LIGHTS) {
        let Some(position) = position(lamp) else {
            lamps.push(*lamp);
            continue;
        };
        match block_of(position, place) {
            Ok(block) => {
                let radius = block.map_or(0.0, |block| radius_in(place.level, block));
                lamps.push(with_radius(*lamp, args.light_radius.unwrap_or(radius)));
            }
            Err(Misplaced::Outside { .. }) => faults[0] += 1,
            Err(Misplaced::InWall { .. }) => faults[1] += 1,
        }
    }
    let more = of_file.len().saturating_sub(MAX_LIGHTS);
    for (count, why) in [
        (faults[0], "lie in no block of the level".to_owned()),
        (faults[1], "lie inside a wall".to_owned()),
        (more, format!("are more than the {MAX_LIGHTS} of a frame")),
    ] {
        if count > 0 {
            let all = of_file.len();
            warn(format_args!(
                "warning: {count} of the mesh's {all} lamps are left out: they {why}"
            ));
        }
    }
    lamps
}

fn default_lamps(args: &LightArgs, place: Place<'_>) -> Result<Vec<Light>, LightCommandError> {
    let level = place.level;
    let wanted = level.blocks.len().div_ceil(BLOCKS_A_LAMP);
    let places = light_places(place.surroundings, level, wanted.min(MOST_DEFAULT_LAMPS));
    if places.is_empty() {
        return Err(LightCommandError::NoPlace);
    }
    let lamps = places.into_iter().enumerate().map(|(index, place)| {
        let width = block_width(&level.blocks[place.block].warp);
        let radius = args.light_radius.unwrap_or(radius_in(level, place.block));
        // About 1 W/m² on the walls of its block.
        let tint = DEFAULT_TINTS[index % DEFAULT_TINTS.len()];
        Light::sphere(place.position, radius, tint * (0.25 * width * width) as f32)
    });
    Ok(lamps.collect())
}

/// Why a lamp cannot stand where it is.
enum Misplaced {
    /// Outside every block.
    Outside { block: usize, distance: f64 },
    /// Behind faces, which it sees in so many percent of all directions.
    InWall { backs: f32 },
}

impl Misplaced {
    /// The error for a light of the command line.
    fn of(self, index: usize, light: &LightArg) -> LightCommandError {
        let position: DVec3 = light.position;
        match self {
            Self::Outside { block, distance } => LightCommandError::OutsideBlocks {
                light: index,
                position,
                block,
                distance,
            },
            Self::InWall { backs } => LightCommandError::InWall {
                light: index,
                position,
                backs,
            },
        }
    }
}

/// The block that a point of the level is in; `None` only in a level without blocks.
fn block_of(position: Vec3, place: Place<'_>) -> Result<Option<usize>, Misplaced> {
    let Some((block, distance)) = place.receivers.nearest_block(position) else {
        return Ok(None);
    };
    let block = block.get();
    if distance > SLACK * block_width(&place.level.blocks[block].warp) {
        return Err(Misplaced::Outside { block, distance });
    }
    if place.surroundings.is_in_wall(position) {
        let backs = 100.0 * place.surroundings.look_around(position).backs;
        return Err(Misplaced::InWall { backs });
    }
    Ok(Some(block))
}

/// Metres.
fn radius_in(level: &Level, block: usize) -> f32 {
    (LAMP_RADIUS * block_width(&level.blocks[block].warp)) as f32
}

fn with_radius(mut lamp: Light, to: f32) -> Light {
    if let Light::Sphere { radius, .. } | Light::Spot { radius, .. } = &mut lamp {
        *radius = to;
    }
    lamp
}
