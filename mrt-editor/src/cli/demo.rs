//! `mrt demo`: lights a built-in maze, takes pictures and measures time and error.

mod pictures;

use crate::accuracy::exact_level::{ExactLevelError, LevelErrors, measure};
use crate::cli::dictionary_source::{SourceError, load};
use crate::cli::hint::after_assembly;
use crate::cli::output::{ReportError, print_report};
use crate::cli::output_files::{OutputError, OutputFiles};
use crate::cli::table::Table;
use crate::document::built_in::MAZE;
use crate::document::level_file::{LevelFileError, read_level};
use glam::{DVec3, Vec3};
use mrt_core::excerpt::excerpt;
use mrt_runtime::{
    AssembleConfig, AssembleError, Bounces, Dictionary, Frame, FrameConfig, Level, LevelTextError,
    Light, Scene, SkippedLight, StageTimes,
};
use pictures::{PictureError, block_size, take_pictures};
use serde::Serialize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Frames over which stage times are taken. The fastest counts, since other programs can only slow a frame down.
const TIMED_FRAMES: usize = 20;

/// Bounces in pictures and in the second row of errors.
const BOUNCES: u32 = 8;

/// Lights a built-in maze and shows what the method does: pictures, times and errors.
#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// Folder for the pictures.
    #[arg(long, default_value = "mrt-demo")]
    pub out: PathBuf,
    /// Level to show instead of the built-in maze.
    #[arg(long)]
    pub level: Option<PathBuf>,
    /// Dictionary file instead of the built-in one.
    #[arg(long)]
    pub dictionary: Option<PathBuf>,
    /// Leave out the comparison with the exact solution.
    #[arg(long)]
    pub no_exact: bool,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
}

impl Default for DemoArgs {
    fn default() -> Self {
        Self {
            out: PathBuf::from("mrt-demo"),
            level: None,
            dictionary: None,
            no_exact: false,
            json: false,
        }
    }
}

