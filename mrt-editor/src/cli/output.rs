//! Output: standard output that may be a closed pipe or a full disk, and files that must not be replaced.

use std::fmt::{Arguments, Display};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

/// What the process ends with: on failure with status 1 and the error as one line on standard error.
pub fn exit_code(result: Result<(), impl Display>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", program_name());
            ExitCode::FAILURE
        }
    }
}

/// The name by which the program was called, without its folder and extension.
fn program_name() -> String {
    let called = std::env::args_os().next().unwrap_or_default();
    let stem = Path::new(&called).file_stem();
    stem.map_or("mrt".into(), |stem| stem.to_string_lossy().into_owned())
}

/// Writes to standard output. When nobody reads it any more, the program ends quietly. When writing fails, the program
/// ends with status 1 and a message, since only the report is left to do by then.
pub fn write(text: Arguments<'_>) {
    if let Err(error) = std::io::stdout().lock().write_fmt(text) {
        if error.kind() == ErrorKind::BrokenPipe {
            std::process::exit(0);
        }
        eprintln!("{}: standard output: {error}", program_name());
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

/// True when both paths are there and lead to the same file or folder.
pub fn is_same_place(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
