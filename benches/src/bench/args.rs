//! Flags of `mrt-bench`.

use super::frame_variant::{Packing, VariantLists};
use mrt_core::simd::SimdLevel;
use mrt_editor::cli::dictionary_report::CouplingArg;
use mrt_runtime::low_level::level::block::MAX_BLOCKS;
use std::path::PathBuf;
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
    /// Measures only the figures that the frame is held to, and says which are met. Those of the high preset need its file
    /// with --dictionary, or --presets high. With --quick, of smaller mazes.
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

impl BenchArgs {
    /// Blocks of the mazes asked for, or of the usual ones.
    pub(super) fn mazes(&self) -> &[usize] {
        match (self.blocks.as_slice(), self.quick) {
            ([], true) => &[1, 11, 41],
            ([], false) => &[1, 5, 11, 41, 1000, 10_000],
            (given, _) => given,
        }
    }

    /// The settings asked for, or the usual ones.
    pub(super) fn variants(&self) -> VariantLists {
        let mut simd = self.simd.clone();
        if simd.is_empty() {
            simd = SimdLevel::available().collect();
            simd.reverse();
        }
        let mut threads: Vec<usize> = self.threads.iter().map(|&t| usize::from(t)).collect();
        if threads.is_empty() {
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            threads = if cores > 1 { vec![1, cores] } else { vec![1] };
        }
        VariantLists {
            storages: self.storages.clone(),
            couplings: self
                .coupling
                .iter()
                .map(|&coupling| coupling.into())
                .collect(),
            simd,
            threads,
            product: self.product,
        }
    }

    /// Time for each method.
    pub(super) fn budget(&self) -> Duration {
        Duration::from_millis(if self.quick { 150 } else { 1000 })
    }

    /// Longest time for one sample of a ray method.
    pub(super) fn ray_limit(&self) -> Duration {
        Duration::from_millis(if self.quick { 1500 } else { 15_000 })
    }
}
