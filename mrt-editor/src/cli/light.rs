//! `mrt light`: lights a real mesh through its blocks and takes pictures.

mod args;
mod error;
mod output;
mod places;
mod report;
mod solve;
mod view;
mod warnings;

pub use args::{Exposure, LightArg, LightArgs, Shadows, ViewArg};
pub use error::LightCommandError;

use crate::cli::output::print_report;
use crate::cli::output_files::{OutputFiles, is_same_place};
use crate::document::level_file::read_level;
use crate::fit_level::mesh_samples::sample_mesh;
use crate::fit_level::paint::coverage;
use crate::import::read_scene;
use crate::render::lit::LitScene;
use crate::render::placement::Surroundings;
use mrt_core::container::place::folder_of;
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::mesh::{TriangleMesh, corner_normals};
use mrt_runtime::Level;
use mrt_runtime::low_level::output::receiver::{ReceiverMap, unwrap_mesh};
use report::{Report, lamp_row};
use std::path::PathBuf;
use std::time::Instant;
use view::View;

/// Faces that meet at less than this angle look smooth, radians.
const CREASE_ANGLE_RAD: f64 = 0.7;

/// Points on the mesh at which its level is looked for.
const COVERAGE_POINTS: usize = 4096;

/// With less of its area in or near a block, a mesh does not belong to the level. Levels of `mrt map` hold 70 % and more.
const LEAST_COVERAGE: f64 = 0.1;

/// Reads everything, solves one frame, renders, and writes all files at the end.
///
/// # Errors
/// [`LightCommandError`]; then the output folder is as it was before.
pub fn run(args: &LightArgs) -> Result<(), LightCommandError> {
    let start = Instant::now();
    check_output(args)?;
    let imported = read_scene(&args.scene, &args.import.config())?;
    let mesh = &imported.mesh;
    let level = read_level(&args.level)?;
    warnings::warn_of_warps(&level);
    let bvh = Bvh::build(mesh);
    let surroundings = Surroundings::new(mesh, &bvh, &level);
    let receivers = receivers(&level, &bvh);
    check_coverage(args, &level, &receivers, mesh)?;
    let lamps = places::lamps(args, &level, &receivers, &surroundings)?;
    let solved = solve::solve(args, &level, &lamps, &bvh)?;
    let scene = solved.frame.scene();
    let lit = LitScene {
        mesh,
        corner_normals: &corner_normals(mesh, CREASE_ANGLE_RAD),
        bvh: &bvh,
        receivers: &receivers,
        atlas: &scene.atlas,
        lightmap: solved.frame.lightmap().pixels(),
        lamps: &lamps,
        restart: surroundings.restart(),
        hides_outside: false,
    };
    let views = view::views(args, &lit, &level, &surroundings)?;
    let unwrapped = unwrap_mesh(mesh, &receivers);
    output::write(&args.out, &views, &lit, &unwrapped)?;
    let report = Report {
        mesh: imported.report,
        blocks: level.blocks.len(),
        connections: level.connections.len(),
        lights: lamps.iter().map(lamp_row).collect(),
        passes: solved.passes,
        dictionary_seconds: solved.dictionary_seconds,
        assemble_seconds: solved.assemble_seconds,
        frame_milliseconds: solved.frame_milliseconds,
        lightmap: [scene.atlas.width, scene.atlas.height],
        lightmap_triangles: unwrapped.len(),
        views: views.iter().map(View::report).collect(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok(print_report(&report, args.json, Report::print)?)
}

/// The output folder must hold neither the mesh nor the level, nor links to what is read.
fn check_output(args: &LightArgs) -> Result<(), LightCommandError> {
    for input in [&args.scene, &args.level] {
        if is_same_place(folder_of(input), &args.out) {
            return Err(LightCommandError::OutHoldsInput {
                out: args.out.clone(),
                input: input.clone(),
            });
        }
    }
    let inputs = [&args.scene, &args.level]
        .into_iter()
        .chain(&args.dictionary);
    let outputs = OutputFiles::new(inputs.map(PathBuf::as_path));
    outputs.check_folder("--out", &args.out, &["png", "hdr", "obj", "mtl"])?;
    Ok(())
}

fn receivers(level: &Level, bvh: &Bvh) -> ReceiverMap {
    ReceiverMap::with_cube_camera(level, |origin, direction| {
        let hit = bvh.closest_hit(origin, direction, f32::INFINITY);
        hit.map_or(f32::INFINITY, |hit| hit.t)
    })
}

fn check_coverage(
    args: &LightArgs,
    level: &Level,
    receivers: &ReceiverMap,
    mesh: &TriangleMesh,
) -> Result<(), LightCommandError> {
    let found = coverage(level, receivers, &sample_mesh(mesh, COVERAGE_POINTS)).near;
    if found < LEAST_COVERAGE {
        return Err(LightCommandError::OtherMesh {
            path: args.level.clone(),
            expected: LEAST_COVERAGE,
            found,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
