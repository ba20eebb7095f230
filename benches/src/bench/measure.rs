//! All ways to light one level with one dictionary, and those that need none.

use super::dense::{Dense, DenseError, MAX_TEXELS};
use super::library::{Libraries, WrongProduct};
use super::machine::Machine;
use super::ours::{self, Cost, Ours, OursError, Variant};
use super::paper::{self, Paper, PaperError};
use super::rays::{RayScene, Traced, WallPoint};
use super::record::{Record, StageRecord};
use super::reference::{Reference, ReferenceError};
use super::setting::Setting;
use super::timing::{Timed, Times, in_turns};
use super::{gather, vpl};
use mrt_core::simd::SimdLevel;
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_runtime::Coupling;
use std::time::Duration;

/// Above so many blocks ways are measured one after the other: their scenes would not fit into memory together.
const TOGETHER_BLOCKS: usize = 2000;

/// Kept singular values.
const RANKS: [usize; 4] = [32, 64, 128, 256];

/// Virtual lights of a level.
const VIRTUAL_LIGHTS: [usize; 6] = [4, 16, 64, 256, 1024, 4096];

/// Rays of a texel.
const RAYS: [usize; 6] = [1, 4, 16, 64, 256, 1024];

/// How far the sum of all light may be from the exact one. Bases of few modes and sampled direct light move it by up to
/// 4 %, bounded virtual lights by 8 %, and rays by their noise.
const FLUX_TOLERANCE: f64 = 0.15;

/// Rays or virtual lights from which on noise is below that.
const FLUX_SAMPLES: usize = 64;

/// Why a level was not measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The frame.
    #[error("{case}: {source}")]
    Ours {
        /// What was measured.
        case: String,
        /// Why not.
        source: OursError,
    },
    /// The paper's products.
    #[error(transparent)]
    Paper(#[from] PaperError),
    /// F of the level.
    #[error(transparent)]
    Dense(#[from] DenseError),
    /// A library.
    #[error(transparent)]
    Product(#[from] WrongProduct),
    /// The exact light.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// Threads to compare with.
    #[error("no threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A way that does not give the level's light.
    #[error(
        "{case}: indirect light is {found:.3} times the exact one in all; expected within {FLUX_TOLERANCE} of 1"
    )]
    Light {
        /// What was measured.
        case: String,
        /// Its flux over that of the reference.
        found: f64,
    },
}

/// What all measurements share.
pub struct Bench<'a> {
    /// Limits of the machine.
    pub machine: &'a Machine,
    /// Time for each way.
    pub budget: Duration,
    /// Longest time for one sample of a ray method.
    pub ray_limit: Duration,
    /// Libraries chosen so far.
    pub libraries: Libraries,
    /// Steps and the wish to stop.
    pub progress: &'a Progress<'a>,
}

/// Direct light and the paper's time, to which ways without a dictionary are compared.
pub struct Baseline {
    ours: Ours,
    direct_seconds: f64,
    paper_ms: f64,
    preset: String,
}

