//! The `mrt` tool.

use clap::{Parser, Subcommand};
use mrt_editor::cli::output::exit_code;
use mrt_editor::cli::{accuracy, adapt, bake, demo, info, light, map, pack};
use std::process::ExitCode;

/// Dynamic indirect light from modular radiance transfer: bakes dictionaries of canonical shapes, maps
/// levels to them, lights them and measures the error.
///
/// Without a command, `demo` runs.
#[derive(Parser)]
#[command(name = "mrt", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::DemoArgs),
    Bake(bake::BakeArgs),
    Adapt(adapt::AdaptArgs),
    Info(info::InfoArgs),
    Accuracy(accuracy::AccuracyArgs),
    Map(map::MapArgs),
    Light(light::LightArgs),
    Pack(pack::PackArgs),
}

fn main() -> ExitCode {
    let command = Cli::parse()
        .command
        .unwrap_or_else(|| Command::Demo(demo::DemoArgs::default()));
    let result: Result<(), Box<dyn std::error::Error>> = match command {
        Command::Demo(args) => demo::run(&args).map_err(Into::into),
        Command::Bake(args) => bake::run(&args).map_err(Into::into),
        Command::Adapt(args) => adapt::run(&args).map_err(Into::into),
        Command::Info(args) => info::run(&args).map_err(Into::into),
        Command::Accuracy(args) => accuracy::run(&args).map_err(Into::into),
        Command::Map(args) => map::run(&args).map_err(Into::into),
        Command::Light(args) => light::run(&args).map_err(Into::into),
        Command::Pack(args) => pack::run(&args).map_err(Into::into),
    };
    exit_code(result)
}
