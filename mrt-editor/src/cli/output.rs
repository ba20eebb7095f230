//! What a command leaves besides files: a report on standard output, which may be a closed pipe or a full disk, and an
//! exit code.

use mrt_core::excerpt::printable;
use serde::Serialize;
use std::fmt::{Arguments, Display};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

/// What the process ends with: on failure status 1, after the error as one line on standard error.
pub fn exit_code(result: Result<(), impl Display>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            warn(format_args!("{error}"));
            ExitCode::FAILURE
        }
    }
}

/// Writes one line to standard error, after the program's name. Names of files and what stands in them may hold signs
/// that a terminal obeys: they are written as escapes.
pub fn warn(text: Arguments<'_>) {
    let line = printable(&text.to_string(), usize::MAX);
    eprintln!("{}: {line}", program_name());
}

/// The name by which the program was called, without its folder and extension.
fn program_name() -> String {
    let called = std::env::args_os().next().unwrap_or_default();
    let stem = Path::new(&called).file_stem();
    stem.map_or("mrt".into(), |stem| stem.to_string_lossy().into_owned())
}

/// Writes to standard output. When nobody reads it any more, the program ends quietly. When writing fails, the program
/// ends with status 1 and a message: all that is left to do by then is the report.
pub fn write(text: Arguments<'_>) {
    if let Err(error) = std::io::stdout().lock().write_fmt(text) {
        if error.kind() == ErrorKind::BrokenPipe {
            std::process::exit(0);
        }
        warn(format_args!("standard output: {error}"));
        std::process::exit(1);
    }
}

/// `print!` that does not panic.
#[macro_export]
macro_rules! report {
    ($($part:tt)*) => { $crate::cli::output::write(format_args!($($part)*)) };
}

/// `println!` that does not panic.
#[macro_export]
macro_rules! report_line {
    () => { $crate::cli::output::write(format_args!("\n")) };
    ($($part:tt)*) => { $crate::cli::output::write(format_args!("{}\n", format_args!($($part)*))) };
}

/// A report has no form as JSON.
#[derive(Debug, thiserror::Error)]
#[error("the report cannot be printed: {0}")]
pub struct ReportError(#[from] serde_json::Error);

/// Prints a report: with `json` as one line of JSON, otherwise as `print` does it for people.
///
/// # Errors
/// [`ReportError`].
pub fn print_report<R: Serialize>(
    report: &R,
    json: bool,
    print: impl FnOnce(&R),
) -> Result<(), ReportError> {
    if json {
        print_json(report)
    } else {
        print(report);
        Ok(())
    }
}

/// Prints one line of JSON.
///
/// # Errors
/// [`ReportError`].
pub fn print_json(record: &impl Serialize) -> Result<(), ReportError> {
    crate::report_line!("{}", serde_json::to_string(record)?);
    Ok(())
}

/// Prints a named value, in line with the others.
pub fn print_row(name: &str, value: impl Display) {
    crate::report_line!("{name:<22} {value}");
}