impl Bench<'_> {
    /// The frame in all variants of one dictionary, and the paper's way.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn reduced(
        &mut self,
        setting: &Setting,
        reference: &Reference,
        variants: &[Variant],
    ) -> Result<(Vec<Record>, Option<Baseline>), MeasureError> {
        let mut records = Vec::new();
        let mut baseline = None;
        let group = match setting.level.blocks.len() <= TOGETHER_BLOCKS {
            true => variants.len().max(1),
            false => 1,
        };
        for variants in variants.chunks(group) {
            let mut all = Vec::with_capacity(variants.len());
            for variant in variants {
                self.progress.check()?;
                let ours = Ours::new(setting, variant);
                all.push(ours.map_err(|source| MeasureError::Ours {
                    case: format!("{}/{}", setting.name, variant.name()),
                    source,
                })?);
            }
            let dictionary = variants[0].dictionary;
            let mut paper = Paper::new(setting, dictionary, &all[0], &mut self.libraries)?;
            let mut subjects: Vec<&mut dyn Timed> = vec![&mut paper];
            subjects.extend(all.iter_mut().map(|ours| ours as &mut dyn Timed));
            let times = in_turns(&mut subjects, self.budget, self.progress)?;
            let direct_seconds = times[1].median(&[0]);
            let mut record = self.paper(setting, variants[0], &paper, &times[0]);
            let paper_ms = record.ms;
            if baseline.is_none() {
                record.ms_from_lights = record.ms + 1e3 * direct_seconds;
                let light = paper.irradiance(&all[0].scene, &reference.receivers);
                records.push(with_error(record, reference, &light)?);
            }
            for ((variant, ours), times) in variants.iter().zip(&all).zip(&times[1..]) {
                let mut record = self.ours(setting, variant, ours, times);
                record.paper_dense_ms = paper_ms;
                let light = ours.irradiance(&reference.receivers);
                records.push(with_error(record, reference, &light)?);
            }
            if baseline.is_none() {
                baseline = Some(Baseline {
                    ours: all.swap_remove(0),
                    direct_seconds,
                    paper_ms,
                    preset: variants[0].preset.to_owned(),
                });
            }
        }
        Ok((records, baseline))
    }

    fn ours(&self, setting: &Setting, variant: &Variant, ours: &Ours, times: &Times) -> Record {
        let costs = ours.costs();
        let peak = self.machine.peak(variant.simd, variant.threads);
        let touched: f64 = costs.iter().map(|cost| cost.bytes).sum();
        let bandwidth = self.machine.bandwidth(touched as usize);
        let stages = (0..costs.len()).map(|k| {
            stage(
                ours::STAGES[k],
                times.median(&[k]),
                costs[k],
                peak,
                bandwidth,
            )
        });
        Record {
            stages: stages.collect(),
            ms: 1e3 * times.median(&ours::INDIRECT_STAGES),
            ms_min: 1e3 * times.smallest(&ours::INDIRECT_STAGES),
            ms_from_lights: 1e3 * times.median(&ours::LIGHT_STAGES),
            runs: times.count(),
            storage: variant.storage.name(),
            coupling: match variant.coupling {
                Coupling::Table => "table",
                Coupling::Lightfield => "lightfield",
            },
            simd: variant.simd.name(),
            threads: variant.threads,
            size: modes(ours),
            bytes: ours.resident_bytes(),
            bytes_touched: touched as usize,
            ..self.record(setting, "mrt", &variant.name(), variant.preset, ours)
        }
    }

    fn paper(&self, setting: &Setting, variant: Variant, paper: &Paper, times: &Times) -> Record {
        let simd = SimdLevel::detect();
        let peak = self.machine.peak(simd, 1);
        let bytes = paper.bytes();
        let bandwidth = self.machine.bandwidth(bytes);
        let stages = paper.costs().into_iter().enumerate();
        let stages = stages
            .map(|(k, cost)| stage(paper::STAGES[k], times.median(&[k]), cost, peak, bandwidth));
        let ms = 1e3 * times.median(&[0, 1, 2]);
        let way = format!("{}/paper/t1", variant.preset);
        Record {
            case: format!("{}/{way}", setting.name),
            level: setting.name.clone(),
            blocks: setting.level.blocks.len(),
            lights: setting.lights.len(),
            method: "paper",
            preset: variant.preset.to_owned(),
            resolution: variant.dictionary.resolution,
            size: paper.response_modes,
            storage: "f32",
            coupling: "lightfield",
            simd: simd.name(),
            threads: 1,
            library: paper.library_names().join("+"),
            ms,
            ms_min: 1e3 * times.smallest(&[0, 1, 2]),
            ms_from_lights: ms,
            runs: times.count(),
            rel_l2: f64::NAN,
            paper_dense_ms: ms,
            bytes,
            bytes_touched: bytes,
            stages: stages.collect(),
            pareto: false,
        }
    }

    /// F of the level, if it is small, and what is left of it with fewer singular values.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn dense(
        &mut self,
        setting: &Setting,
        reference: &Reference,
        baseline: &Baseline,
    ) -> Result<Vec<Record>, MeasureError> {
        let ours = &baseline.ours;
        if ours.scene.texel_count() > MAX_TEXELS {
            return Ok(Vec::new());
        }
        let dense = Dense::new(setting, ours)?;
        self.progress.check()?;
        let ranks: Vec<usize> = RANKS
            .into_iter()
            .filter(|&rank| 2 * rank < dense.operator.rows())
            .collect();
        let decompositions = dense.decompositions(&ranks)?;
        let mut products = vec![dense.whole(&mut self.libraries)?];
        for factors in &decompositions {
            products.push(dense.factored(factors, &mut self.libraries)?);
        }
        let mut subjects: Vec<&mut dyn Timed> =
            products.iter_mut().map(|p| p as &mut dyn Timed).collect();
        let times = in_turns(&mut subjects, self.budget, self.progress)?;
        let sizes = std::iter::once(dense.operator.rows()).chain(ranks);
        let mut records = Vec::new();
        for ((product, times), size) in products.iter().zip(&times).zip(sizes) {
            let is_whole = size == dense.operator.rows();
            let method = if is_whole { "dense" } else { "svd" };
            let name = if is_whole {
                "dense".to_owned()
            } else {
                format!("svd{size}")
            };
            let way = format!("r{}/{name}/t1", ours.scene.level.resolution);
            let seconds = times.median(&[0]);
            let bytes = product.bytes();
            let cost = Cost {
                flops: product.flops(),
                bytes: bytes as f64,
            };
            let peak = self.machine.peak(SimdLevel::detect(), 1);
            let bandwidth = self.machine.bandwidth(bytes);
            let record = Record {
                size,
                ms: 1e3 * seconds,
                ms_min: 1e3 * times.smallest(&[0]),
                ms_from_lights: 1e3 * (seconds + baseline.direct_seconds),
                runs: times.count(),
                paper_dense_ms: baseline.paper_ms,
                library: product.library_names().join("+"),
                bytes,
                bytes_touched: bytes,
                stages: vec![stage("F", seconds, cost, peak, bandwidth)],
                ..self.record(setting, method, &way, &baseline.preset, ours)
            };
            let light = dense.irradiance(product.light(), &reference.receivers);
            records.push(with_error(record, reference, &light)?);
        }
        Ok(records)
    }

    /// Virtual point lights, and rays from texels. Receivers alone are lit; the time of a level's texels is theirs times
    /// so many.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn rays(
        &mut self,
        setting: &Setting,
        reference: &Reference,
        baseline: &Baseline,
    ) -> Result<Vec<Record>, MeasureError> {
        type Tracer = fn(&RayScene, &[WallPoint], usize) -> Traced;
        let sweeps: [(&str, Tracer, [usize; 6]); 2] = [
            ("vpl", vpl::trace, VIRTUAL_LIGHTS),
            ("gather", gather::trace, RAYS),
        ];
        let scene = RayScene::new(setting);
        let points: Vec<WallPoint> = reference.receivers.iter().map(WallPoint::of).collect();
        let ours = &baseline.ours;
        let mut records = Vec::new();
        for (method, trace, counts) in sweeps {
            let mut last = Duration::ZERO;
            for count in counts {
                self.progress.check()?;
                // Each light has a virtual one at least.
                if method == "vpl" && count < setting.lights.len() {
                    continue;
                }
                // Each step of a sweep takes four times as long as the one before.
                if 4 * last > self.ray_limit {
                    break;
                }
                let start = std::time::Instant::now();
                let runs: Vec<Traced> = (0..2).map(|_| trace(&scene, &points, count)).collect();
                last = start.elapsed();
                let all_texels = ours.scene.texel_count() as f64;
                let seconds = |t: &Traced| t.start_seconds + all_texels * t.receiver_seconds;
                let best = runs.iter().map(seconds).fold(f64::INFINITY, f64::min);
                let way = format!("r{}/{method}{count}/t1", ours.scene.level.resolution);
                let record = Record {
                    size: count,
                    ms: 1e3 * best,
                    ms_min: 1e3 * best,
                    ms_from_lights: 1e3 * best,
                    runs: runs.len(),
                    paper_dense_ms: baseline.paper_ms,
                    bytes: scene.bytes(),
                    bytes_touched: scene.bytes(),
                    ..self.record(setting, method, &way, &baseline.preset, ours)
                };
                let is_noisy = count < FLUX_SAMPLES * setting.lights.len();
                records.push(match is_noisy {
                    true => with_any_error(record, reference, &runs[0].irradiance),
                    false => with_error(record, reference, &runs[0].irradiance)?,
                });
            }
        }
        Ok(records)
    }

    /// A record without figures.
    fn record(
        &self,
        setting: &Setting,
        method: &'static str,
        way: &str,
        preset: &str,
        ours: &Ours,
    ) -> Record {
        Record {
            case: format!("{}/{way}", setting.name),
            level: setting.name.clone(),
            blocks: setting.level.blocks.len(),
            lights: setting.lights.len(),
            method,
            preset: preset.to_owned(),
            resolution: ours.scene.level.resolution,
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
}

/// Modes `k_b` of the scene's blocks, the most.
fn modes(ours: &Ours) -> usize {
    let blocks = ours.scene.blocks.iter();
    blocks.map(|b| b.coefficients.len()).max().unwrap_or(0)
}

fn stage(name: &'static str, seconds: f64, cost: Cost, peak: f64, bandwidth: f64) -> StageRecord {
    // A stage shorter than the clock's tick has no rate.
    let rate = |amount: f64| {
        if seconds > 0.0 {
            amount / seconds / 1e9
        } else {
            0.0
        }
    };
    StageRecord {
        stage: name,
        ms: 1e3 * seconds,
        gflops: rate(cost.flops),
        peak_share: rate(cost.flops) / peak,
        gbytes_per_s: rate(cost.bytes),
        bandwidth_share: rate(cost.bytes) / bandwidth,
    }
}

/// The record with its error; refused where the light is another.
fn with_error(
    record: Record,
    reference: &Reference,
    light: &[[f64; 3]],
) -> Result<Record, MeasureError> {
    let found = reference.flux_ratio(light);
    if found.is_nan() || (found - 1.0).abs() > FLUX_TOLERANCE {
        return Err(MeasureError::Light {
            case: record.case,
            found,
        });
    }
    Ok(with_any_error(record, reference, light))
}

fn with_any_error(record: Record, reference: &Reference, light: &[[f64; 3]]) -> Record {
    Record {
        rel_l2: reference.rel_l2(light),
        ..record
    }
}
