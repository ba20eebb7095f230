//! `mrt light`: lights a real mesh through its blocks and takes pictures.

mod args;
mod error;
mod output;
mod report;

pub use args::{Exposure, LightArg, LightArgs, Shadows, ViewArg};
pub use error::LightCommandError;

use crate::cli::dictionary_source::load;
use crate::cli::output::is_same_place;
use crate::document::level_file::read_level;
use crate::fit_level::paint::coverage;
use crate::fit_level::surface::spread_points;
use crate::import::read_scene;
use crate::render::camera::Camera;
use crate::render::lit::{LitScene, SphereLight};
use crate::render::placement::{
    Surroundings, VIEW_ANGLE_RAD, camera_at_light, light_places, overview,
};
use crate::render::tone::auto_exposure;
use crate::render::{Picture, render};
use glam::{DVec3, Vec3};
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::mesh::corner_normals;
use mrt_dictionary::modular::variants::warp_error::guessed_error;
use mrt_runtime::blocks::WarpTransport;
use mrt_runtime::low_level::output::receiver::{ReceiverMap, unwrap_mesh};
use mrt_runtime::shadows::Rays;
use mrt_runtime::{AssembleConfig, Bounces, Frame, FrameConfig, FrameReport, Level, Light, Scene};
use report::{Report, light_row};
use std::path::Path;
use std::time::Instant;

/// A light's radius where none is given, in widths of its block: 1.6 texels of the standard dictionary.
const LIGHT_RADIUS: f64 = 0.1;

/// Colours that default lights take in turn, warm and cool, so that one sees whose light is where.
const DEFAULT_TINTS: [Vec3; 2] = [Vec3::new(1.0, 0.85, 0.65), Vec3::new(0.7, 0.85, 1.0)];

/// Lights placed when none is given: one for this many blocks, up to the most.
const BLOCKS_A_LIGHT: usize = 12;
const MOST_DEFAULT_LIGHTS: usize = 6;

/// Cameras placed at lights when none is given.
const DEFAULT_VIEWS: usize = 2;

/// Faces that meet at less than this angle look smooth, radians.
const CREASE_ANGLE_RAD: f64 = 0.7;

/// `--bounces all` stops when a pass changes less than this share.
const CONVERGED: Bounces = Bounces::Converged {
    tolerance: 1e-3,
    limit: 64,
};

/// How far a block's wall may stand behind the real surface, in widths of the smallest block, before a
/// shadow ray takes the surface for something in the way.
const WALL_SLACK: f64 = 0.15;

/// Points on the mesh at which its level is looked for.
const COVERAGE_POINTS: usize = 4096;

/// With less of its area in or near a block, a mesh was not meant by the level. Levels of `mrt map` hold 70 %
/// and more.
const LEAST_COVERAGE: f64 = 0.1;

/// Expected error of a canonical block above which the user is told.
const WARP_WARNING: f64 = 0.1;

/// Pictures of one camera.
struct View {
    name: String,
    /// Direct, indirect, both.
    pictures: [Picture; 3],
    exposure: f32,
}

