//! `mrt-bench`: run time against error, for the frame in many settings and for other ways to the same light.

mod chart;
mod dense;
mod gather;
mod goals;
mod library;
mod machine;
mod measure;
mod ours;
mod paper;
mod picture;
mod rays;
mod record;
mod reference;
mod setting;
mod timing;
mod vpl;

use goals::{Goal, Mazes, Presets};
use machine::Machine;
use measure::{Baseline, Bench, MeasureError};
use mrt_core::container::write_file_atomically;
use mrt_core::simd::SimdLevel;
use mrt_dictionary::config::{BakeConfig, ConfigError};
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_editor::cli::accuracy::CouplingArg;
use mrt_editor::cli::dictionary_source::{
    DEFAULT_PRESET, SourceError, bake_with_progress, from_file, from_preset, with_progress,
};
use mrt_editor::render::file::WriteError;
use mrt_runtime::low_level::level::block::MAX_BLOCKS;
use mrt_runtime::{Coupling, Dictionary};
use ours::{Packing, Variant};
use record::{Record, mark_pareto, significant};
use reference::{Reference, ReferenceError};
use setting::Setting;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Measures run time and error of the frame, of the paper's dense products, and of other methods, on mazes.
///
/// From the first of each list, one setting is changed at a time; --product takes all combinations.
#[derive(Clone, Debug, clap::Parser)]
#[command(name = "mrt-bench", version, max_term_width = 100)]
pub struct BenchArgs {
    /// Folder for tables, plots and exact solutions, which are kept for the next run.
    #[arg(long, default_value = "bench")]
    pub out: PathBuf,
    /// Blocks of the mazes [default: 1,5,11,41,1000,10000, or 1,11,41 with --quick].
    #[arg(long, value_delimiter = ',', value_name = "COUNT,...", value_parser = block_count)]
    pub blocks: Vec<usize>,
    /// Lights in each maze [default: one for each ten blocks, 1 to 16].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub lights: Option<u16>,
    /// Dictionary presets; all but standard are baked first [default: standard,mobile,high, or standard,mobile with
    /// --quick; none with --dictionary].
    #[arg(long, value_delimiter = ',', value_name = "PRESET,...")]
    pub presets: Vec<String>,
    /// Dictionary files.
    #[arg(long, value_delimiter = ',', value_name = "FILE,...")]
    pub dictionary: Vec<PathBuf>,
    /// Also bakes the standard preset at these resolutions, texels along an edge of a wall.
    #[arg(long, value_delimiter = ',', value_name = "TEXELS,...")]
    pub resolutions: Vec<usize>,
    /// Also bakes the standard preset with these numbers of modes.
    #[arg(long, value_delimiter = ',', value_name = "MODES,...")]
    pub modes: Vec<usize>,
    /// How operators are stored; mixed is f32 within blocks and f16 from block to block.
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "mixed,f32,f16,int8"
    )]
    pub storages: Vec<Packing>,
    /// How light is taken from block to block.
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "table,lightfield"
    )]
    pub coupling: Vec<CouplingArg>,
    /// Instructions: scalar, sse2, avx2, avx512 or neon [default: all that the machine has, fastest first].
    #[arg(long, value_delimiter = ',', value_name = "LEVEL,...", value_parser = simd_level)]
    pub simd: Vec<SimdLevel>,
    /// Threads [default: 1 and as many as there are cores].
    #[arg(long, value_delimiter = ',', value_name = "COUNT,...", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Vec<u16>,
    /// All combinations of storage, coupling, instructions and threads.
    #[arg(long)]
    pub product: bool,
    /// Measures only what the frame is held to, and says what is met; what needs the high preset asks for its file with
    /// --dictionary, or for --presets high. With --quick, of smaller mazes.
    #[arg(long)]
    pub figures: bool,
    /// Fewer mazes and dictionaries, and less time for each: about two minutes.
    #[arg(long)]
    pub quick: bool,
    /// Print one JSON object a line and nothing else: case, ms, rel_l2, paper_dense_ms, bytes and more.
    #[arg(long)]
    pub json: bool,
}

fn block_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_BLOCKS).contains(&count) => Ok(count),
        _ => Err(format!("expected 1 to {MAX_BLOCKS} blocks")),
    }
}

