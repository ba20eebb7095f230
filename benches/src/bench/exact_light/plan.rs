//! Which texels of a level are sampled, and which parts of the level are solved for them.
//!
//! All texels of a large level would take hours, and an error needs no more than a fair sample: each wall is cut into a
//! grid of strata, and one texel of each is drawn and stands for all of its stratum. On the maze of 11 blocks the standard
//! preset errs by 1.90 % over all 11,264 texels and by 1.89 % over a sample of 2,816; a test holds a smaller sample to
//! within 5 % of the error. Levels of more than [`WHOLE_BLOCKS`] blocks are sampled by block too: some blocks at each
//! distance from the nearest light, each with only the part of the level from which light reaches it ([`Window`]); a test
//! finds that part to give the same light as the whole.

use super::super::lit_maze::{LitMaze, MazeLamp};
use super::super::sampled_texel::SampledTexel;
use super::error::ExactLightError;
use super::problem::Problem;
use super::window::Window;
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::sampling::hash;
use mrt_dictionary::progress::Progress;
use std::collections::{BTreeSet, VecDeque};

/// Levels of up to this number of blocks are solved in one piece.
pub(super) const WHOLE_BLOCKS: usize = 64;

/// Number of sampled blocks at each distance from the nearest light: in its block, 1, 2, 3, and up to 5 and 8 openings
/// away. Further blocks count as dark, since less than 0.1 % of the light gets there.
const BLOCKS_BY_HOP: [(u32, usize); 6] = [(0, 6), (1, 6), (2, 5), (3, 4), (5, 4), (8, 3)];

/// Openings that light crosses to a sampled block of a window, and from a lamp to the blocks that it lights there.
const WINDOW_REACH: [usize; 2] = [8, 6];

/// A problem, and the parts in which it is solved.
pub(super) struct Plan<'a> {
    pub(super) problem: Problem<'a>,
    pub(super) windows: Vec<Window>,
}

impl<'a> Plan<'a> {
    /// A plan to sample about `count` texels.
    pub(super) fn new(maze: &'a LitMaze, resolution: usize, count: usize) -> Self {
        let mut plan = Self {
            problem: Problem::new(maze, resolution),
            windows: Vec::new(),
        };
        let blocks = maze.level.blocks.len();
        plan.windows = if blocks <= WHOLE_BLOCKS {
            let all: Vec<usize> = (0..blocks).collect();
            vec![Window {
                texels: plan.sample(&all, count, 1.0),
                senders: all.iter().copied().collect(),
                blocks: all,
            }]
        } else {
            plan.windows(count)
        };
        plan
    }

    /// The sampled texels of all windows.
    pub(super) fn texels(&self) -> Vec<SampledTexel> {
        let windows = self.windows.iter();
        windows.flat_map(|window| window.texels.clone()).collect()
    }

    /// Exact irradiance at all sampled texels.
    pub(super) fn solve(&self, progress: &Progress) -> Result<Vec<[f64; 3]>, ExactLightError> {
        let mut irradiance = Vec::new();
        for window in &self.windows {
            progress.check()?;
            irradiance.extend(window.solve(&self.problem)?);
        }
        Ok(irradiance)
    }

    /// One window around each of some blocks.
    pub(super) fn windows(&self, count: usize) -> Vec<Window> {
        let chosen = self.choose_blocks();
        let each = count / chosen.len().max(1);
        let window = |chosen: &ChosenBlock| {
            let mut senders = BTreeSet::new();
            self.reach(chosen.block, WINDOW_REACH[0], &mut senders);
            let mut blocks = senders.clone();
            for &sender in &senders {
                self.reach(sender, WINDOW_REACH[1], &mut blocks);
            }
            Window {
                blocks: blocks.into_iter().collect(),
                senders,
                texels: self.sample(&[chosen.block], each, chosen.weight),
            }
        };
        chosen.iter().map(window).collect()
    }

