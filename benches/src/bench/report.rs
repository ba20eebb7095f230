//! What `mrt-bench` writes and prints.

use super::goal::{self, Goal};
use super::machine::Machine;
use super::record::{self, Record, significant};
use super::{chart, picture};
use mrt_core::container::write_file_atomically;
use mrt_core::simd::SimdLevel;
use mrt_editor::cli::output::{ReportError, print_json};
use mrt_editor::render::file::WriteError;
use mrt_editor::{report, report_line};
use std::path::Path;

/// Writes tables, and two charts a level.
pub(super) fn write_records(
    out: &Path,
    records: &[Record],
    machine: &Machine,
) -> Result<(), WriteError> {
    let write = |name: String, text: String| {
        write_file_atomically(&out.join(name), text.as_bytes()).map_err(WriteError::File)
    };
    write("bench.csv".to_owned(), record::csv(records))?;
    write("stages.csv".to_owned(), record::stages_csv(records))?;
    write("machine.csv".to_owned(), record::machine_csv(machine))?;
    let mut levels: Vec<&str> = records.iter().map(|r| r.level.as_str()).collect();
    levels.dedup();
    for level in levels {
        for view in chart::ChartView::ALL {
            let remarks = remarks(level, view, records, machine);
            let marks = chart::draw(level, view, records, &remarks);
            let name = format!("{level}{}", view.suffix());
            write(format!("{name}.svg"), picture::svg(&marks))?;
            picture::canvas(&marks).write(&out.join(format!("{name}.png")))?;
        }
    }
    Ok(())
}

fn remarks(
    level: &str,
    view: chart::ChartView,
    records: &[Record],
    machine: &Machine,
) -> Vec<String> {
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
                chart::ChartView::Methods => "; numbers are virtual lights, and rays of a texel",
                chart::ChartView::Frame => "",
            }
        ),
        "Errors are against exact radiosity at each dictionary's own texel centres.".to_owned(),
    ]
}

/// Prints records: as JSON one a line, or as tables for people.
pub(super) fn print_records(
    records: &[Record],
    machine: &Machine,
    json: bool,
) -> Result<(), ReportError> {
    if json {
        return records.iter().try_for_each(print_json);
    }
    print_tables(records, machine);
    Ok(())
}

/// Writes the table of goals.
pub(super) fn write_goals(out: &Path, goals: &[Goal]) -> Result<(), WriteError> {
    let text = goal::csv(goals);
    Ok(write_file_atomically(
        &out.join("figures.csv"),
        text.as_bytes(),
    )?)
}

/// Prints goals: as JSON one a line, or as tables for people.
pub(super) fn print_goals(goals: &[Goal], json: bool) -> Result<(), ReportError> {
    if json {
        return goals.iter().try_for_each(print_json);
    }
    report!("{}", goal::table(goals));
    report_line!();
    report!("{}", goal::stages(goals));
    Ok(())
}

fn print_tables(records: &[Record], machine: &Machine) {
    report!("{}", record::overview(records));
    report_line!();
    for sentence in record::rays_at_equal_time(records) {
        report_line!("{sentence}");
    }
    report_line!();
    report!("{}", record::stages(records));
    report_line!();
    for (level, gflops) in &machine.gflops {
        report_line!(
            "one core, {}: {} GFLOP/s",
            level.name(),
            significant(*gflops)
        );
    }
    for (bytes, rate) in &machine.reads {
        let (bytes, rate) = (significant(*bytes as f64 / 1e6), significant(*rate));
        report_line!("one core, reading {bytes} MB again and again: {rate} GB/s");
    }
}
