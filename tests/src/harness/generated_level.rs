//! Levels, colours, lights and changes from bytes: frames stay finite, and light never multiplies.

use super::sound::{assert_sound, write_pixels};
use super::target::{Target, mutate_plain};
use crate::dictionaries::mobile_dictionary;
use crate::flux::Flux;
use crate::frames::FrameForTests;
use arbitrary::{Arbitrary, Result, Unstructured};
use glam::{DVec3, Vec3};
use mrt_core::storage::Storage;
use mrt_runtime::blocks::{
    Block, Connection, CubeRotation, Door, Face, Opening, SHAPES, WarpTransport,
};
use mrt_runtime::{
    AssembleConfig, AssembleError, BlockIndex, Bounces, Coupling, Frame, FrameConfig, Level, Light,
    LightId, Outputs, ProbeOrder, Scene, SimdLevel,
};
use std::num::NonZero;

/// Bytes of which a level, its lights and what changes are made.
pub const TARGET: Target = Target {
    name: "generated_level",
    run,
    mutate: mutate_plain,
    words: &[],
};

const MOST_CELLS: usize = 6;
const MOST_STEPS: usize = 12;
const MOST_PASSES: u32 = 20;
const SCENE_BYTES: usize = 64 << 20;

/// More flux than walls reflect and emit may arrive by this share. Frames scale down any excess above 5 %; the rest is
/// rounding of sums of up to a few thousand texels in `f32`.
const GAIN: f64 = 0.051;

/// Makes a level and lights it. Bytes that run out count as zeros.
pub fn run(bytes: &[u8]) {
    // An error means that a list of choices was empty, which none is.
    let _ = try_level(&mut Unstructured::new(bytes));
}

fn try_level(source: &mut Unstructured<'_>) -> Result<()> {
    let level = level(source)?;
    let check = level.check();
    let config = assemble_config(source)?;
    let assembled = Scene::assemble(&level, mobile_dictionary(), &config);
    let scene = match (assembled, check) {
        (Ok(scene), Ok(())) => scene,
        (Err(AssembleError::Level(found)), Err(expected)) => {
            // Compared as text, since NaN is not equal to itself.
            assert_eq!(found.to_string(), expected.to_string());
            return Ok(());
        }
        (Err(error), Ok(())) => {
            assert!(!matches!(error, AssembleError::Level(_)), "{error}");
            assert!(!error.to_string().is_empty());
            return Ok(());
        }
        (_, Err(error)) => panic!("assembled in spite of: {error}"),
    };
    let mut frame = Frame::new(&scene, frame_config(source)?);
    let mut bound = EnergyBound::default();
    let mut lights = Vec::new();
    for _ in 0..source.int_in_range(1..=MOST_STEPS)? {
        change(source, &mut frame, &mut lights)?;
        if bool::arbitrary(source)? {
            solve(&mut frame, &mut bound);
        }
    }
    solve(&mut frame, &mut bound);
    Ok(())
}

fn solve(frame: &mut Frame, bound: &mut EnergyBound) {
    let report = frame.solve();
    assert_sound(frame);
    write_pixels(frame, &report);
    bound.check(frame, report.passes());
}

/// Most flux that can be in a level, by channel: a pass adds no more than walls reflect of direct light and emit.
#[derive(Default)]
struct EnergyBound {
    allowed: [f64; 3],
    /// Most that was sent so far.
    sent: [f64; 3],
}

impl EnergyBound {
    fn check(&mut self, frame: &Frame, passes: u32) {
        let flux = Flux::unweighted(frame);
        let (reflected, emitted) = (flux.reflected(&frame.direct()), flux.emitted());
        let arrived = flux.arrived(&frame.indirect());
        // Light that waits for its turn may be of earlier frames, and twice as much; light that is kept within the
        // tolerance may be brighter by it on every texel.
        let config = frame.config();
        let waiting = if config.slice.is_some() { 2.0 } else { 1.0 };
        // An infinite tolerance times no pass would be NaN.
        let tolerance = match config.tolerance > 0.0 {
            true => f64::from(config.tolerance.min(f32::MAX)),
            false => 0.0,
        };
        let kept = 2.0 * tolerance * frame.scene().texel_count() as f64;
        for c in 0..3 {
            self.sent[c] = self.sent[c].max(reflected[c] + emitted[c]);
            let sent = self.sent[c] + kept;
            self.allowed[c] += f64::from(passes) * waiting * (1.0 + GAIN) * sent;
            let (arrived, allowed) = (arrived[c], self.allowed[c]);
            assert!(arrived <= allowed, "{arrived} arrived, of {allowed}");
        }
    }
}

