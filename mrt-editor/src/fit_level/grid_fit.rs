//! Turns cells into joined blocks whose common corners take common heights.

use super::cell::{Cell, Cells, GridLines, SharedSide, side_corners};
use super::voxels::FreeSpace;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_runtime::blocks::{Block, Connection, Opening};
use mrt_runtime::low_level::level::cells::shape_with_openings;
use mrt_runtime::{Level, LevelError};

/// What becomes a block and a connection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JoinConfig {
    /// Least share of a side that must be open for a connection, or to be open to the outside.
    pub openness: f64,
    /// Groups of joined cells below this share of the free volume are dropped.
    pub crumb_share: f64,
}

/// A level and what was left out of it.
#[derive(Clone, Debug)]
pub struct GridLevel {
    /// Consistent: [`Level::check`] passes.
    pub level: Level,
    /// Cells in groups too small to matter.
    pub crumbs: usize,
    /// Cells too flat, folded or in one another's way.
    pub misfits: usize,
    /// Shared sides that were closed because the cells could not be brought to one height.
    pub closed_passages: usize,
}

/// Sides whose heights share less than this are not joined: one block would be squeezed flat.
const LEAST_OVERLAP: f64 = 0.08;

/// A block is open to the outside at sides of which at least this share is.
const LEAST_OUTSIDE: f64 = 0.6;

/// Joins the cells.
///
/// # Errors
/// [`LevelError::Empty`] when nothing is left; no other fault of the level can be left over.
pub fn join_cells(
    space: &FreeSpace,
    lines: &GridLines,
    cells: &Cells,
    config: &JoinConfig,
) -> Result<GridLevel, LevelError> {
    let coordinates: [Vec<f64>; 2] = std::array::from_fn(|axis| {
        lines.lines[axis]
            .iter()
            .map(|&line| snap(space, axis, line))
            .collect()
    });
    let mut is_kept = vec![true; cells.cells.len()];
    let crumbs = drop_crumbs(cells, config, &mut is_kept);
    let mut open: Vec<SharedSide> = cells
        .sides
        .iter()
        .copied()
        .filter(|p| p.openness >= config.openness && p.overlap >= LEAST_OVERLAP)
        .filter(|p| is_kept[p.low] && is_kept[p.high])
        .collect();
    let (mut misfits, mut closed_passages) = (0, 0);
    // Each round closes a side or drops a cell, so this ends.
    loop {
        let kept: Vec<usize> = (0..cells.cells.len())
            .filter(|&cell| is_kept[cell])
            .collect();
        let warps = warps(&cells.cells, &open, &coordinates);
        let level = assemble_level(&cells.cells, &kept, &open, &warps);
        let volume = |block: usize| cells.cells[kept[block]].volume;
        let misfit = match level.check() {
            Ok(()) => {
                return Ok(GridLevel {
                    level,
                    crumbs,
                    misfits,
                    closed_passages,
                });
            }
            Err(LevelError::Warp { block, .. }) => kept[block],
            Err(LevelError::Overlap { a, b, .. }) if volume(a) < volume(b) => kept[a],
            Err(LevelError::Overlap { b, .. }) => kept[b],
            Err(error) => return Err(error),
        };
        let worst = (0..open.len())
            .filter(|&k| open[k].low == misfit || open[k].high == misfit)
            .min_by(|&a, &b| open[a].overlap.total_cmp(&open[b].overlap));
        match worst.filter(|&k| open[k].overlap < 0.8) {
            Some(passage) => {
                open.remove(passage);
                closed_passages += 1;
            }
            None => {
                open.retain(|p| p.low != misfit && p.high != misfit);
                is_kept[misfit] = false;
                misfits += 1;
            }
        }
    }
}

/// A line's coordinate: the median of the surfaces that cross the links between the voxels on both sides of it.
fn snap(space: &FreeSpace, axis: usize, line: usize) -> f64 {
    let grid = &space.grid;
    let world_axis = 2 * axis;
    let boundary = grid.boundary(world_axis, line);
    if line == 0 || line >= grid.count[world_axis] {
        return boundary;
    }
    let across = 2 - world_axis;
    let mut found = Vec::new();
    for y in 0..grid.count[1] {
        for other in 0..grid.count[across] {
            let mut position = [0, y, 0];
            (position[world_axis], position[across]) = (line - 1, other);
            let index = grid.index(position);
            let cut = space.cut[world_axis][index];
            let is_wall = space.free[index] || space.free[index + grid.stride(world_axis)];
            if is_wall && !cut.is_nan() {
                found.push(cut);
            }
        }
    }
    found.sort_by(f32::total_cmp);
    found
        .get(found.len() / 2)
        .map_or(boundary, |&cut| f64::from(cut))
}

/// Drops the cells of groups that are too small; returns how many.
fn drop_crumbs(cells: &Cells, config: &JoinConfig, is_kept: &mut [bool]) -> usize {
    let mut groups = Groups::new(cells.cells.len());
    let sides = cells.sides.iter();
    for side in sides.filter(|side| side.openness >= config.openness) {
        groups.unite(side.low, side.high);
    }
    let mut volume = vec![0; cells.cells.len()];
    for (cell, found) in cells.cells.iter().enumerate() {
        volume[groups.find(cell)] += found.volume;
    }
    let total: usize = volume.iter().sum();
    let largest = volume.iter().copied().max().unwrap_or(0);
    let least = (config.crumb_share * total as f64).min(largest as f64);
    let mut crumbs = 0;
    for (cell, is_kept) in is_kept.iter_mut().enumerate() {
        if (volume[groups.find(cell)] as f64) < least {
            *is_kept = false;
            crumbs += 1;
        }
    }
    crumbs
}

