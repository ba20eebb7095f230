//! `mrt light`: lights a real mesh through its blocks and takes pictures.

mod args;
mod error;
mod unwrapped;
mod glb;
mod output;
mod places;
mod report;
mod solve;
mod view;
mod warnings;

pub use args::{Exposure, LightArg, LightArgs, Shadows, ViewArg};
pub use error::LightCommandError;

use crate::cli::import_args::warn_of_import;
use crate::cli::output::print_report;
use crate::cli::output_files::{OutputFiles, is_same_place};
use crate::document::level_file::read_level;
use crate::fit_level::mesh_samples::{MeshSample, sample_mesh};
use crate::fit_level::paint::{PaintedMesh, coverage, distances, material_albedos};
use crate::import::report::ImportReport;
use crate::import::{ImportedScene, read_scene};
use crate::render::lit::LitScene;
use crate::render::placement::{Surroundings, VIEW_ANGLE_RAD};
use mrt_core::container::place::folder_of;
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::mesh::corner_normals;
use mrt_runtime::Level;
use mrt_runtime::low_level::output::receiver::{ReceiverMap, unwrap_mesh};
use places::{Lamps, Place};
use report::{Report, lamp_rows, sun_rows};
use std::path::PathBuf;
use std::time::Instant;
use unwrapped::Unwrapped;
use view::{View, level_origin};

/// Faces that meet at less than this angle look smooth, radians.
const CREASE_ANGLE_RAD: f64 = 0.7;

/// Points on the mesh at which its level is looked for and its colours are averaged.
const SURFACE_POINTS: usize = 16_384;

/// With less of its area in or near a block, a mesh does not belong to the level. Levels of `mrt map` hold 70 % and more.
const LEAST_COVERAGE: f64 = 0.1;

/// Reads everything, solves one frame, renders, and writes all files at the end.
///
/// # Errors
/// [`LightCommandError`]; then the output folder is as it was before.
pub fn run(args: &LightArgs) -> Result<(), LightCommandError> {
    let start = Instant::now();
    check_output(args)?;
    let level = read_level(&args.level)?;
    let mut imported = read_scene(&args.scene, &args.import.config_for(level.mesh.as_ref())?)?;
    warn_of_import(&imported.report);
    warnings::warn_of_warps(&level);
    let points = sample_mesh(&imported.mesh, SURFACE_POINTS);
    give_materials_their_means(&mut imported, &points);
    let mesh = &imported.mesh;
    let bvh = Bvh::build(mesh);
    let surroundings = Surroundings::new(mesh, &bvh, &level);
    let receivers = receivers(&level, &bvh);
    check_coverage(args, &level, &receivers, &points)?;
    let place = Place {
        level: &level,
        receivers: &receivers,
        surroundings: &surroundings,
    };
    let lamps = places::lamps(args, &imported.lights, place)?;
    let solved = solve::solve(args, &level, &lamps.lights, &surroundings)?;
    let scene = solved.frame.scene();
    let lit = LitScene {
        mesh,
        colours: &imported.colours,
        corner_normals: &corner_normals(mesh, CREASE_ANGLE_RAD),
        bvh: &bvh,
        receivers: &receivers,
        atlas: &scene.atlas,
        lightmap: solved.frame.lightmap().pixels(),
        lamps: &lamps.lights,
        restart: surroundings.restart(),
        reach: surroundings.reach(),
        pixel_angle: VIEW_ANGLE_RAD / args.size[1] as f32,
        is_reversed: surroundings.is_reversed,
        hides_outside: false,
    };
    let views = view::views(args, &lit, &level, &surroundings)?;
    let unwrapped = unwrap_mesh(mesh, &receivers);
    let files = Unwrapped {
        triangles: &unwrapped,
        origin: level_origin(&level),
    };
    output::write(&args.out, &views, &lit, &files)?;
    let lit = Lit {
        level: &level,
        lamps: &lamps,
        solved: &solved,
        views: &views,
    };
    let report = Report {
        lightmap_triangles: unwrapped.len(),
        seconds: start.elapsed().as_secs_f64(),
        ..lit.report(imported.report.clone())
    };
    Ok(print_report(&report, args.json, Report::print)?)
}

/// What a report tells about.
struct Lit<'a> {
    level: &'a Level,
    lamps: &'a Lamps,
    solved: &'a solve::Solved,
    views: &'a [View],
}

impl Lit<'_> {
    /// Without the seconds in all and the number of triangles with coordinates.
    fn report(&self, mesh: ImportReport) -> Report {
        let atlas = &self.solved.frame.scene().atlas;
        Report {
            mesh,
            blocks: self.level.blocks.len(),
            connections: self.level.connections.len(),
            lights: lamp_rows(&self.lamps.lights, level_origin(self.level)),
            suns: sun_rows(&self.lamps.lights),
            lights_of_mesh: self.lamps.of_mesh,
            emissive_walls: places::emissive_walls(self.level),
            passes: self.solved.passes,
            dictionary_seconds: self.solved.dictionary_seconds,
            assemble_seconds: self.solved.assemble_seconds,
            frame_milliseconds: self.solved.frame_milliseconds,
            lightmap: [atlas.width, atlas.height],
            lightmap_triangles: 0,
            views: self.views.iter().map(View::report).collect(),
            seconds: 0.0,
        }
    }
}

/// The mesh that is written has one colour a material.
fn give_materials_their_means(scene: &mut ImportedScene, points: &[MeshSample]) {
    let painted = PaintedMesh {
        mesh: &scene.mesh,
        colours: &scene.colours,
    };
    let albedos = material_albedos(painted, points);
    for (material, albedo) in scene.mesh.materials.iter_mut().zip(albedos) {
        material.albedo = albedo;
    }
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
    outputs.check_folder(
        "--out",
        &args.out,
        &["png", "hdr", "ktx2", "glb", "obj", "mtl"],
    )?;
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
    points: &[MeshSample],
) -> Result<(), LightCommandError> {
    let found = coverage(points, &distances(level, receivers, points)).near;
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
