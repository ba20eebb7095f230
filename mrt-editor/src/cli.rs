//! The command line: one module a command, with its flags and what it does, below what commands share.

mod hint;
pub mod output;
pub mod output_files;
pub mod table;
pub mod progress;
pub mod dictionary_source;
pub mod dictionary_report;
pub mod import_args;
pub mod accuracy;
pub mod adapt;
pub mod bake;
pub mod demo;
pub mod info;
pub mod light;
pub mod map;
pub mod pack;
