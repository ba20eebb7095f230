//! What was measured, as lines of JSON, as CSV and as tables.

use super::machine::Machine;
use mrt_editor::cli::table::Table;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A stage of a frame.
#[derive(Clone, Debug, Serialize)]
pub struct StageRecord {
    /// Name of the stage.
    pub stage: &'static str,
    /// Median time, milliseconds.
    pub ms: f64,
    /// Operations of products a second, in units of 1e9; 0 where there is no product.
    pub gflops: f64,
    /// `gflops` as a share of what the instructions and threads in use can do at most.
    pub peak_share: f64,
    /// Bytes read and written a second, each counted once, in units of 1e9.
    pub gbytes_per_s: f64,
    /// `gbytes_per_s` as a share of the measured bandwidth: of memory, or of the caches where everything fits.
    pub bandwidth_share: f64,
}

/// A level lit by a method.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// The level, the method and its settings, such as "maze41/standard/avx2/t1".
    pub case: String,
    /// Name of the level.
    pub level: String,
    /// Number of its blocks.
    pub blocks: usize,
    /// Number of its lights.
    pub lights: usize,
    /// "mrt", "paper", "dense", "svd", "vpl" or "gather".
    pub method: &'static str,
    /// Preset of the dictionary.
    pub preset: String,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Number of modes `k_b`, kept singular values, virtual lights, or rays a texel.
    pub size: usize,
    /// How operators are stored.
    pub storage: &'static str,
    /// How light goes from block to block.
    pub coupling: &'static str,
    /// Instructions.
    pub simd: &'static str,
    /// Threads.
    pub threads: usize,
    /// Libraries of dense products in use, joined by "+".
    pub library: String,
    /// Median time from direct light to indirect light, milliseconds; for ray methods from lights to indirect light.
    pub ms: f64,
    /// The smallest of these times.
    pub ms_min: f64,
    /// Median time from lights to indirect light, milliseconds: with direct light at all texels, except for ray methods,
    /// which do without it.
    pub ms_from_lights: f64,
    /// Number of timed runs.
    pub runs: usize,
    /// Relative L2 error of first-bounce indirect irradiance at texel centres.
    pub rel_l2: f64,
    /// `ms` of the paper's dense products for the same level and preset.
    pub paper_dense_ms: f64,
    /// Bytes held while frames are computed.
    pub bytes: usize,
    /// Bytes that a frame reads and writes, each once.
    pub bytes_touched: usize,
    /// Stage by stage.
    pub stages: Vec<StageRecord>,
    /// True for a setting of the frame where no other has both a smaller `ms` and a smaller error.
    pub pareto: bool,
}

impl Record {
    /// The part of the case after the level.
    pub fn method_case(&self) -> &str {
        self.case.split_once('/').map_or("", |(_, case)| case)
    }
}

/// Marks the records of the frame that no other of their level beats in both time and error.
pub fn mark_pareto(records: &mut [Record]) {
    let mut levels: Vec<String> = records.iter().map(|r| r.level.clone()).collect();
    levels.dedup();
    for level in levels {
        let mut ours: Vec<&mut Record> = records
            .iter_mut()
            .filter(|r| r.method == "mrt" && r.level == level)
            .collect();
        let points: Vec<[f64; 2]> = ours.iter().map(|r| [r.ms, r.rel_l2]).collect();
        for (record, is_best) in ours.iter_mut().zip(frontier(&points)) {
            record.pareto = is_best;
        }
    }
}

/// Errors that differ by less than this share count as equal: storage and the order of sums move errors by less.
const SAME_ERROR: f64 = 0.005;

/// For each point of time and error, whether no other point is faster with an error that is no larger, up to
/// [`SAME_ERROR`]. Of points of equal time only the best counts, and of equal points only the first.
pub fn frontier(points: &[[f64; 2]]) -> Vec<bool> {
    let is_beaten = |k: usize| {
        let [time, error] = points[k];
        points.iter().enumerate().any(|(i, &[other, its_error])| {
            let is_faster = other < time && its_error <= error * (1.0 + SAME_ERROR);
            let is_first = its_error < error || (its_error == error && i < k);
            is_faster || (other == time && is_first)
        })
    };
    (0..points.len()).map(|k| !is_beaten(k)).collect()
}

/// All records, one a line.
pub fn csv(records: &[Record]) -> String {
    let mut text = "case,level,blocks,lights,method,preset,resolution,size,storage,coupling,simd,threads,library,ms,ms_min,\
                    ms_from_lights,runs,rel_l2,paper_dense_ms,bytes,bytes_touched,pareto\n"
        .to_owned();
    for r in records {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            quoted(&r.case),
            r.level,
            r.blocks,
            r.lights,
            r.method,
            quoted(&r.preset),
            r.resolution,
            r.size,
            r.storage,
            r.coupling,
            r.simd,
            r.threads,
            r.library,
            r.ms,
            r.ms_min,
            r.ms_from_lights,
            r.runs,
            r.rel_l2,
            r.paper_dense_ms,
            r.bytes,
            r.bytes_touched,
            r.pareto,
        );
    }
    text
}

