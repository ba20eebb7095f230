//! What is to be solved exactly.

use super::super::lit_maze::{LitMaze, MazeLamp};
use mrt_runtime::Level;
use mrt_runtime::blocks::Opening;

/// Fine texels along an edge, at least.
const FINE: usize = 40;

/// A lit level, and how finely it is to be solved.
pub(super) struct Problem<'a> {
    pub(super) level: &'a Level,
    pub(super) lamps: Vec<MazeLamp>,
    /// By block and face: where an opening leads.
    pub(super) neighbours: Vec<[Option<Opening>; 6]>,
    /// Texels along an edge of a wall.
    pub(super) resolution: usize,
    /// Fine texels along an edge, at least.
    pub(super) fine: usize,
}

impl<'a> Problem<'a> {
    pub(super) fn new(maze: &'a LitMaze, resolution: usize) -> Self {
        Self {
            level: &maze.level,
            lamps: maze.lamps(),
            neighbours: maze.level.neighbours(),
            resolution,
            fine: FINE,
        }
    }
}
