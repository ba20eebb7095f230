//! Output: standard output that may be a closed pipe or a full disk, and files that must not be replaced.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Writes to standard output. When nobody reads it any more the program ends quietly; when it cannot be
/// written, with an error: the report is all that is left to do by then.
pub fn write(text: Arguments<'_>) {
    if let Err(error) = std::io::stdout().lock().write_fmt(text) {
        if error.kind() == ErrorKind::BrokenPipe {
            std::process::exit(0);
        }
        eprintln!("mrt: standard output: {error}");
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
