//! Measures all methods on one level: those that use a dictionary, and those that need none.

use super::dense::{Dense, MAX_TEXELS, Product};
use super::exact_light::{ExactLight, ExactLightError};
use super::frame_variant::FrameVariant;
use super::library::Libraries;
use super::lit_maze::LitMaze;
use super::machine::Machine;
use super::measure_error::{FLUX_TOLERANCE, MeasureError};
use super::paper::{self, Paper};
use super::rays::{RayPoint, RayScene, Traced};
use super::record::{Record, StageRecord};
use super::timed_frame::{self, Cost, TimedFrame};
use super::timing::{Timed, Times, in_turns};
use super::{gather, vpl};
use mrt_core::simd::SimdLevel;
use mrt_dictionary::progress::Progress;
use mrt_editor::cli::output::warn;
use mrt_runtime::Coupling;
use std::path::Path;
use std::time::{Duration, Instant};

/// Above this number of blocks, methods are measured one after the other: their scenes would not fit into memory
/// together.
const TOGETHER_BLOCKS: usize = 2000;

/// Kept singular values.
const RANKS: [usize; 4] = [32, 64, 128, 256];

/// Virtual lights of a level.
const VIRTUAL_LIGHTS: [usize; 6] = [4, 16, 64, 256, 1024, 4096];

/// Rays of a texel.
const RAYS: [usize; 6] = [1, 4, 16, 64, 256, 1024];

/// With this number of rays or virtual lights for each light, and with more, noise moves the sum of all light by less than
/// [`FLUX_TOLERANCE`].
const FLUX_SAMPLES: usize = 64;

/// What all measurements share.
pub struct Bench<'a> {
    /// Limits of the machine.
    pub machine: &'a Machine,
    /// Time for each method.
    pub budget: Duration,
    /// Longest time for one sample of a ray method.
    pub ray_limit: Duration,
    /// Libraries chosen so far.
    pub libraries: Libraries,
    /// Folder of exact solutions.
    pub kept: &'a Path,
    /// Where steps are reported, and the wish to stop is found.
    pub progress: &'a Progress<'a>,
}

/// Direct light and the paper's time, which methods without a dictionary are compared with.
pub struct Baseline {
    frame: TimedFrame,
    direct_seconds: f64,
    paper_ms: f64,
    preset: String,
}

/// What was measured with one dictionary.
#[derive(Default)]
pub struct Reduced {
    /// One for the paper's way, and one a variant.
    pub records: Vec<Record>,
    /// `None` if the level does not fit into memory.
    pub baseline: Option<Baseline>,
}

/// A method, and what records call the case.
struct MethodCase<'a> {
    method: &'static str,
    /// The part of the case after the level.
    name: String,
    preset: &'a str,
}

/// A ray method with the numbers of samples to try.
struct Sweep {
    method: &'static str,
    trace: fn(&RayScene, &[RayPoint], usize) -> Traced,
    counts: [usize; 6],
    /// Fewest samples that the method can work with.
    fewest: usize,
}

/// What ray methods light, and where.
struct RayWork<'a> {
    maze: &'a LitMaze,
    exact: &'a ExactLight,
    baseline: &'a Baseline,
    scene: RayScene,
    /// The sampled texels.
    points: Vec<RayPoint>,
}

