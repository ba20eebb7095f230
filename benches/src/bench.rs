//! `mrt-bench`: run time against error, for the frame in many settings and for other methods that give the same light.
//!
//! Methods that are compared take turns while they are timed, and the light of each is compared with exact radiosity. The
//! modules follow the flow: what is asked for, what is measured, how, and what is written.

mod args;
mod chart;
mod dense;
mod dictionaries;
mod error;
mod exact_light;
mod frame_variant;
mod gather;
mod goal;
mod goals;
mod library;
mod lit_maze;
mod machine;
mod measure;
mod measure_error;
mod paper;
mod picture;
mod rays;
mod record;
mod report;
mod sampled_texel;
mod timed_frame;
mod timing;
mod vpl;

pub use args::BenchArgs;
pub use error::BenchError;

use dictionaries::Dictionaries;
use exact_light::ExactLight;
use goals::{Mazes, measure_goals};
use library::Libraries;
use lit_maze::LitMaze;
use machine::Machine;
use measure::{Baseline, Bench};
use mrt_editor::cli::output_files::OutputFiles;
use mrt_editor::cli::progress::with_progress;
use mrt_editor::render::file::make_folder;
use record::{Record, mark_pareto};
use report::{print_goals, print_records, write_goals, write_records};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Measures, prints and writes.
///
/// # Errors
/// [`BenchError`].
pub fn run(args: &BenchArgs) -> Result<(), BenchError> {
    let outputs = OutputFiles::new(args.dictionary.iter().map(PathBuf::as_path));
    outputs.check_folder("--out", &args.out, &["csv", "svg", "png"])?;
    let kept = args.out.join("exact");
    outputs.check_folder("--out", &kept, &["json"])?;
    let dictionaries = Dictionaries::new(args)?;
    make_folder(&kept)?;
    let machine = Machine::measure();
    if args.figures {
        let mazes = if args.quick {
            Mazes::QUICK
        } else {
            Mazes::FULL
        };
        let goals = with_bench(args, &machine, &kept, |bench| {
            Ok(measure_goals(bench, dictionaries.of_goals(), mazes)?)
        })?;
        write_goals(&args.out, &goals)?;
        Ok(print_goals(&goals, args.json)?)
    } else {
        let records = with_bench(args, &machine, &kept, |bench| {
            measure_mazes(args, &dictionaries, bench)
        })?;
        Ok(print_records(&records, &machine, args.json)?)
    }
}

/// Does long work that an interrupt stops.
fn with_bench<T>(
    args: &BenchArgs,
    machine: &Machine,
    kept: &Path,
    work: impl FnOnce(&mut Bench) -> Result<T, BenchError>,
) -> Result<T, BenchError> {
    let result = with_progress("bench", |progress| {
        work(&mut Bench {
            machine,
            budget: args.budget(),
            ray_limit: args.ray_limit(),
            libraries: Libraries::default(),
            kept,
            progress,
        })
    });
    result.map_err(BenchError::with_interrupts_on_top)
}

/// Measures all mazes with all dictionaries, and writes what is known after each maze.
fn measure_mazes(
    args: &BenchArgs,
    dictionaries: &Dictionaries,
    bench: &mut Bench,
) -> Result<Vec<Record>, BenchError> {
    let (mazes, variants) = (args.mazes(), args.variants());
    let steps = mazes.len() * dictionaries.iter().len();
    let mut step = 0;
    let mut records = Vec::new();
    for &count in mazes {
        let maze = LitMaze::new(count, args.lights.map(usize::from));
        // Methods without a dictionary depend on the resolution alone.
        let mut baselines: BTreeMap<usize, (Baseline, ExactLight)> = BTreeMap::new();
        for named in dictionaries.iter() {
            step += 1;
            let what = format!("{}, {}", maze.name, named.name);
            bench.progress.step(&what, step, steps)?;
            let resolution = named.dictionary.resolution;
            let exact = bench.exact_light(&maze, resolution)?;
            let variants = variants.of(&named.name, &named.dictionary);
            let reduced = bench.reduced(&maze, &exact, &variants)?;
            records.extend(reduced.records);
            if let Some(baseline) = reduced.baseline {
                baselines.entry(resolution).or_insert((baseline, exact));
            }
        }
        for (baseline, exact) in baselines.values() {
            records.extend(bench.dense(&maze, exact, baseline)?);
            records.extend(bench.rays(&maze, exact, baseline)?);
        }
        // Large mazes take long; a user who stops them keeps what is there.
        mark_pareto(&mut records);
        write_records(&args.out, &records, bench.machine)?;
    }
    Ok(records)
}