    /// Blocks at each distance from the nearest light, spread over the level.
    fn choose_blocks(&self) -> Vec<ChosenBlock> {
        let hops = self.hops();
        let mut chosen = Vec::new();
        let mut nearest = 0;
        for (farthest, count) in BLOCKS_BY_HOP {
            let stratum: Vec<usize> = (0..hops.len())
                .filter(|&block| (nearest..=farthest).contains(&hops[block]))
                .collect();
            nearest = farthest + 1;
            let count = count.min(stratum.len());
            for k in 0..count {
                chosen.push(ChosenBlock {
                    block: stratum[(2 * k + 1) * stratum.len() / (2 * count)],
                    weight: stratum.len() as f64 / count as f64,
                });
            }
        }
        chosen
    }

    /// Openings from the nearest light to each block; `u32::MAX` for blocks that light cannot get to.
    fn hops(&self) -> Vec<u32> {
        let mut hops = vec![u32::MAX; self.problem.level.blocks.len()];
        let mut queue = VecDeque::new();
        for (block, placed) in self.problem.level.blocks.iter().enumerate() {
            let is_in = |lamp: &MazeLamp| placed.warp.contains(lamp.position.as_dvec3(), 0.0);
            if self.problem.lamps.iter().any(is_in) {
                hops[block] = 0;
                queue.push_back(block);
            }
        }
        while let Some(block) = queue.pop_front() {
            for next in self.problem.neighbours[block].iter().flatten() {
                if hops[next.block] == u32::MAX {
                    hops[next.block] = hops[block] + 1;
                    queue.push_back(next.block);
                }
            }
        }
        hops
    }

    /// Adds a block, and all blocks to which a straight line from it may lead through at most `depth` openings: in a grid
    /// a straight line never uses two opposite headings.
    fn reach(&self, block: usize, depth: usize, found: &mut BTreeSet<usize>) {
        fn follow(
            plan: &Plan,
            block: usize,
            depth: usize,
            used: [bool; 6],
            found: &mut BTreeSet<usize>,
        ) {
            found.insert(block);
            if depth == 0 {
                return;
            }
            for face in Face::ALL {
                if let Some(next) = plan.problem.neighbours[block][face.index()]
                    && !used[face.opposite().index()]
                {
                    let mut used = used;
                    used[face.index()] = true;
                    follow(plan, next.block, depth - 1, used, found);
                }
            }
        }
        follow(self, block, depth, [false; 6], found);
    }

    /// About `count` texels of some blocks, in equal shares of all their walls. Each stands for its stratum, in
    /// `block_weight` blocks.
    fn sample(&self, blocks: &[usize], count: usize, block_weight: f64) -> Vec<SampledTexel> {
        let walls: Vec<(usize, Face)> = blocks
            .iter()
            .flat_map(|&block| Face::ALL.map(|face| (block, face)))
            .filter(|&(block, face)| !self.problem.level.blocks[block].is_open(face))
            .collect();
        let resolution = self.problem.resolution;
        let per_edge = (count as f64 / walls.len().max(1) as f64).sqrt().ceil() as usize;
        let per_edge = per_edge.clamp(2.min(resolution), resolution);
        let edge = |k: usize| k * resolution / per_edge;
        let mut texels = Vec::new();
        for (block, face) in walls {
            let warp = &self.problem.level.blocks[block].warp;
            for stratum in 0..per_edge * per_edge {
                let seed = (block * 6 + face.index()) as u32;
                let draw = |k: usize, axis: u32| {
                    let (low, high) = (edge(k), edge(k + 1));
                    low + hash(stratum as u32, 2 * seed + axis) as usize % (high - low)
                };
                let (j, i) = (stratum / per_edge, stratum % per_edge);
                let (row, column) = (draw(j, 0), draw(i, 1));
                let unit = face.texel_center(resolution, row, column);
                let size = (edge(j + 1) - edge(j)) * (edge(i + 1) - edge(i));
                texels.push(SampledTexel {
                    block,
                    face,
                    row,
                    column,
                    weight: size as f64 * block_weight,
                    position: warp.point(unit),
                    normal: warp.face_normal(face, unit[face.u_axis()], unit[face.v_axis()]),
                });
            }
        }
        texels
    }
}

/// A block that stands for others at its distance from the lights.
struct ChosenBlock {
    block: usize,
    /// Number of blocks that it stands for.
    weight: f64,
}