impl Bench<'_> {
    /// The exact light of a maze at the texels of a resolution.
    ///
    /// # Errors
    /// [`ExactLightError`].
    pub fn exact_light(
        &self,
        maze: &LitMaze,
        resolution: usize,
    ) -> Result<ExactLight, ExactLightError> {
        ExactLight::load_or_solve(maze, resolution, self.kept, self.progress)
    }

    /// The frame in all variants of one dictionary, and the paper's way. Levels that would need too much memory are left
    /// out, with a word on standard error.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn reduced(
        &mut self,
        maze: &LitMaze,
        exact: &ExactLight,
        variants: &[FrameVariant],
    ) -> Result<Reduced, MeasureError> {
        let mut reduced = Reduced::default();
        let group = match maze.level.blocks.len() <= TOGETHER_BLOCKS {
            true => variants.len().max(1),
            false => 1,
        };
        for variants in variants.chunks(group) {
            match self.add_variants(maze, exact, variants, &mut reduced) {
                Err(MeasureError::Frame { case, source }) if source.is_size() => {
                    warn(format_args!("{case} is left out: {source}"));
                    return Ok(Reduced::default());
                }
                result => result?,
            }
        }
        Ok(reduced)
    }

    /// Measures some variants in turns with the paper's way.
    fn add_variants(
        &mut self,
        maze: &LitMaze,
        exact: &ExactLight,
        variants: &[FrameVariant],
        reduced: &mut Reduced,
    ) -> Result<(), MeasureError> {
        let mut frames = Vec::with_capacity(variants.len());
        for variant in variants {
            self.progress.check()?;
            frames.push(timed_frame(maze, variant)?);
        }
        let dictionary = variants[0].dictionary;
        let mut paper = Paper::new(maze, dictionary, &frames[0], &mut self.libraries)?;
        let mut subjects: Vec<&mut dyn Timed> = vec![&mut paper];
        subjects.extend(frames.iter_mut().map(|frame| frame as &mut dyn Timed));
        let times = in_turns(&mut subjects, self.budget, self.progress)?;
        let direct_seconds = times[1].median(&[0]);
        let mut record = self.paper_record(maze, &variants[0], &paper, &times[0]);
        let paper_ms = record.ms;
        let is_first = reduced.baseline.is_none();
        if is_first {
            record.ms_from_lights = record.ms + 1e3 * direct_seconds;
            let light = paper.irradiance(&frames[0].scene, &exact.texels);
            reduced.records.push(with_error(record, exact, &light)?);
        }
        for ((variant, frame), times) in variants.iter().zip(&frames).zip(&times[1..]) {
            let record = Record {
                paper_dense_ms: paper_ms,
                ..self.frame_record(maze, variant, frame, times)
            };
            let light = frame.irradiance(&exact.texels);
            reduced.records.push(with_error(record, exact, &light)?);
        }
        if is_first {
            reduced.baseline = Some(Baseline {
                frame: frames.swap_remove(0),
                direct_seconds,
                paper_ms,
                preset: variants[0].preset.to_owned(),
            });
        }
        Ok(())
    }

    fn frame_record(
        &self,
        maze: &LitMaze,
        variant: &FrameVariant,
        frame: &TimedFrame,
        times: &Times,
    ) -> Record {
        let costs = frame.costs();
        let touched: f64 = costs.iter().map(|cost| cost.bytes).sum();
        let limits = Limits {
            peak: self.machine.peak(variant.simd, variant.threads),
            bandwidth: self.machine.bandwidth(touched as usize),
        };
        let method_case = MethodCase {
            method: "mrt",
            name: variant.name(),
            preset: variant.preset,
        };
        Record {
            stages: stages(&timed_frame::STAGES, times, &costs, limits),
            ms: 1e3 * times.median(&timed_frame::INDIRECT_STAGES),
            ms_min: 1e3 * times.smallest(&timed_frame::INDIRECT_STAGES),
            ms_from_lights: 1e3 * times.median(&timed_frame::LIGHT_STAGES),
            runs: times.count(),
            storage: variant.storage.name(),
            coupling: match variant.coupling {
                Coupling::Table => "table",
                Coupling::Lightfield => "lightfield",
            },
            simd: variant.simd.name(),
            threads: variant.threads,
            size: frame.modes(),
            bytes: frame.resident_bytes(),
            bytes_touched: touched as usize,
            ..empty_record(maze, method_case, frame.resolution())
        }
    }

    fn paper_record(
        &self,
        maze: &LitMaze,
        variant: &FrameVariant,
        paper: &Paper,
        times: &Times,
    ) -> Record {
        let bytes = paper.bytes();
        let ms = 1e3 * times.median(&paper::ALL_STAGES);
        let method_case = MethodCase {
            method: "paper",
            name: format!("{}/paper/t1", variant.preset),
            preset: variant.preset,
        };
        Record {
            size: paper.response_modes,
            coupling: "lightfield",
            library: paper.library_names().join("+"),
            ms,
            ms_min: 1e3 * times.smallest(&paper::ALL_STAGES),
            ms_from_lights: ms,
            runs: times.count(),
            paper_dense_ms: ms,
            bytes,
            bytes_touched: bytes,
            stages: stages(
                &paper::STAGES,
                times,
                &paper.costs(),
                self.one_core_limits(bytes),
            ),
            ..empty_record(maze, method_case, variant.dictionary.resolution)
        }
    }

    /// F of the level, if it is small, and its decompositions with fewer singular values.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn dense(
        &mut self,
        maze: &LitMaze,
        exact: &ExactLight,
        baseline: &Baseline,
    ) -> Result<Vec<Record>, MeasureError> {
        if baseline.frame.scene.texel_count() > MAX_TEXELS {
            return Ok(Vec::new());
        }
        let dense = Dense::new(maze, &baseline.frame)?;
        self.progress.check()?;
        let texels = dense.operator.rows();
        let ranks: Vec<usize> = RANKS.into_iter().filter(|k| 2 * k < texels).collect();
        let decompositions = dense.decompositions(&ranks)?;
        let mut products = vec![dense.whole(&mut self.libraries)?];
        for factors in &decompositions {
            products.push(dense.factored(factors, &mut self.libraries)?);
        }
        let mut subjects: Vec<&mut dyn Timed> =
            products.iter_mut().map(|p| p as &mut dyn Timed).collect();
        let times = in_turns(&mut subjects, self.budget, self.progress)?;
        let sizes = std::iter::once(texels).chain(ranks);
        let mut records = Vec::new();
        for ((product, times), size) in products.iter().zip(&times).zip(sizes) {
            let resolution = baseline.frame.resolution();
            let method_case = match size == texels {
                true => MethodCase {
                    method: "dense",
                    name: format!("r{resolution}/dense/t1"),
                    preset: &baseline.preset,
                },
                false => MethodCase {
                    method: "svd",
                    name: format!("r{resolution}/svd{size}/t1"),
                    preset: &baseline.preset,
                },
            };
            let record = Record {
                size,
                ms_from_lights: 1e3 * (times.median(&[0]) + baseline.direct_seconds),
                paper_dense_ms: baseline.paper_ms,
                ..self.product_record(product, times, empty_record(maze, method_case, resolution))
            };
            let light = dense.irradiance(product.light(), &exact.texels);
            records.push(with_error(record, exact, &light)?);
        }
        Ok(records)
    }

    /// Times and sizes of a product.
    fn product_record(&self, product: &Product, times: &Times, record: Record) -> Record {
        let bytes = product.bytes();
        let cost = Cost {
            flops: product.flops(),
            bytes: bytes as f64,
        };
        Record {
            ms: 1e3 * times.median(&[0]),
            ms_min: 1e3 * times.smallest(&[0]),
            runs: times.count(),
            library: product.library_names().join("+"),
            bytes,
            bytes_touched: bytes,
            stages: stages(&["F"], times, &[cost], self.one_core_limits(bytes)),
            ..record
        }
    }

    /// Virtual point lights, and rays from texels. Only the sampled texels are lit; the time of all texels follows from
    /// theirs.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn rays(
        &mut self,
        maze: &LitMaze,
        exact: &ExactLight,
        baseline: &Baseline,
    ) -> Result<Vec<Record>, MeasureError> {
        let sweeps = [
            Sweep {
                method: "vpl",
                trace: vpl::trace,
                counts: VIRTUAL_LIGHTS,
                // Each light has one virtual light at least.
                fewest: maze.lights.len(),
            },
            Sweep {
                method: "gather",
                trace: gather::trace,
                counts: RAYS,
                fewest: 1,
            },
        ];
        let work = RayWork {
            maze,
            exact,
            baseline,
            scene: RayScene::new(maze),
            points: exact.texels.iter().map(RayPoint::of).collect(),
        };
        let mut records = Vec::new();
        for sweep in sweeps {
            records.extend(self.sweep(&sweep, &work)?);
        }
        Ok(records)
    }

    fn sweep(&self, sweep: &Sweep, work: &RayWork) -> Result<Vec<Record>, MeasureError> {
        let RayWork {
            maze,
            exact,
            baseline,
            scene,
            points,
        } = work;
        let all_texels = baseline.frame.scene.texel_count() as f64;
        let seconds = |t: &Traced| t.start_seconds + all_texels * t.receiver_seconds;
        let resolution = baseline.frame.resolution();
        let mut records = Vec::new();
        let mut last = Duration::ZERO;
        for count in sweep.counts.into_iter().filter(|&k| k >= sweep.fewest) {
            self.progress.check()?;
            // Each step of a sweep takes four times as long as the one before.
            if 4 * last > self.ray_limit {
                break;
            }
            let start = Instant::now();
            let runs = [(); 2].map(|()| (sweep.trace)(scene, points, count));
            last = start.elapsed();
            let ms = 1e3 * runs.iter().map(seconds).fold(f64::INFINITY, f64::min);
            let method_case = MethodCase {
                method: sweep.method,
                name: format!("r{resolution}/{}{count}/t1", sweep.method),
                preset: &baseline.preset,
            };
            let record = Record {
                size: count,
                ms,
                ms_min: ms,
                ms_from_lights: ms,
                runs: runs.len(),
                paper_dense_ms: baseline.paper_ms,
                bytes: scene.bytes(),
                bytes_touched: scene.bytes(),
                ..empty_record(maze, method_case, resolution)
            };
            let light = &runs[0].irradiance;
            let is_noisy = count < FLUX_SAMPLES * maze.lights.len();
            records.push(match is_noisy {
                true => with_any_error(record, exact, light),
                false => with_error(record, exact, light)?,
            });
        }
        Ok(records)
    }

    /// Limits of one core with the best instructions, for work on this number of bytes.
    fn one_core_limits(&self, bytes: usize) -> Limits {
        Limits {
            peak: self.machine.peak(SimdLevel::detect(), 1),
            bandwidth: self.machine.bandwidth(bytes),
        }
    }
}

