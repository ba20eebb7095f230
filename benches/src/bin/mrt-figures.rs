//! The `mrt-figures` program.

use clap::Parser;
use mrt_benches::figures::{FiguresArgs, run};
use mrt_editor::cli::output::exit_code;
use std::process::ExitCode;

fn main() -> ExitCode {
    exit_code(run(&FiguresArgs::parse()))
}