/// The hexahedron of each cell. Corners of cells joined around one grid point take a mean of their heights, so that joined
/// sides coincide to the last bit. Sides lie in upright planes along the lines, so that cells of different columns cannot
/// overlap.
fn warps(cells: &[Cell], open: &[SharedSide], [xs, zs]: &[Vec<f64>; 2]) -> Vec<Hexahedron> {
    let mut groups = Groups::new(4 * cells.len());
    for side in open {
        let low = side_corners(side.axis, true);
        let high = side_corners(side.axis, false);
        for (l, h) in low.into_iter().zip(high) {
            groups.unite(4 * side.low + l, 4 * side.high + h);
        }
    }
    let mut sums = vec![[0.0; 3]; 4 * cells.len()];
    for (cell, found) in cells.iter().enumerate() {
        for k in 0..4 {
            // Low sides weigh more: where a corridor leads into a hall, the opening is as high as the corridor.
            let height = (found.ceiling[k] - found.floor[k]).max(1e-6);
            let weight = 1.0 / height;
            let sum = &mut sums[groups.find(4 * cell + k)];
            sum[0] += weight * found.floor[k];
            sum[1] += weight * found.ceiling[k];
            sum[2] += weight;
        }
    }
    let mut heights: Vec<[f64; 2]> = sums
        .iter()
        .map(|&[floor, ceiling, weight]| [floor / weight, ceiling / weight])
        .collect();
    separate_storeys(cells, &mut groups, &mut heights);
    cells
        .iter()
        .enumerate()
        .map(|(cell, found)| Hexahedron {
            corners: std::array::from_fn(|corner| {
                let (x, y, z) = (corner & 1, corner >> 1 & 1, corner >> 2 & 1);
                let group = groups.find(4 * cell + x + 2 * z);
                DVec3::new(
                    xs[found.column[0] + x],
                    heights[group][y],
                    zs[found.column[1] + z],
                )
            }),
        })
        .collect()
}

/// Puts a level plane between storeys whose ceiling and floor were drawn into one another by their neighbours. Ceilings only
/// sink and floors only rise, so storeys that were apart stay apart.
fn separate_storeys(cells: &[Cell], groups: &mut Groups, heights: &mut [[f64; 2]]) {
    for (lower, pair) in cells.windows(2).enumerate() {
        // Cells of one column stand next to each other, lowest first.
        if pair[0].column != pair[1].column {
            continue;
        }
        let below: [usize; 4] = std::array::from_fn(|k| groups.find(4 * lower + k));
        let above: [usize; 4] = std::array::from_fn(|k| groups.find(4 * (lower + 1) + k));
        let highest = below
            .map(|group| heights[group][1])
            .into_iter()
            .fold(f64::MIN, f64::max);
        let lowest = above
            .map(|group| heights[group][0])
            .into_iter()
            .fold(f64::MAX, f64::min);
        if highest <= lowest {
            continue;
        }
        let plane = (0..4)
            .map(|k| heights[below[k]][1] + heights[above[k]][0])
            .sum::<f64>()
            / 8.0;
        for group in below {
            heights[group][1] = heights[group][1].min(plane);
        }
        for group in above {
            heights[group][0] = heights[group][0].max(plane);
        }
    }
}

fn assemble_level(
    cells: &[Cell],
    kept: &[usize],
    open: &[SharedSide],
    warps: &[Hexahedron],
) -> Level {
    let mut block_of_cell = vec![usize::MAX; warps.len()];
    for (block, &cell) in kept.iter().enumerate() {
        block_of_cell[cell] = block;
    }
    let mut faces: Vec<Vec<Face>> = vec![Vec::new(); kept.len()];
    let mut connections = Vec::new();
    for side in open {
        let axis = 2 * side.axis;
        let end = |cell: usize, positive: bool| Opening {
            block: block_of_cell[cell],
            face: Face::from_axis(axis, positive),
        };
        let (a, b) = (end(side.low, true), end(side.high, false));
        faces[a.block].push(a.face);
        faces[b.block].push(b.face);
        connections.push(Connection { a, b });
    }
    for (&cell, faces) in kept.iter().zip(&mut faces) {
        for (side, face) in [Face::NegX, Face::PosX, Face::NegZ, Face::PosZ]
            .into_iter()
            .enumerate()
        {
            if cells[cell].outside[side] >= LEAST_OUTSIDE && !faces.contains(&face) {
                faces.push(face);
            }
        }
    }
    let blocks = kept
        .iter()
        .zip(&faces)
        .filter_map(|(&cell, faces)| {
            // Every set of sides has its shape.
            let (shape, orientation) = shape_with_openings(faces)?;
            let albedo = Vec3::splat(0.5);
            Some(Block::new(shape, orientation, warps[cell], albedo))
        })
        .collect();
    Level {
        blocks,
        connections,
        doors: Vec::new(),
        mesh: None,
    }
}

/// Disjoint sets.
struct Groups {
    parent: Vec<usize>,
}

impl Groups {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count).collect(),
        }
    }

    fn find(&mut self, mut member: usize) -> usize {
        while self.parent[member] != member {
            self.parent[member] = self.parent[self.parent[member]];
            member = self.parent[member];
        }
        member
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b);
    }
}
