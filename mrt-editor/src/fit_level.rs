//! Maps a real scene to a level of blocks (Loos et al. 2011, sections 6.2 and 7.2).
//!
//! The paper's artists place blocks by hand; here blocks are found: one closed box around everything, or
//! the free space cut along a grid. Only what lies inside rooms becomes blocks, so light that the
//! level carries cannot leak through walls that were cut along.

pub mod box_fit;
pub mod cells;
pub mod columns;
pub mod grid_fit;
pub mod grid_lines;
pub mod paint;
pub mod surface;
pub mod voxels;

use columns::Columns;
use glam::Vec3;
use grid_fit::JoinConfig;
use grid_lines::LineConfig;
use mrt_core::geometry::mesh::{TriangleMesh, bounds};
use mrt_runtime::blocks::Shape;
use mrt_runtime::{Level, LevelError};
use voxels::{FreeSpace, VoxelGrid, Winding, find_free_space};

/// Points spread over the mesh to measure albedos and coverage.
const SURFACE_POINTS: usize = 100_000;

/// Voxels that the free space is first looked for with, to learn the rooms' height.
const FIRST_VOXELS: f64 = 4e5;

/// More voxels than this are not made; cells then have fewer voxels across.
const MOST_VOXELS: f64 = 6e6;

/// Voxels across a cell.
const VOXELS_A_CELL: f64 = 10.0;

/// Rooms lower than this share of a cell are not rooms.
const LEAST_HEADROOM: f64 = 0.2;

/// How blocks are laid around a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapConfig {
    /// One box or a grid.
    pub fit: Fit,
    /// Wanted width of a block, metres; by default the rooms' typical height.
    pub cell: Option<f64>,
    /// Most blocks to make.
    pub max_blocks: usize,
    /// Least share of the side between two cells that must be open to join them.
    pub openness: f64,
    /// Grid lines whose sides disagree by less than this share are taken out.
    pub tolerance: f64,
    /// Groups of joined cells below this share of the free volume are dropped.
    pub crumb_share: f64,
    /// Which side of the triangles faces the rooms.
    pub winding: Winding,
}

impl Default for MapConfig {
    fn default() -> Self {
        Self {
            fit: Fit::Grid,
            cell: None,
            max_blocks: 200,
            openness: 0.25,
            tolerance: 0.15,
            crumb_share: 0.01,
            winding: Winding::Auto,
        }
    }
}

/// The kind of level to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Fit {
    /// One closed block around everything.
    Box,
    /// Connected blocks that fill the free space.
    Grid,
}

/// A level around a mesh.
#[derive(Clone, Debug)]
pub struct Mapped {
    /// Consistent: [`Level::check`] passes.
    pub level: Level,
    /// Wanted width of a block that was used, metres; 0 for a box.
    pub cell: f64,
    /// Cells in groups too small to matter.
    pub crumbs: usize,
    /// Cells too flat, folded or in one another's way.
    pub misfits: usize,
    /// Passages closed because the cells on both sides could not be brought to one height.
    pub closed_passages: usize,
    /// True when the faces were found to be turned away from the rooms.
    pub is_reversed: bool,
    /// How much of the mesh the blocks hold.
    pub coverage: paint::Coverage,
}

/// Why a mesh has no level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// Zero blocks asked for.
    #[error("--max-blocks 0; expected at least 1")]
    NoBlocks,

    /// No point with a floor below and walls around.
    #[error(
        "the scene encloses no free space: found no point with a floor below and faces towards it on \
         most sides; try --winding both, or --fit box for one block around everything"
    )]
    NoFreeSpace,
    /// Triangles lie over one another by the thousand.
    #[error(
        "the scene's triangles overlap too much: found over {} crossings of voxel rows; expected a level \
         of rooms (try a larger --cell)",
        voxels::MOST_CROSSINGS
    )]
    TooDense,
    /// The cell size is not a positive number.
    #[error("--cell {found}; expected a positive number of metres")]
    Cell {
        /// The size given.
        found: f64,
    },
    /// Blocks could not be told apart in the free space that is found.
    #[error(
        "--cell {found}; expected at least {expected:.3} m, the edge of the finest voxel for this mesh"
    )]
    CellTooSmall {
        /// Smallest accepted, metres.
        expected: f64,
        /// The size given.
        found: f64,
    },
    /// A share is not in [0, 1].
    #[error("{flag} {found}; expected a number from 0 to 1")]
    Share {
        /// Which flag.
        flag: &'static str,
        /// The value given.
        found: f64,
    },
    /// The blocks found are no level.
    #[error(transparent)]
    Level(#[from] LevelError),
}