/// Why the demo stopped.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The pictures cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The level's file cannot be read, or is at fault.
    #[error(transparent)]
    LevelFile(#[from] LevelFileError),
    /// The built-in level is at fault.
    #[error("the built-in maze: {0}")]
    Maze(#[from] LevelTextError),
    /// Level and dictionary do not fit.
    #[error("{0}{hint}", hint = after_assembly(.0))]
    Assemble(#[from] AssembleError),
    /// A light does not shine.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// The exact solution failed.
    #[error(transparent)]
    Exact(#[from] ExactLevelError),
    /// There are no pictures.
    #[error(transparent)]
    Pictures(#[from] PictureError),
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}

#[derive(Default, Serialize)]
struct DemoReport {
    blocks: usize,
    connections: usize,
    texels: usize,
    preset: String,
    modes: Vec<(&'static str, usize)>,
    operator_bytes: usize,
    dictionary_bytes: usize,
    assemble_ms: f64,
    stages_ms: Vec<(&'static str, f64)>,
    frame_ms: f64,
    errors: Option<LevelErrors>,
    pictures: Vec<String>,
}

/// Runs the demo.
///
/// # Errors
/// [`DemoError`].
pub fn run(args: &DemoArgs) -> Result<(), DemoError> {
    let inputs = args.level.iter().chain(&args.dictionary);
    let outputs = OutputFiles::new(inputs.map(PathBuf::as_path));
    outputs.check_folder("--out", &args.out, &["png"])?;
    let dictionary = load(args.dictionary.as_deref(), None)?;
    let level = level(args)?;
    let start = Instant::now();
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let assemble_time = start.elapsed();
    let lights = two_lights(&scene);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let times = time_frames(&mut frame, &lights)?;
    let errors = compare_with_exact(args, &level, &mut frame, &lights)?;
    solve_all_bounces(&mut frame, &lights)?;
    let pictures = take_pictures(&args.out, &frame, &lights)?;
    let report = DemoReport {
        assemble_ms: milliseconds(assemble_time),
        stages_ms: stages(&times),
        frame_ms: milliseconds(times.total()),
        errors,
        pictures,
        ..sizes(&level, &scene, &dictionary)
    };
    Ok(print_report(&report, args.json, print)?)
}

fn level(args: &DemoArgs) -> Result<Level, DemoError> {
    Ok(match &args.level {
        Some(path) => read_level(path)?,
        None => Level::from_text(MAZE)?,
    })
}

/// A warm light in the first block and a cool one in the block farthest from it.
fn two_lights(scene: &Scene) -> Vec<Light> {
    let center = |block: usize| scene.level.blocks[block].warp.center();
    let far = (0..scene.level.blocks.len())
        .max_by(|&a, &b| {
            let distance = |block: usize| center(block).distance(center(0));
            distance(a).total_cmp(&distance(b))
        })
        .unwrap_or(0);
    let sphere = |block: usize, unit: DVec3, intensity: Vec3| {
        let warp = &scene.level.blocks[block].warp;
        let size = block_size(warp);
        Light::Sphere {
            position: warp.point(unit).as_vec3(),
            radius: 0.1 * size,
            intensity: intensity * size * size,
        }
    };
    let warm = sphere(0, DVec3::new(0.6, 0.7, 0.5), Vec3::new(1.0, 0.82, 0.6));
    let cool = sphere(far, DVec3::new(0.5, 0.75, 0.5), Vec3::new(0.55, 0.75, 1.0));
    if far == 0 {
        vec![warm]
    } else {
        vec![warm, cool]
    }
}

/// The fastest of several frames of one bounce, each computed anew.
fn time_frames(frame: &mut Frame, lights: &[Light]) -> Result<StageTimes, SkippedLight> {
    frame.set_lights(lights);
    frame.set_bounces(Bounces::Count(1));
    let mut best: Option<StageTimes> = None;
    for _ in 0..TIMED_FRAMES {
        // Nothing changes between them, and a frame skips what has not changed.
        frame.forget();
        let report = frame.solve();
        report.require_all_lights()?;
        let times = report.times();
        if best.is_none_or(|best| times.total() < best.total()) {
            best = Some(times);
        }
    }
    Ok(best.unwrap_or_default())
}

/// `None` if the user does not want to wait for it.
fn compare_with_exact(
    args: &DemoArgs,
    level: &Level,
    frame: &mut Frame,
    lights: &[Light],
) -> Result<Option<LevelErrors>, ExactLevelError> {
    if args.no_exact {
        return Ok(None);
    }
    eprintln!("solving the same level exactly, to compare");
    Ok(Some(measure(level, frame, lights, BOUNCES)?))
}

fn solve_all_bounces(frame: &mut Frame, lights: &[Light]) -> Result<(), SkippedLight> {
    frame.set_lights(lights);
    frame.set_bounces(Bounces::Count(BOUNCES));
    frame.solve().require_all_lights()
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn stages(times: &StageTimes) -> Vec<(&'static str, f64)> {
    vec![
        ("direct light", milliseconds(times.direct)),
        ("b = T_d->b l", milliseconds(times.coefficients)),
        ("r = T_b->r b", milliseconds(times.responses)),
        ("U_b b + U_r r", milliseconds(times.indirect)),
        ("lightmap atlas", milliseconds(times.lightmap)),
    ]
}

/// A report of sizes alone.
fn sizes(level: &Level, scene: &Scene, dictionary: &Dictionary) -> DemoReport {
    let is_used = |shape| scene.level.blocks.iter().any(|block| block.shape == shape);
    let shapes = dictionary.shapes.iter();
    let modes = shapes
        .filter(|entry| is_used(entry.shape))
        .map(|entry| (entry.shape.name, entry.modes()));
    DemoReport {
        blocks: level.blocks.len(),
        connections: level.connections.len(),
        texels: scene.texel_count(),
        preset: dictionary.preset.clone(),
        modes: modes.collect(),
        operator_bytes: scene.operator_bytes(),
        dictionary_bytes: dictionary.bytes(),
        ..DemoReport::default()
    }
}

fn print(report: &DemoReport) {
    let modes = report.modes.iter();
    let modes: Vec<String> = modes
        .map(|(shape, modes)| format!("{shape} {modes}"))
        .collect();
    crate::report_line!(
        "maze: {} blocks, {} openings between them, {} texels; preset {}",
        report.blocks,
        report.connections,
        report.texels,
        excerpt(&report.preset)
    );
    crate::report_line!("modes by shape: {}", modes.join(", "));
    crate::report_line!(
        "operators: {} KiB used by this level, {} KiB in the dictionary\n",
        report.operator_bytes / 1024,
        report.dictionary_bytes / 1024
    );
    let mut table = Table::new(&["stage of a frame (one core, one bounce)", "ms"]);
    let totals = [
        ("whole frame", report.frame_ms),
        ("assembling the level (once)", report.assemble_ms),
    ];
    for (stage, ms) in report.stages_ms.iter().chain(&totals) {
        table.row([(*stage).to_owned(), format!("{ms:.3}")]);
    }
    crate::report_line!("{table}");
    if let Some(errors) = &report.errors {
        print_errors(errors);
    }
    crate::report_line!("pictures:");
    for picture in &report.pictures {
        crate::report_line!("  {picture}");
    }
}

fn print_errors(errors: &LevelErrors) {
    let mut table = Table::new(&["error against the exact solution", "relative L2"]);
    for (light, error) in [
        (
            "indirect light, first bounce".to_owned(),
            errors.first_bounce,
        ),
        (
            format!("indirect light, {BOUNCES} bounces"),
            errors.many_bounces,
        ),
        (
            format!("direct and indirect, {BOUNCES} bounces"),
            errors.total,
        ),
    ] {
        table.row([light, format!("{:.2} %", 100.0 * error)]);
    }
    crate::report_line!("{table}");
    crate::report_line!("the exact solution took {:.1} s\n", errors.exact_seconds);
}