/// A number of any kind; most are in [0, 1].
fn number(source: &mut Unstructured<'_>) -> Result<f32> {
    const SPECIAL: [f32; 12] = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -0.0,
        -1.0,
        1e-45,
        1e-6,
        1.0,
        1e9,
        1.1e9,
        f32::MAX,
        f32::MIN_POSITIVE,
    ];
    Ok(match u8::arbitrary(source)? {
        0 => *source.choose(&SPECIAL)?,
        1 => f32::from_bits(u32::arbitrary(source)?),
        2 => 1e9 * f32::from(u8::arbitrary(source)?) / 255.0,
        other => f32::from(other - 3) / 252.0,
    })
}

fn vector(source: &mut Unstructured<'_>) -> Result<Vec3> {
    Ok(Vec3::new(number(source)?, number(source)?, number(source)?))
}

/// A colour in [0, 1], mostly.
fn colour(source: &mut Unstructured<'_>) -> Result<Vec3> {
    if source.ratio(1, 32)? {
        return vector(source);
    }
    let channel = |byte: u8| f32::from(byte) / 255.0;
    let [r, g, b] = <[u8; 3]>::arbitrary(source)?;
    Ok(Vec3::new(channel(r), channel(g), channel(b)))
}

/// Connected or scattered cells, and then some faults.
fn level(source: &mut Unstructured<'_>) -> Result<Level> {
    let mut cells = vec![[0i32; 3]];
    for _ in 0..source.int_in_range(0..=MOST_CELLS - 1)? {
        let mut cell = *source.choose(&cells)?;
        match u8::arbitrary(source)? {
            // Levels of the dictionary are flat; others are refused in the end.
            0 => cell[1] += 1,
            1 => cell = [i32::arbitrary(source)?, 0, i32::arbitrary(source)?],
            other => cell[usize::from(other & 2)] += i32::from(other & 1) * 2 - 1,
        }
        if !cells.contains(&cell) {
            cells.push(cell);
        }
    }
    let joined = u64::arbitrary(source)?;
    let is_joined = |a: usize, b: usize| joined >> (a * b % 64) & 1 == 0;
    let albedo = colour(source)?;
    let Ok(mut level) = Level::from_joined_cells(&cells, albedo, is_joined) else {
        return Ok(Level::default());
    };
    bend(source, &mut level)?;
    for block in &mut level.blocks {
        if source.ratio(1, 4)? {
            let face = *source.choose(&Face::ALL)?;
            block.albedo[face.index()] = colour(source)?;
        }
        if source.ratio(1, 4)? {
            let face = *source.choose(&Face::ALL)?;
            block.emission[face.index()] = vector(source)?;
        }
        if source.ratio(1, 16)? {
            spoil(source, block)?;
        }
    }
    join(source, &mut level)?;
    Ok(level)
}

/// Moves all corners by a shear, which leaves joined faces joined, and rarely one corner by itself.
fn bend(source: &mut Unstructured<'_>, level: &mut Level) -> Result<()> {
    let part = |source: &mut Unstructured<'_>| -> Result<f64> {
        Ok((f64::from(u8::arbitrary(source)?) - 128.0) / 200.0)
    };
    if source.ratio(1, 2)? {
        let (x, z, height) = (part(source)?, part(source)?, part(source)?);
        let size = *source.choose(&[1.0, 1.0, 1e-3, 1e3, 1e-20, 1e20])?;
        let corners = level.blocks.iter_mut().flat_map(|b| &mut b.warp.corners);
        for corner in corners {
            let DVec3 { x: a, y: b, z: c } = *corner;
            *corner = DVec3::new(a + x * c, b * (1.0 + height), c + z * b) * size;
        }
    }
    if source.ratio(1, 8)? {
        let block = source.choose_index(level.blocks.len())?;
        let corner = &mut level.blocks[block].warp.corners[source.int_in_range(0..=7)?];
        *corner += DVec3::new(part(source)?, part(source)?, part(source)?) * 0.5;
    }
    Ok(())
}

/// Gives a block something that it should not have, maybe.
fn spoil(source: &mut Unstructured<'_>, block: &mut Block) -> Result<()> {
    match source.int_in_range(0..=3)? {
        0 => block.shape = source.choose(&SHAPES)?,
        1 => {
            let turns: Vec<CubeRotation> = CubeRotation::all().collect();
            block.orientation = *source.choose(&turns)?;
        }
        2 => block.transport = *source.choose(&WarpTransport::ALL)?,
        _ => {
            let corner = source.int_in_range(0..=7)?;
            let axis = source.int_in_range(0..=2)?;
            block.warp.corners[corner][axis] = f64::from_bits(u64::arbitrary(source)?);
        }
    }
    Ok(())
}