/// All stages, one a line.
pub fn stages_csv(records: &[Record]) -> String {
    let mut text = "case,stage,ms,gflops,peak_share,gbytes_per_s,bandwidth_share\n".to_owned();
    for record in records {
        for s in &record.stages {
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{}",
                quoted(&record.case),
                quoted(s.stage),
                s.ms,
                s.gflops,
                s.peak_share,
                s.gbytes_per_s,
                s.bandwidth_share
            );
        }
    }
    text
}

/// The limits of the machine, one a line.
pub fn machine_csv(machine: &Machine) -> String {
    let mut text = "limit,value\n".to_owned();
    for (level, gflops) in &machine.gflops {
        let _ = writeln!(text, "gflops_{},{gflops}", level.name());
    }
    for (bytes, rate) in &machine.reads {
        let _ = writeln!(text, "gbytes_per_s_of_{bytes}_bytes,{rate}");
    }
    text
}

/// A field of CSV, in quotes where its text needs them: dictionaries may have any name.
pub fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// Time and error of every record.
pub fn overview(records: &[Record]) -> Table {
    let mut table = Table::new(&[
        "case",
        "ms",
        "min",
        "from lights",
        "error %",
        "paper ms",
        "MB held",
        "MB touched",
        "best",
    ]);
    for r in records {
        table.row([
            r.case.clone(),
            significant(r.ms),
            significant(r.ms_min),
            significant(r.ms_from_lights),
            significant(100.0 * r.rel_l2),
            significant(r.paper_dense_ms),
            significant(r.bytes as f64 / 1e6),
            significant(r.bytes_touched as f64 / 1e6),
            if r.pareto { "*" } else { "" }.to_owned(),
        ]);
    }
    table
}

/// For each level and resolution, a sentence on how many rays could be sent from each texel in the time that the fastest
/// setting of the frame takes.
pub fn rays_at_equal_time(records: &[Record]) -> Vec<String> {
    let mut fastest: BTreeMap<(&str, usize), &Record> = BTreeMap::new();
    for record in records.iter().filter(|r| r.method == "mrt") {
        let best = fastest.entry((&record.level, record.resolution));
        let best = best.or_insert(record);
        if record.ms_from_lights < best.ms_from_lights {
            *best = record;
        }
    }
    let sentence = |ours: &Record| {
        // The run with the most rays has the smallest overhead a ray.
        let rays = records
            .iter()
            .filter(|r| (&r.level, r.resolution) == (&ours.level, ours.resolution))
            .filter(|r| r.method == "gather")
            .max_by_key(|r| r.size)?;
        let count = ours.ms_from_lights * rays.size as f64 / rays.ms;
        Some(format!(
            "in the time of {}, {} ms from lights to indirect light, {} rays could be sent from each texel",
            ours.case,
            significant(ours.ms_from_lights),
            significant(count)
        ))
    };
    fastest.into_values().filter_map(sentence).collect()
}

/// Stages, and their shares of what the machine can do at most.
pub fn stages(records: &[Record]) -> Table {
    let mut table = Table::new(&[
        "case",
        "stage",
        "ms",
        "GFLOP/s",
        "% of peak",
        "GB/s",
        "% of bandwidth",
    ]);
    for record in records {
        for s in &record.stages {
            let product = |value: f64| match s.gflops {
                0.0 => "-".to_owned(),
                _ => significant(value),
            };
            table.row([
                record.case.clone(),
                s.stage.to_owned(),
                significant(s.ms),
                product(s.gflops),
                product(100.0 * s.peak_share),
                significant(s.gbytes_per_s),
                significant(100.0 * s.bandwidth_share),
            ]);
        }
    }
    table
}

/// A number with three significant digits and without an exponent.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9);
    format!("{value:.0$}", digits as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(method: &'static str, ms: f64, rel_l2: f64) -> Record {
        Record {
            case: format!("maze1/{method}"),
            level: "maze1".to_owned(),
            blocks: 1,
            lights: 1,
            method,
            preset: "a \"b\", c".to_owned(),
            resolution: 6,
            size: 12,
            storage: "f32",
            coupling: "table",
            simd: "scalar",
            threads: 1,
            library: String::new(),
            ms,
            ms_min: ms,
            ms_from_lights: ms,
            runs: 3,
            rel_l2,
            paper_dense_ms: 1.0,
            bytes: 0,
            bytes_touched: 0,
            stages: Vec::new(),
            pareto: false,
        }
    }

    #[test]
    fn a_record_is_best_if_no_other_of_its_method_beats_it() {
        let mut records = vec![
            record("mrt", 1.0, 0.1),
            record("mrt", 2.0, 0.05),
            record("mrt", 2.0, 0.2),
            record("mrt", 1.0, 0.1),
            record("vpl", 0.5, 0.01),
        ];
        mark_pareto(&mut records);
        let marks: Vec<bool> = records.iter().map(|r| r.pareto).collect();
        assert_eq!(marks, [true, true, false, false, false]);
    }

    #[test]
    fn csv_fields_with_commas_and_quotes_are_quoted() {
        let text = csv(&[record("mrt", 1.0, 0.1)]);
        assert!(text.contains(",\"a \"\"b\"\", c\",6,"), "{text}");
    }

    #[test]
    fn numbers_have_three_significant_digits() {
        assert_eq!(significant(0.012345), "0.0123");
        assert_eq!(significant(12.345), "12.3");
        assert_eq!(significant(12345.6), "12346");
    }
}
