//! `mrt demo`: lights a built-in maze, takes pictures and measures time and error.

use crate::cli::dictionary_source::{SourceError, load};
use crate::cli::reference_level::{LevelErrors, ReferenceLevelError, measure};
use crate::cli::table::Table;
use crate::render::camera::Camera;
use crate::render::file::{Saves, WriteError, write_png};
use crate::render::level_view::{LevelView, ViewError};
use crate::render::tone::{auto_exposure, tone_map};
use crate::render::{Picture, render};
use glam::{DVec3, Vec3};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_runtime::{
    AssembleConfig, AssembleError, Bounces, Dictionary, Frame, FrameConfig, Level, LevelTextError,
    Light, Scene, SkippedLight, StageTimes,
};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// The built-in maze: thirteen blocks with a loop and coloured walls.
pub const MAZE: &str = include_str!("../../../assets/maze.level.toml");

/// Frames over which stage times are taken; the fastest counts, since other programs only slow them.
const TIMED_FRAMES: usize = 20;

/// sRGB outside the level.
const BACKGROUND: [u8; 3] = [58, 62, 70];

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
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The level file cannot be read.
    #[error("{file}: {source}")]
    LevelFile {
        /// Which file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The level is at fault.
    #[error("{place}: {source}")]
    Level {
        /// The file, or "the built-in maze".
        place: String,
        /// What is wrong.
        source: LevelTextError,
    },
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// A light is refused.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// Nothing can be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The exact solution failed.
    #[error(transparent)]
    Exact(#[from] ReferenceLevelError),
    /// A file stands where the folder should be.
    #[error("--out {file}: found a file; expected a folder or a new name")]
    OutIsFile {
        /// The file.
        file: String,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The report has no form as JSON.
    #[error("the report cannot be printed: {0}")]
    Report(#[from] serde_json::Error),
}

#[derive(Serialize)]
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
    // Found out now rather than after the work.
    if args.out.exists() && !args.out.is_dir() {
        return Err(DemoError::OutIsFile {
            file: args.out.display().to_string(),
        });
    }
    let dictionary = load(args.dictionary.as_deref(), None)?;
    let level = read_level(args)?;
    let start = Instant::now();
    let scene = Scene::assemble(&level, &dictionary, &AssembleConfig::default())?;
    let assemble_ms = milliseconds(start.elapsed());
    let lights = maze_lights(&scene);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let times = time_frames(&mut frame, &lights)?;
    let errors = if args.no_exact {
        None
    } else {
        eprintln!("solving the same level exactly, to compare");
        Some(measure(&level, &scene, &mut frame, &lights, BOUNCES)?)
    };
    frame.set_lights(&lights);
    frame.set_bounces(Bounces::Count(BOUNCES));
    frame.solve().require_all_lights()?;
    let pictures = take_pictures(args, &level, &scene, &frame, &lights)?;
    let report = report(
        &level,
        &scene,
        &dictionary,
        assemble_ms,
        times,
        errors,
        pictures,
    );
    if args.json {
        crate::report_line!("{}", serde_json::to_string(&report)?);
    } else {
        print(&report);
    }
    Ok(())
}

fn read_level(args: &DemoArgs) -> Result<Level, DemoError> {
    let (place, text) = match &args.level {
        None => ("the built-in maze".to_owned(), MAZE.to_owned()),
        Some(path) => {
            let file = path.display().to_string();
            match std::fs::read_to_string(path) {
                Ok(text) => (file, text),
                Err(source) => return Err(DemoError::LevelFile { file, source }),
            }
        }
    };
    Level::from_text(&text).map_err(|source| DemoError::Level { place, source })
}

/// A warm light in the first block and a cool one in the block farthest from it.
fn maze_lights(scene: &Scene) -> Vec<Light> {
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

/// Edge of the cube with the block's diagonal, metres.
fn block_size(warp: &Hexahedron) -> f32 {
    (warp.diagonal() / 3f64.sqrt()) as f32
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

/// Direct, indirect and both: from above with the ceilings off, and from inside the first block.
fn take_pictures(
    args: &DemoArgs,
    level: &Level,
    scene: &Scene,
    frame: &Frame,
    lights: &[Light],
) -> Result<Vec<String>, DemoError> {
    std::fs::create_dir_all(&args.out).map_err(|source| WriteError::Io {
        path: args.out.clone(),
        source,
    })?;
    let (min, max) = level
        .blocks
        .iter()
        .map(|b| b.warp.bounds())
        .fold((DVec3::MAX, DVec3::MIN), |(lo, hi), (a, b)| {
            (lo.min(a), hi.max(b))
        });
    let (min, max) = (min.as_vec3(), max.as_vec3());
    let (middle, extent) = (0.5 * (min + max), (max - min).max_element());
    let size = block_size(&scene.level.blocks[0].warp);
    let view = |name, from, to, angle, with_ceilings| (name, from, to, angle, with_ceilings);
    let from_above = middle + Vec3::new(0.0, 1.0 * extent, 0.6 * extent);
    let eye = scene.level.blocks[0]
        .warp
        .point(DVec3::new(0.06, 0.5, 0.5))
        .as_vec3();
    let ahead = scene.level.blocks[0]
        .warp
        .point(DVec3::new(3.0, 0.42, 0.5))
        .as_vec3();
    let views = [
        view(
            "above",
            from_above,
            middle - Vec3::Y * 0.1 * size,
            0.75,
            false,
        ),
        view("inside", eye, ahead, 1.25, true),
    ];
    let mut written = Vec::new();
    for (name, from, to, angle, with_ceilings) in views {
        let shown = LevelView::new(scene, frame, lights, with_ceilings)?;
        let [width, height] = [960, 640];
        let Some(camera) = Camera::look_at(from, to, angle, width as f32 / height as f32) else {
            continue;
        };
        let [direct, indirect, both, coverage] =
            render(&camera, [width, height], 2, |origin, direction| match shown
                .radiance(origin, direction)
            {
                Some((direct, indirect)) => [direct, indirect, direct + indirect, Vec3::ONE],
                None => [Vec3::ZERO; 4],
            });
        // One exposure for the three, so that they can be compared.
        let exposure = auto_exposure(&[&both]);
        for (picture, part) in [(direct, "direct"), (indirect, "indirect"), (both, "both")] {
            let path = args.out.join(format!("{name}-{part}.png"));
            let mut srgb = tone_map(&picture, exposure);
            over_background(&mut srgb, &coverage);
            write_png(&path, [width, height], &srgb, Saves::Time)?;
            written.push(path.display().to_string());
        }
    }
    Ok(written)
}

/// Shows the outside of the level as a plain grey, which no exposure changes.
fn over_background(srgb: &mut [u8], coverage: &Picture) {
    for (pixel, coverage) in srgb.as_chunks_mut::<3>().0.iter_mut().zip(&coverage.pixels) {
        for (value, background) in pixel.iter_mut().zip(BACKGROUND) {
            *value = value.saturating_add((f32::from(background) * (1.0 - coverage.x)) as u8);
        }
    }
}

fn milliseconds(duration: std::time::Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn report(
    level: &Level,
    scene: &Scene,
    dictionary: &Dictionary,
    assemble_ms: f64,
    times: StageTimes,
    errors: Option<LevelErrors>,
    pictures: Vec<String>,
) -> DemoReport {
    let used = |shape| scene.level.blocks.iter().any(|block| block.shape == shape);
    DemoReport {
        blocks: level.blocks.len(),
        connections: level.connections.len(),
        texels: scene.texel_count(),
        preset: dictionary.preset.clone(),
        modes: dictionary
            .shapes
            .iter()
            .filter(|entry| used(entry.shape))
            .map(|entry| (entry.shape.name, entry.modes()))
            .collect(),
        operator_bytes: scene.operator_bytes(),
        dictionary_bytes: dictionary.bytes(),
        assemble_ms,
        stages_ms: vec![
            ("direct light", milliseconds(times.direct)),
            ("b = T_d->b l", milliseconds(times.coefficients)),
            ("r = T_b->r b", milliseconds(times.responses)),
            ("U_b b + U_r r", milliseconds(times.indirect)),
            ("lightmap atlas", milliseconds(times.lightmap)),
        ],
        frame_ms: milliseconds(times.total()),
        errors,
        pictures,
    }
}

fn print(report: &DemoReport) {
    let modes: Vec<String> = report
        .modes
        .iter()
        .map(|(shape, modes)| format!("{shape} {modes}"))
        .collect();
    crate::report_line!(
        "maze: {} blocks, {} openings between them, {} texels; preset {}",
        report.blocks,
        report.connections,
        report.texels,
        report.preset
    );
    crate::report_line!("modes by shape: {}", modes.join(", "));
    crate::report_line!(
        "operators: {} KiB used by this level, {} KiB in the dictionary\n",
        report.operator_bytes / 1024,
        report.dictionary_bytes / 1024
    );
    let mut table = Table::new(&["stage of a frame (one core, one bounce)", "ms"]);
    for (stage, ms) in &report.stages_ms {
        table.row([(*stage).to_owned(), format!("{ms:.3}")]);
    }
    table.row(["whole frame".to_owned(), format!("{:.3}", report.frame_ms)]);
    table.row([
        "assembling the level (once)".to_owned(),
        format!("{:.3}", report.assemble_ms),
    ]);
    crate::report_line!("{table}");
    if let Some(errors) = &report.errors {
        let percent = |x: f64| format!("{:.2} %", 100.0 * x);
        let mut table = Table::new(&["error against the exact solution", "relative L2"]);
        table.row([
            "indirect light, first bounce".to_owned(),
            percent(errors.first_bounce),
        ]);
        table.row([
            format!("indirect light, {BOUNCES} bounces"),
            percent(errors.many_bounces),
        ]);
        table.row([
            format!("direct and indirect, {BOUNCES} bounces"),
            percent(errors.total),
        ]);
        crate::report_line!("{table}");
        crate::report_line!("the exact solution took {:.1} s\n", errors.exact_seconds);
    }
    crate::report_line!("pictures:");
    for picture in &report.pictures {
        crate::report_line!("  {picture}");
    }
}
