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
use mrt_core::mesh::{TriangleMesh, bounds};
use mrt_runtime::level::{Level, LevelError};
use mrt_runtime::shape::Shape;
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
    /// No point with a floor below and walls around.
    #[error(
        "the scene encloses no free space: found no point with a floor below and faces towards it on \
         most sides; try --winding both, or --fit box for one block around everything"
    )]
    NoFreeSpace,
    /// The cell size is not a positive number.
    #[error("--cell {found}; expected a positive number of metres")]
    Cell {
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
        let flat = size.max_element() / voxels.sqrt();
        (size.element_product() / voxels).cbrt().max(flat)
    };
    let free_space = |edge: f64, winding: Winding| {
        find_free_space(&triangles, VoxelGrid::around(low, high, edge), winding)
    };
    let cell = match config.cell {
        Some(cell) => cell,
        None => {
            let first = free_space(voxel_edge(FIRST_VOXELS), config.winding);
            usual_cell(&first, config.max_blocks).ok_or(MapError::NoFreeSpace)?
        }
    };
    let edge = (cell / VOXELS_A_CELL).max(voxel_edge(MOST_VOXELS));
    let space: FreeSpace = free_space(edge, config.winding);
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
    &mrt_runtime::shape::SHAPES[0]
}
