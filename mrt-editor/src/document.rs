//! Levels on disk, and the one that is part of the program.

pub mod built_in;
pub mod level_file;
