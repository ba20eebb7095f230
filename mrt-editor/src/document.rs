//! Levels on disk.

pub mod level_file;
