//! The level that is part of the program.

/// A maze as the text of a level: thirteen blocks with a loop and coloured walls.
pub const MAZE: &str = include_str!("../../../assets/maze.level.toml");