/// A frame to be timed.
///
/// # Errors
/// [`MeasureError::Frame`].
pub fn timed_frame(maze: &LitMaze, variant: &FrameVariant) -> Result<TimedFrame, MeasureError> {
    TimedFrame::new(maze, variant).map_err(|source| MeasureError::Frame {
        case: format!("{}/{}", maze.name, variant.name()),
        source,
    })
}

/// A record without measurements, of one thread with the best instructions.
fn empty_record(maze: &LitMaze, method_case: MethodCase, resolution: usize) -> Record {
    Record {
        case: format!("{}/{}", maze.name, method_case.name),
        level: maze.name.clone(),
        blocks: maze.level.blocks.len(),
        lights: maze.lights.len(),
        method: method_case.method,
        preset: method_case.preset.to_owned(),
        resolution,
        size: 0,
        storage: "f32",
        coupling: "",
        simd: SimdLevel::detect().name(),
        threads: 1,
        library: String::new(),
        ms: f64::NAN,
        ms_min: f64::NAN,
        ms_from_lights: f64::NAN,
        runs: 0,
        rel_l2: f64::NAN,
        paper_dense_ms: f64::NAN,
        bytes: 0,
        bytes_touched: 0,
        stages: Vec::new(),
        pareto: false,
    }
}