/// Makes a level around a mesh.
///
/// # Errors
/// [`MapError`]; a mesh without rooms has no grid level.
pub fn map_mesh(mesh: &TriangleMesh, config: &MapConfig) -> Result<Mapped, MapError> {
    check(config)?;
    let points = surface::spread_points(mesh, SURFACE_POINTS);
    let mut mapped = match config.fit {
        Fit::Box => {
            let places: Vec<Vec3> = points.iter().map(|point| point.position).collect();
            from_level(box_fit::fit_box(closed_shape(), &places))
        }
        Fit::Grid => map_to_grid(mesh, config)?,
    };
    mapped.coverage = paint::paint_level(&mut mapped.level, mesh, &points);
    mapped.level.check()?;
    Ok(mapped)
}

fn check(config: &MapConfig) -> Result<(), MapError> {
    if let Some(found) = config
        .cell
        .filter(|&cell| !(cell.is_finite() && cell > 0.0))
    {
        return Err(MapError::Cell { found });
    }
    if config.max_blocks == 0 {
        return Err(MapError::NoBlocks);
    }
    for (flag, found) in [
        ("--openness", config.openness),
        ("--tolerance", config.tolerance),
        ("--crumbs", config.crumb_share),
    ] {
        if !(0.0..=1.0).contains(&found) {
            return Err(MapError::Share { flag, found });
        }
    }
    Ok(())
}

fn map_to_grid(mesh: &TriangleMesh, config: &MapConfig) -> Result<Mapped, MapError> {
    let triangles: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
    let [low, high] = bounds(mesh).ok_or(MapError::NoFreeSpace)?;
    let size = (high - low).as_dvec3();
    let voxel_edge = |voxels: f64| {
        // Flat scenes have an area but no volume to share out.
        let flat = size.max_element() / (voxels / 4.0).sqrt();
        (size.element_product() / voxels).cbrt().max(flat)
    };
    let free_space = |edge: f64| {
        let grid = VoxelGrid::around(low, high, edge);
        find_free_space(&triangles, grid, config.winding).ok_or(MapError::TooDense)
    };
    let finest = voxel_edge(MOST_VOXELS);
    let cell = match config.cell {
        Some(found) if found < finest => {
            return Err(MapError::CellTooSmall {
                expected: finest,
                found,
            });
        }
        Some(cell) => cell,
        None => {
            let first = free_space(voxel_edge(FIRST_VOXELS))?;
            usual_cell(&first, config.max_blocks).ok_or(MapError::NoFreeSpace)?
        }
    };
    let edge = (cell / VOXELS_A_CELL).max(finest);
    let space: FreeSpace = free_space(edge)?;
    let columns = Columns::new(&space, LEAST_HEADROOM * cell);
    if columns.runs.is_empty() {
        return Err(MapError::NoFreeSpace);
    }
    let lines = grid_lines::choose_lines(
        &space,
        &columns,
        &LineConfig {
            cell,
            max_cells: config.max_blocks,
            tolerance: config.tolerance,
        },
    );
    let cells = cells::cut_into_cells(&space, &columns, &lines);
    let joined = grid_fit::join_cells(
        &space,
        &lines,
        &cells,
        &JoinConfig {
            openness: config.openness,
            crumb_share: config.crumb_share,
        },
    )
    .map_err(|error| match error {
        LevelError::Empty => MapError::NoFreeSpace,
        error => MapError::Level(error),
    })?;
    Ok(Mapped {
        cell,
        crumbs: joined.crumbs,
        misfits: joined.misfits,
        closed_passages: joined.closed_passages,
        is_reversed: space.is_reversed,
        ..from_level(joined.level)
    })
}

/// The rooms' typical height, which makes cubes; less in levels that are not all rooms of one size, as
/// far as half the blocks allow.
fn usual_cell(space: &FreeSpace, max_blocks: usize) -> Option<f64> {
    let height = Columns::new(space, 0.0).typical_height()?;
    let volume = space.free_count() as f64 * space.grid.edge.powi(3);
    let is_one_room = volume < 8.0 * height.powi(3);
    if is_one_room {
        return Some(height);
    }
    let affordable = (2.0 * volume / max_blocks.max(1) as f64).cbrt();
    Some(affordable.clamp(0.6 * height, height))
}