fn simd_level(text: &str) -> Result<SimdLevel, String> {
    match SimdLevel::from_name(text) {
        Some(level) if level.is_available() => Ok(level),
        _ => {
            let names: Vec<&str> = SimdLevel::available().map(SimdLevel::name).collect();
            Err(format!("this machine has {}", names.join(", ")))
        }
    }
}

/// Why there is no benchmark.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A setting of a bake is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The user stopped it.
    #[error("{0}; no table and no plot was written")]
    Cancelled(#[from] Cancelled),
    /// A measurement failed.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// No exact light.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A file stands where the folder should be.
    #[error("--out {file}: found a file; expected a folder or a new name")]
    OutIsFile {
        /// The file.
        file: String,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A record has no form as JSON.
    #[error("the report cannot be printed: {0}")]
    Report(#[from] serde_json::Error),
}

/// Presets that are baked where they are asked for.
const MOBILE: &str = "mobile";
const HIGH: &str = "high";

/// A dictionary and what it is called.
struct Named {
    name: String,
    dictionary: Dictionary,
}

/// Measures, prints and writes.
///
/// # Errors
/// [`BenchError`].
pub fn run(args: &BenchArgs) -> Result<(), BenchError> {
    if args.out.exists() && !args.out.is_dir() {
        return Err(BenchError::OutIsFile {
            file: args.out.display().to_string(),
        });
    }
    let dictionaries = dictionaries(args)?;
    let kept = args.out.join("exact");
    std::fs::create_dir_all(&kept).map_err(|source| WriteError::Io {
        path: kept.clone(),
        source,
    })?;
    let machine = Machine::measure();
    let measured = with_progress("bench", |progress| {
        let mut bench = Bench {
            machine: &machine,
            budget: Duration::from_millis(if args.quick { 150 } else { 1000 }),
            ray_limit: Duration::from_millis(if args.quick { 1500 } else { 15_000 }),
            libraries: library::Libraries::default(),
            progress,
        };
        if args.figures {
            let mazes = if args.quick {
                Mazes::QUICK
            } else {
                Mazes::FULL
            };
            let goals = bench.goals(presets(&dictionaries), mazes, &kept)?;
            return Ok((Vec::new(), goals));
        }
        let records = measure_all(args, &dictionaries, &kept, &mut bench, progress)?;
        Ok((records, Vec::new()))
    });
    let (records, goals) = measured.map_err(|error| match error {
        BenchError::Measure(
            MeasureError::Cancelled(cancelled)
            | MeasureError::Reference(ReferenceError::Cancelled(cancelled)),
        )
        | BenchError::Reference(ReferenceError::Cancelled(cancelled)) => cancelled.into(),
        other => other,
    })?;
    if args.figures {
        return report_goals(args, &goals);
    }
    if args.json {
        for record in &records {
            mrt_editor::report_line!("{}", serde_json::to_string(record)?);
        }
    } else {
        print(&records, &machine);
    }
    Ok(())
}

/// Those that figures speak of; [`dictionaries`] has them.
fn presets(dictionaries: &[Named]) -> Presets<'_> {
    let named = |name: &str| {
        let mut all = dictionaries.iter();
        all.find(|named| named.name == name)
            .map(|named| &named.dictionary)
    };
    let added = "figures add it where it is not given";
    Presets {
        standard: named(DEFAULT_PRESET).expect(added),
        mobile: named(MOBILE).expect(added),
        high: named(HIGH),
    }
}

fn report_goals(args: &BenchArgs, goals: &[Goal]) -> Result<(), BenchError> {
    let path = args.out.join("figures.csv");
    write_file_atomically(&path, goals::csv(goals).as_bytes()).map_err(WriteError::File)?;
    if args.json {
        for goal in goals {
            mrt_editor::report_line!("{}", serde_json::to_string(goal)?);
        }
    } else {
        mrt_editor::report!("{}", goals::table(goals));
        mrt_editor::report_line!();
        mrt_editor::report!("{}", goals::stages(goals));
    }
    Ok(())
}

/// Dictionaries from files, of presets, and baked for the sweep.
fn dictionaries(args: &BenchArgs) -> Result<Vec<Named>, BenchError> {
    let mut found: Vec<Named> = Vec::new();
    let mut add = |name: String, dictionary: Dictionary| {
        let same = found.iter().filter(|other| other.name.starts_with(&name));
        let name = match same.count() {
            0 => name,
            count => format!("{name}-{}", count + 1),
        };
        found.push(Named { name, dictionary });
    };
    let presets: Vec<&str> = match (args.presets.is_empty(), args.dictionary.is_empty()) {
        (false, _) => args.presets.iter().map(String::as_str).collect(),
        (true, false) => Vec::new(),
        (true, true) if args.figures => Vec::new(),
        (true, true) if args.quick => vec![DEFAULT_PRESET, MOBILE],
        (true, true) => vec![DEFAULT_PRESET, MOBILE, HIGH],
    };
    // All names are checked before the first bake.
    for preset in &presets {
        BakeConfig::preset(preset)?;
    }
    let sweep = sweep(args)?;
    let set = mrt_editor::cli::dictionary_source::DEFAULT_SET;
    for file in &args.dictionary {
        let dictionary = from_file(file)?;
        add(dictionary.preset.replace('/', "-"), dictionary);
    }
    for preset in presets {
        add(preset.to_owned(), from_preset(set, Some(preset))?);
    }
    for config in sweep {
        let dictionary = bake_with_progress(&config).map_err(SourceError::Cancelled)?;
        add(config.preset.clone(), dictionary);
    }
    if args.figures {
        for preset in [DEFAULT_PRESET, MOBILE] {
            if !found.iter().any(|named| named.name == preset) {
                let (name, dictionary) = (preset.to_owned(), from_preset(set, Some(preset))?);
                found.push(Named { name, dictionary });
            }
        }
    }
    Ok(found)
}

/// Settings of the dictionaries that vary resolution and modes.
fn sweep(args: &BenchArgs) -> Result<Vec<BakeConfig>, ConfigError> {
    let standard = BakeConfig::preset(DEFAULT_PRESET)?;
    if args.resolutions.is_empty() && args.modes.is_empty() {
        return Ok(Vec::new());
    }
    let or_standard = |given: &[usize], standard: usize| match given {
        [] => vec![standard],
        given => given.to_vec(),
    };
    let mut configs = Vec::new();
    for &resolution in &or_standard(&args.resolutions, standard.resolution) {
        for &modes in &or_standard(&args.modes, standard.modes) {
            let mut config = standard.clone();
            config.preset = format!("r{resolution}m{modes}");
            config.resolution = resolution;
            // The modes of light between blocks keep their ratio to those within one.
            let scaled = |count: usize| (count * modes).div_ceil(standard.modes);
            config.modes = modes;
            config.coupling.emission_modes = scaled(standard.coupling.emission_modes);
            config.coupling.response_modes = scaled(standard.coupling.response_modes);
            config.coupling.foreign_modes = scaled(standard.coupling.foreign_modes);
            config.outputs.probes = 0;
            config.check()?;
            configs.push(config);
        }
    }
    Ok(configs)
}

fn measure_all(
    args: &BenchArgs,
    dictionaries: &[Named],
    kept: &Path,
    bench: &mut Bench,
    progress: &Progress,
) -> Result<Vec<Record>, BenchError> {
    let blocks: &[usize] = match (args.blocks.as_slice(), args.quick) {
        ([], true) => &[1, 11, 41],
        ([], false) => &[1, 5, 11, 41, 1000, 10_000],
        (given, _) => given,
    };
    let steps = blocks.len() * dictionaries.len();
    let mut records = Vec::new();
    for (k, &count) in blocks.iter().enumerate() {
        let setting = Setting::new(count, args.lights.map(usize::from));
        // Ways without a dictionary depend on its resolution alone.
        let mut baselines: BTreeMap<usize, (Baseline, Reference)> = BTreeMap::new();
        for (i, named) in dictionaries.iter().enumerate() {
            let what = format!("{}, {}", setting.name, named.name);
            progress.step(&what, k * dictionaries.len() + i + 1, steps)?;
            let resolution = named.dictionary.resolution;
            let reference = Reference::load_or_solve(&setting, resolution, kept, progress)?;
            let variants = variants(args, named);
            let (found, baseline) = match bench.reduced(&setting, &reference, &variants) {
                Err(MeasureError::Ours { case, source }) if source.is_size() => {
                    eprintln!("mrt-bench: {case} is left out: {source}");
                    continue;
                }
                other => other?,
            };
            records.extend(found);
            if let Some(baseline) = baseline {
                let entry = baselines.entry(resolution);
                entry.or_insert((baseline, reference));
            }
        }
        for (baseline, reference) in baselines.values() {
            records.extend(bench.dense(&setting, reference, baseline)?);
            records.extend(bench.rays(&setting, reference, baseline)?);
        }
        // Large mazes take long, and who does not wait for them keeps what there is.
        mark_pareto(&mut records);
        write_files(&args.out, &records, bench.machine)?;
    }
    Ok(records)
}

/// The settings to measure with a dictionary; the first is the one that others differ from.
fn variants<'a>(args: &BenchArgs, named: &'a Named) -> Vec<Variant<'a>> {
    let couplings: Vec<Coupling> = args.coupling.iter().map(|&c| c.into()).collect();
    let mut levels = args.simd.clone();
    if levels.is_empty() {
        levels = SimdLevel::available().collect();
        levels.reverse();
    }
    let mut threads: Vec<usize> = args.threads.iter().map(|&t| usize::from(t)).collect();
    if threads.is_empty() {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        threads = if cores > 1 { vec![1, cores] } else { vec![1] };
    }
    let mut variants = Vec::new();
    for (a, &storage) in args.storages.iter().enumerate() {
        for (b, &coupling) in couplings.iter().enumerate() {
            for (c, &simd) in levels.iter().enumerate() {
                for (d, &threads) in threads.iter().enumerate() {
                    let changes = [a, b, c, d].iter().filter(|&&k| k > 0).count();
                    if changes <= 1 || args.product {
                        variants.push(Variant {
                            preset: &named.name,
                            dictionary: &named.dictionary,
                            storage,
                            coupling,
                            simd,
                            threads,
                        });
                    }
                }
            }
        }
    }
    variants
}