/// Removes connections, adds doors, and rarely adds a connection that should not be.
fn join(source: &mut Unstructured<'_>, level: &mut Level) -> Result<()> {
    let removed = u64::arbitrary(source)? & u64::arbitrary(source)?;
    let mut index = 0;
    level.connections.retain(|_| {
        index += 1;
        removed >> (index % 64) & 1 == 0
    });
    let is_odd = source.ratio(1, 16)?;
    for connection in 0..level.connections.len() + usize::from(is_odd) {
        if source.ratio(1, 3)? {
            let value = number(source)?;
            level.doors.push(Door { connection, value });
        }
    }
    if source.ratio(1, 16)? {
        let end = |source: &mut Unstructured<'_>| -> Result<Opening> {
            Ok(Opening {
                block: source.int_in_range(0..=level.blocks.len())?,
                face: *source.choose(&Face::ALL)?,
            })
        };
        let (a, b) = (end(source)?, end(source)?);
        level.connections.push(Connection { a, b });
    }
    Ok(())
}

fn assemble_config(source: &mut Unstructured<'_>) -> Result<AssembleConfig> {
    Ok(AssembleConfig {
        coupling: *source.choose(&[Coupling::Table, Coupling::Lightfield])?,
        max_depth: source.int_in_range(0..=6)?,
        max_bytes: SCENE_BYTES,
        shape_storage: *source.choose(&Storage::ALL)?,
        transport_storage: *source.choose(&Storage::ALL)?,
        negligible: source.ratio(1, 4)?.then(|| number(source)).transpose()?,
    })
}

fn frame_config(source: &mut Unstructured<'_>) -> Result<FrameConfig> {
    Ok(FrameConfig {
        outputs: Outputs {
            lightmap: bool::arbitrary(source)?,
            probes: *source.choose(&[None, Some(ProbeOrder::L1), Some(ProbeOrder::L2)])?,
            vector: bool::arbitrary(source)?,
        },
        bounces: bounces(source)?,
        simd: *source.choose(&SimdLevel::ALL)?,
        tolerance: match source.ratio(1, 4)? {
            true => number(source)?,
            false => 0.0,
        },
        slice: match source.ratio(1, 4)? {
            true => NonZero::new(source.int_in_range(1..=3)?),
            false => None,
        },
        ..FrameConfig::default()
    })
}

fn bounces(source: &mut Unstructured<'_>) -> Result<Bounces> {
    let limit = source.int_in_range(0..=MOST_PASSES)?;
    Ok(match source.int_in_range(0..=3)? {
        0 => Bounces::Count(limit),
        1 => Bounces::Count(1),
        2 => Bounces::Feedback,
        _ => Bounces::Converged {
            tolerance: number(source)?,
            limit,
        },
    })
}

/// A light in or near the first blocks, mostly.
fn light(source: &mut Unstructured<'_>, scene: &Scene) -> Result<Light> {
    let block = &scene.level.blocks[source.choose_index(scene.level.blocks.len())?];
    let unit = vector(source)?.as_dvec3();
    let position = block.warp.point(unit).as_vec3();
    let (radius, intensity) = (number(source)?, vector(source)?);
    let direction = vector(source)? - Vec3::splat(0.5);
    Ok(match source.int_in_range(0..=2)? {
        0 => Light::sphere(position, radius, intensity),
        1 => {
            let cone = [number(source)?, 3.0 * number(source)?];
            Light::spot(position, radius, intensity, direction, cone)
        }
        _ => Light::directional(direction, intensity),
    })
}

/// Changes one thing of a frame, or asks it something.
fn change(
    source: &mut Unstructured<'_>,
    frame: &mut Frame,
    lights: &mut Vec<LightId>,
) -> Result<()> {
    let scene = frame.scene().clone();
    let block = BlockIndex::new(source.int_in_range(0..=scene.level.blocks.len())?);
    match source.int_in_range(0..=9)? {
        0..=2 => lights.push(frame.add_light(light(source, &scene)?)),
        3 if !lights.is_empty() => {
            let id = *source.choose(lights)?;
            frame.set_light(id, light(source, &scene)?);
        }
        4 if !lights.is_empty() => {
            let id = *source.choose(lights)?;
            frame.remove_light(id);
        }
        5 => {
            // Refused or not: the frame goes on.
            let _ = frame.set_door(source.int_in_range(0..=3)?, number(source)?);
        }
        6 => {
            let count = scene.level.block(block).map_or(0, |b| b.texels.len());
            let _ = frame.set_texel_albedo(block, &vec![colour(source)?; count]);
        }
        7 => {
            let count = scene.level.block(block).map_or(1, |b| b.texels.len());
            let _ = frame.set_texel_emission(block, &vec![vector(source)?; count]);
        }
        8 => {
            frame.set_bounces(bounces(source)?);
            if source.ratio(1, 4)? {
                frame.forget();
            }
        }
        _ => {
            let (point, normal) = (vector(source)?, vector(source)?);
            let _ = frame.irradiance_at(point, normal);
            let _ = frame.vector_at(block, 7, normal);
        }
    }
    Ok(())
}