fn from_level(level: Level) -> Mapped {
    Mapped {
        level,
        cell: 0.0,
        crumbs: 0,
        misfits: 0,
        closed_passages: 0,
        is_reversed: false,
        coverage: paint::Coverage::default(),
    }
}

fn closed_shape() -> &'static Shape {
    &mrt_runtime::blocks::SHAPES[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_core::geometry::cube::Face;
    use std::collections::HashSet;

    /// The walls around unit cells of free space, seen from inside.
    fn rooms(free: &[[std::ops::Range<i32>; 3]]) -> TriangleMesh {
        let cells: HashSet<[i32; 3]> = free
            .iter()
            .flat_map(|[xs, ys, zs]| {
                let (ys, zs) = (ys.clone(), zs.clone());
                xs.clone().flat_map(move |x| {
                    let zs = zs.clone();
                    ys.clone()
                        .flat_map(move |y| zs.clone().map(move |z| [x, y, z]))
                })
            })
            .collect();
        let mut cells: Vec<_> = cells.iter().copied().collect();
        cells.sort();
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for &cell in &cells {
            for face in Face::ALL {
                let step = face.outward().as_ivec3().to_array();
                let next = std::array::from_fn(|axis| cell[axis] + step[axis]);
                if cells.binary_search(&next).is_ok() {
                    continue;
                }
                let corner = Vec3::from_array(cell.map(|c| c as f32));
                let quad = face
                    .rectangle([0.0, 1.0], [0.0, 1.0])
                    .map(|p| corner + p.as_vec3());
                let first = positions.len() as u32;
                positions.extend(quad);
                let inward = (quad[1] - quad[0]).cross(quad[2] - quad[0]).as_dvec3();
                let [a, b, c, d] = if inward.dot(face.outward()) < 0.0 {
                    [0, 1, 2, 3]
                } else {
                    [0, 3, 2, 1]
                };
                triangles.push([first + a, first + b, first + c]);
                triangles.push([first + a, first + c, first + d]);
            }
        }
        TriangleMesh::from_triangles(positions, triangles)
    }

    fn map(mesh: &TriangleMesh, cell: f64) -> Mapped {
        let config = MapConfig {
            cell: Some(cell),
            ..MapConfig::default()
        };
        map_mesh(mesh, &config).expect("a level")
    }

    /// Number of blocks reached from the first through connections.
    fn reached(level: &Level) -> usize {
        let mut found = vec![0];
        let mut k = 0;
        while k < found.len() {
            for connection in &level.connections {
                let (a, b) = (connection.a.block, connection.b.block);
                for (from, to) in [(a, b), (b, a)] {
                    if from == found[k] && !found.contains(&to) {
                        found.push(to);
                    }
                }
            }
            k += 1;
        }
        found.len()
    }

    #[test]
    fn a_box_room_is_one_closed_block_with_its_bounds() {
        let mesh = rooms(&[[0..4, 0..3, 0..4]]);
        let mapped = map(&mesh, 4.0);
        assert_eq!(mapped.level.blocks.len(), 1);
        let block = &mapped.level.blocks[0];
        assert_eq!(block.shape.name, "closed");
        let (min, max) = block.warp.bounds();
        assert!(min.length() < 1e-6, "{min}");
        assert!(
            (max - glam::DVec3::new(4.0, 3.0, 4.0)).length() < 1e-6,
            "{max}"
        );
        assert!(mapped.coverage.inside > 0.999);
    }

    #[test]
    fn two_rooms_are_joined_through_a_doorway_and_apart_without_it() {
        let rooms_apart = [[0..4, 0..3, 0..4], [5..9, 0..3, 0..4]];
        let apart = map(&rooms(&rooms_apart), 4.0).level;
        assert_eq!(reached(&apart), 1);
        assert_eq!((apart.blocks.len(), apart.connections.len()), (2, 0));
        // 2 x 2 m of a side of 4 x 3 m.
        let door = [[0..4, 0..3, 0..4], [5..9, 0..3, 0..4], [4..5, 0..2, 1..3]];
        let joined = map(&rooms(&door), 4.0).level;
        assert!(joined.blocks.len() >= 2);
        assert_eq!(reached(&joined), joined.blocks.len());
    }

    #[test]
    fn a_corridor_around_a_corner_is_a_chain() {
        let mesh = rooms(&[[0..12, 0..3, 0..3], [9..12, 0..3, 0..12]]);
        let level = map(&mesh, 3.0).level;
        assert_eq!(reached(&level), level.blocks.len());
        assert_eq!(level.connections.len(), level.blocks.len() - 1);
        let count = |name| level.blocks.iter().filter(|b| b.shape.name == name).count();
        assert_eq!((count("dead_end"), count("corner")), (2, 1));
        assert_eq!(count("straight"), level.blocks.len() - 3);
    }

    #[test]
    fn storeys_become_layers_with_nothing_between() {
        let mesh = rooms(&[[0..4, 0..3, 0..4], [0..4, 4..7, 0..4]]);
        let level = map(&mesh, 4.0).level;
        assert_eq!((level.blocks.len(), level.connections.len()), (2, 0));
    }

    #[test]
    fn a_missing_side_is_an_opening_to_the_outside() {
        let mut mesh = rooms(&[[0..4, 0..4, 0..4]]);
        let is_front = |t: &[u32; 3]| t.iter().all(|&v| mesh.positions[v as usize].z == 0.0);
        let kept: Vec<[u32; 3]> = mesh
            .triangles
            .iter()
            .copied()
            .filter(|t| !is_front(t))
            .collect();
        mesh = TriangleMesh::from_triangles(mesh.positions, kept);
        let level = map(&mesh, 4.0).level;
        assert_eq!(level.blocks.len(), 1);
        assert!(level.blocks[0].is_open(Face::NegZ));
        assert!(level.connections.is_empty());
    }

    #[test]
    fn faces_turned_outwards_are_noticed() {
        let mut mesh = rooms(&[[0..4, 0..3, 0..4]]);
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let mapped = map(&mesh, 4.0);
        assert!(mapped.is_reversed);
        assert_eq!(mapped.level.blocks.len(), 1);
    }

    #[test]
    fn triangles_that_are_not_numbers_change_nothing() {
        let clean = rooms(&[[0..4, 0..3, 0..4]]);
        let mut faulty = clean.clone();
        let first = faulty.positions.len() as u32;
        faulty
            .positions
            .extend([Vec3::NAN, Vec3::splat(f32::INFINITY), Vec3::ONE]);
        faulty.triangles.push([first, first + 1, first + 2]);
        faulty.triangles.push([0, 0, 1]);
        faulty.triangle_materials.extend([0, 0]);
        let (cleaned, _) = mrt_core::geometry::mesh::clean(&faulty).expect("indices in range");
        assert_eq!(map(&cleaned, 4.0).level, map(&clean, 4.0).level);
    }

    #[test]
    fn the_limit_on_blocks_holds() {
        let mesh = rooms(&[[0..16, 0..3, 0..16]]);
        let config = MapConfig {
            cell: Some(2.0),
            max_blocks: 9,
            tolerance: 0.0,
            ..MapConfig::default()
        };
        let mapped = map_mesh(&mesh, &config).expect("a level");
        assert!(mapped.level.blocks.len() <= 9);
        assert_eq!(reached(&mapped.level), mapped.level.blocks.len());
    }

    #[test]
    fn a_box_holds_everything_but_outliers() {
        let mut mesh = rooms(&[[0..4, 0..3, 0..4]]);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([
            Vec3::new(90.0, 0.0, 0.0),
            Vec3::new(90.0, 0.1, 0.0),
            Vec3::new(90.0, 0.0, 0.1),
        ]);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangle_materials.push(0);
        let config = MapConfig {
            fit: Fit::Box,
            ..MapConfig::default()
        };
        let level = map_mesh(&mesh, &config).expect("a level").level;
        let (min, max) = level.blocks[0].warp.bounds();
        assert!(
            min.length() < 0.1 && max.distance(glam::DVec3::new(4.0, 3.0, 4.0)) < 0.1,
            "{max}"
        );
    }

    #[test]
    fn meshes_without_rooms_have_no_grid() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Z];
        let mesh = TriangleMesh::from_triangles(corners, vec![[0, 1, 2]]);
        let grid = map_mesh(&mesh, &MapConfig::default());
        assert_eq!(grid.expect_err("no rooms"), MapError::NoFreeSpace);
    }
}