/// What the machine can do at most for a method.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// Operations a second in units of 1e9.
    peak: f64,
    /// Bytes a second in units of 1e9.
    bandwidth: f64,
}

fn stages(
    names: &[&'static str],
    times: &Times,
    costs: &[Cost],
    limits: Limits,
) -> Vec<StageRecord> {
    let stage = |(k, (&stage, cost)): (usize, (&&'static str, &Cost))| {
        let seconds = times.median(&[k]);
        // A stage shorter than the clock's tick has no rate.
        let rate = |amount: f64| match seconds > 0.0 {
            true => amount / seconds / 1e9,
            false => 0.0,
        };
        StageRecord {
            stage,
            ms: 1e3 * seconds,
            gflops: rate(cost.flops),
            peak_share: rate(cost.flops) / limits.peak,
            gbytes_per_s: rate(cost.bytes),
            bandwidth_share: rate(cost.bytes) / limits.bandwidth,
        }
    };
    names.iter().zip(costs).enumerate().map(stage).collect()
}

/// The record with its error; refused if the sum of all light is wrong.
fn with_error(
    record: Record,
    exact: &ExactLight,
    light: &[[f64; 3]],
) -> Result<Record, MeasureError> {
    let found = exact.flux_ratio(light);
    if found.is_nan() || (found - 1.0).abs() > FLUX_TOLERANCE {
        return Err(MeasureError::Light {
            case: record.case,
            found,
        });
    }
    Ok(with_any_error(record, exact, light))
}

fn with_any_error(record: Record, exact: &ExactLight, light: &[[f64; 3]]) -> Record {
    Record {
        rel_l2: exact.rel_l2(light),
        ..record
    }
}
