//! The `mrt-bench` program.

use clap::Parser;
use mrt_benches::bench::{BenchArgs, run};
use mrt_editor::cli::output::exit_code;
use std::process::ExitCode;

fn main() -> ExitCode {
    exit_code(run(&BenchArgs::parse()))
}