fn write_files(out: &Path, records: &[Record], machine: &Machine) -> Result<(), WriteError> {
    let write = |name: String, text: String| {
        write_file_atomically(&out.join(name), text.as_bytes()).map_err(WriteError::File)
    };
    write("bench.csv".to_owned(), record::csv(records))?;
    write("stages.csv".to_owned(), record::stages_csv(records))?;
    write("machine.csv".to_owned(), record::machine_csv(machine))?;
    let mut levels: Vec<&str> = records.iter().map(|r| r.level.as_str()).collect();
    levels.dedup();
    for level in levels {
        for view in chart::View::ALL {
            let remarks = remarks(level, view, records, machine);
            let marks = chart::draw(level, view, records, &remarks);
            let name = format!("{level}{}", view.suffix());
            write(format!("{name}.svg"), picture::svg(&marks))?;
            picture::canvas(&marks).write(&out.join(format!("{name}.png")))?;
        }
    }
    Ok(())
}

fn remarks(level: &str, view: chart::View, records: &[Record], machine: &Machine) -> Vec<String> {
    let simd = SimdLevel::detect();
    let lights = records.iter().find(|r| r.level == level).map(|r| r.lights);
    let lights = match lights {
        Some(1) => "1 light".to_owned(),
        other => format!("{} lights", other.unwrap_or(0)),
    };
    vec![
        format!(
            "{lights}; peak of a core {} GFLOP/s ({}), memory {} GB/s{}",
            significant(machine.peak(simd, 1)),
            simd.name(),
            significant(machine.memory()),
            match view {
                chart::View::Methods => "; numbers are virtual lights, and rays of a texel",
                chart::View::Frame => "",
            }
        ),
        "Errors are against exact radiosity at each dictionary's own texel centres.".to_owned(),
    ]
}

fn print(records: &[Record], machine: &Machine) {
    mrt_editor::report!("{}", record::overview(records));
    mrt_editor::report_line!();
    for sentence in record::rays_at_equal_time(records) {
        mrt_editor::report_line!("{sentence}");
    }
    mrt_editor::report_line!();
    mrt_editor::report!("{}", record::stages(records));
    mrt_editor::report_line!();
    for (level, gflops) in &machine.gflops {
        mrt_editor::report_line!(
            "one core, {}: {} GFLOP/s",
            level.name(),
            significant(*gflops)
        );
    }
    for (bytes, rate) in &machine.reads {
        let (bytes, rate) = (significant(*bytes as f64 / 1e6), significant(*rate));
        mrt_editor::report_line!("one core, reading {bytes} MB again and again: {rate} GB/s");
    }
}