/// Reads everything, solves one frame, renders, and writes all files at the end.
///
/// # Errors
/// [`LightCommandError`]; then the output folder is as it was before.
pub fn run(args: &LightArgs) -> Result<(), LightCommandError> {
    let start = Instant::now();
    for input in [&args.scene, &args.level] {
        let folder = match input.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        if is_same_place(folder, &args.out) {
            return Err(LightCommandError::OutHoldsInput {
                out: args.out.clone(),
                input: input.clone(),
            });
        }
    }
    let imported = read_scene(&args.scene, &args.import.config())?;
    let mesh = &imported.mesh;
    let level = read_level(&args.level)?;
    warn_of_warps(&level);
    let bvh = Bvh::build(mesh);
    let surroundings = Surroundings::new(mesh, &bvh, &level);
    let receivers = ReceiverMap::with_cube_camera(&level, |origin, direction| {
        let hit = bvh.closest_hit(origin, direction, f32::INFINITY);
        hit.map_or(f32::INFINITY, |hit| hit.t)
    });
    let covered = coverage(&level, &receivers, &spread_points(mesh, COVERAGE_POINTS)).near;
    if covered < LEAST_COVERAGE {
        return Err(LightCommandError::OtherMesh {
            path: args.level.clone(),
            expected: LEAST_COVERAGE,
            found: covered,
        });
    }
    let lights = place_lights(args, &level, &receivers, &surroundings)?;

    let dictionary_start = Instant::now();
    let dictionary = load(args.dictionary.as_deref(), args.preset.as_deref())?;
    let dictionary_seconds = dictionary_start.elapsed().as_secs_f64();
    let assemble_start = Instant::now();
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let assemble_seconds = assemble_start.elapsed().as_secs_f64();
    let config = FrameConfig {
        bounces: args.bounces.map_or(CONVERGED, Bounces::Count),
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    let frame_start = Instant::now();
    let solved = solve(&mut frame, &lights, &bvh, args);
    solved.require_all_lights()?;
    let frame_milliseconds = frame_start.elapsed().as_secs_f64() * 1e3;

    let lit = LitScene {
        mesh,
        corner_normals: &corner_normals(mesh, CREASE_ANGLE_RAD),
        bvh: &bvh,
        receivers: &receivers,
        atlas: &scene.atlas,
        lightmap: frame.lightmap().pixels(),
        lights: &lights,
        restart: surroundings.restart(),
        hides_outside: false,
    };
    let views = views(args, &lit, &level, &surroundings)?;
    let unwrapped = unwrap_mesh(mesh, &receivers);
    let report = Report {
        mesh: imported.report,
        blocks: level.blocks.len(),
        connections: level.connections.len(),
        lights: lights.iter().map(light_row).collect(),
        passes: solved.passes(),
        dictionary_seconds,
        assemble_seconds,
        frame_milliseconds,
        lightmap: [scene.atlas.width, scene.atlas.height],
        lightmap_triangles: unwrapped.len(),
        views: views.iter().map(View::report).collect(),
        seconds: 0.0,
    };
    output::write(&args.out, &views, &lit, &unwrapped)?;
    let report = Report {
        seconds: start.elapsed().as_secs_f64(),
        ..report
    };
    if args.json {
        // A struct of numbers and names always has a text.
        crate::report_line!("{}", serde_json::to_string(&report).unwrap_or_default());
    } else {
        report.print();
    }
    Ok(())
}

/// Says which blocks are warped too far for the operators that they use.
fn warn_of_warps(level: &Level) {
    let guesses = level
        .blocks
        .iter()
        .enumerate()
        .filter(|(_, block)| block.transport == WarpTransport::Canonical)
        .map(|(index, block)| (index, guessed_error(&block.warp)))
        .filter(|&(_, error)| error > WARP_WARNING);
    let count = guesses.clone().count();
    if let Some((worst, error)) = guesses.max_by(|a, b| a.1.total_cmp(&b.1)) {
        eprintln!(
            "mrt: warning: {count} of {} blocks are warped so far that their light errs by over {:.0} %, \
             block {worst} by about {:.0} %; `mrt adapt` gives them operators of their own",
            level.blocks.len(),
            100.0 * WARP_WARNING,
            100.0 * error
        );
    }
}

/// The lights asked for, or a few in the largest blocks.
fn place_lights(
    args: &LightArgs,
    level: &Level,
    receivers: &ReceiverMap,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<SphereLight>, LightCommandError> {
    let width = |block: usize| {
        let volume = level.blocks[block]
            .warp
            .jacobian(DVec3::splat(0.5))
            .determinant();
        volume.abs().cbrt()
    };
    if args.light.is_empty() {
        let count = level
            .blocks
            .len()
            .div_ceil(BLOCKS_A_LIGHT)
            .min(MOST_DEFAULT_LIGHTS);
        let places = light_places(surroundings, level, count);
        if places.is_empty() {
            return Err(LightCommandError::NoPlace);
        }
        let lights = places
            .into_iter()
            .enumerate()
            .map(|(index, (block, position))| SphereLight {
                position,
                radius: args
                    .light_radius
                    .unwrap_or((LIGHT_RADIUS * width(block)) as f32),
                // About 1 W/m² on the walls of its block.
                intensity: DEFAULT_TINTS[index % DEFAULT_TINTS.len()]
                    * (0.25 * width(block) * width(block)) as f32,
            });
        return Ok(lights.collect());
    }
    let mut lights = Vec::with_capacity(args.light.len());
    for (index, light) in args.light.iter().enumerate() {
        let position = light.position;
        let mut radius = args.light_radius.unwrap_or(0.0);
        if position.is_finite()
            && let Some((block, distance)) = receivers.nearest_block(position)
        {
            let block = block.get();
            if distance > 1e-3 * width(block) {
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
            radius = args
                .light_radius
                .unwrap_or((LIGHT_RADIUS * width(block)) as f32);
        }
        // Whatever else is wrong with the numbers, the frame refuses by name.
        lights.push(SphereLight {
            position,
            radius,
            intensity: light.colour * light.intensity,
        });
    }
    Ok(lights)
}

fn solve(frame: &mut Frame, lights: &[SphereLight], bvh: &Bvh, args: &LightArgs) -> FrameReport {
    let lights: Vec<Light> = lights
        .iter()
        .map(|light| Light::Sphere {
            position: light.position,
            radius: light.radius,
            intensity: light.intensity,
        })
        .collect();
    frame.set_lights(&lights);
    match args.shadows {
        Shadows::Openings => frame.solve(),
        Shadows::Rays => {
            let slack = WALL_SLACK * smallest_width(frame.scene());
            let rays = Rays(|receiver: DVec3, light: DVec3| {
                // From the light, and short of the receiver: a block's wall stands a little behind the
                // real one.
                let towards = receiver - light;
                let reach = 1.0 - slack / towards.length();
                let is_blocked = reach > 0.0
                    && bvh.is_occluded(light.as_vec3(), towards.as_vec3(), reach as f32);
                if is_blocked { 0.0 } else { 1.0 }
            });
            frame.solve_with(&rays)
        }
    }
}

fn smallest_width(scene: &Scene) -> f64 {
    scene
        .level
        .blocks
        .iter()
        .map(|block| {
            block
                .warp
                .jacobian(DVec3::splat(0.5))
                .determinant()
                .abs()
                .cbrt()
        })
        .fold(f64::MAX, f64::min)
}

/// Renders the views asked for, or one at the first light and one of everything.
fn views(
    args: &LightArgs,
    lit: &LitScene<'_>,
    level: &Level,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<View>, LightCommandError> {
    let [width, height] = args.size;
    let aspect = width as f32 / height as f32;
    let mut cameras: Vec<(String, Camera, bool)> = Vec::new();
    for (index, view) in args.camera.iter().enumerate() {
        let camera = Camera::look_at(view.from, view.to, VIEW_ANGLE_RAD, aspect);
        let camera = camera.ok_or(LightCommandError::Camera {
            from: view.from,
            to: view.to,
        })?;
        cameras.push((format!("view{}", index + 1), camera, false));
    }
    if cameras.is_empty() {
        for (index, light) in lit.lights.iter().take(DEFAULT_VIEWS).enumerate() {
            let camera = camera_at_light(surroundings, light.position, aspect);
            cameras.extend(camera.map(|camera| (format!("view{}", index + 1), camera, false)));
        }
        let camera = overview(level, aspect);
        cameras.extend(camera.map(|camera| ("overview".to_owned(), camera, true)));
    }
    Ok(cameras
        .into_iter()
        .map(|(name, camera, is_outside)| {
            let lit = LitScene {
                hides_outside: is_outside && !surroundings.is_reversed,
                ..*lit
            };
            let [direct, indirect] = render(&camera, args.size, 2, |origin, direction| {
                let colours = lit.colours(origin, direction);
                [colours.direct, colours.indirect]
            });
            let both = sum(&direct, &indirect);
            let exposure = match args.exposure {
                Exposure::Auto => auto_exposure(&[&both]),
                Exposure::Value(ev) => ev.exp2(),
            };
            View {
                name,
                pictures: [direct, indirect, both],
                exposure,
            }
        })
        .collect())
}

fn sum(a: &Picture, b: &Picture) -> Picture {
    Picture {
        pixels: a.pixels.iter().zip(&b.pixels).map(|(a, b)| a + b).collect(),
        ..*a
    }
}

#[cfg(test)]
mod tests;
