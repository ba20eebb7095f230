//! Maps a real scene to a level of blocks (Loos et al. 2011, sections 6.2 and 7.2).
//!
//! The paper's artists place blocks by hand; here blocks are found: one closed box around everything, or the free space cut
//! along a grid. Only what lies inside rooms becomes blocks, so light that the level carries cannot leak through walls that
//! a grid line follows.

pub mod config;
pub mod voxels;
pub mod column_runs;
pub mod cell;
mod storeys;
pub mod cut;
pub mod grid_lines;
pub mod grid_fit;
pub mod box_fit;
pub mod mesh_samples;
pub mod paint;

use column_runs::ColumnRuns;
use config::{Fit, MapConfig, MapError};
use glam::{DVec3, Vec3};
use grid_fit::{GridLevel, JoinConfig};
use grid_lines::LineConfig;
use mrt_core::geometry::mesh::{TriangleMesh, bounds};
use mrt_runtime::Level;
use mrt_runtime::LevelError;
use mrt_runtime::blocks::{SHAPES, Shape};
use mrt_runtime::low_level::output::receiver::ReceiverMap;
use paint::{PaintReport, PaintedMesh, coverage, distances, paint_level};
use voxels::{FreeSpace, VoxelGrid, Winding, find_free_space};

/// Points spread over the mesh to measure albedos and coverage.
const SURFACE_POINTS: usize = 100_000;

/// Voxels of a first, coarse search for free space, which tells the rooms' height.
const FIRST_VOXELS: f64 = 4e5;

/// More voxels than this are not made; cells then have fewer voxels across.
const MOST_VOXELS: f64 = 6e6;

/// Voxels across a cell.
const VOXELS_A_CELL: f64 = 10.0;

/// Free space lower than this share of a cell belongs to no room.
const LEAST_HEADROOM: f64 = 0.2;

/// Rooms lower than this share of a cell are lost, and those of less than two voxels are not found: a cell has at most so
/// many heights of a room.
const HEIGHTS_A_CELL: f64 = VOXELS_A_CELL / 2.0;

/// Enclosed volume over the area to the power of 1.5 above which a mesh is a solid.
const LEAST_SOLIDITY: f64 = 2e-3;

/// A level around a mesh.
#[derive(Clone, Debug)]
pub struct Mapped {
    /// Consistent: [`Level::check`] passes.
    pub level: Level,
    /// Wanted width of a block that was used, metres; 0 for a box.
    pub cell: f64,
    /// Cells dropped because their group is too small to matter.
    pub crumbs: usize,
    /// Cells dropped because they are too flat, folded or in one another's way.
    pub misfits: usize,
    /// Passages closed because the cells on both sides could not be brought to one height.
    pub closed_passages: usize,
    /// True when the faces were found to be turned away from the rooms.
    pub is_reversed: bool,
    /// How much of the mesh the blocks hold.
    pub coverage: paint::Coverage,
    /// What the walls got.
    pub paint: PaintReport,
}

/// Makes a level around a mesh.
///
/// # Errors
/// [`MapError`]; a mesh without rooms has no grid level.
pub fn map_mesh(painted: PaintedMesh<'_>, config: &MapConfig) -> Result<Mapped, MapError> {
    config.check()?;
    let mesh = painted.mesh;
    let mut points = mesh_samples::sample_mesh(mesh, SURFACE_POINTS);
    let mut mapped = match config.fit {
        Fit::Box => {
            let places: Vec<Vec3> = points.iter().map(|point| point.position).collect();
            Mapped::new(box_fit::fit_box(closed_shape(), &places))
        }
        Fit::Grid => map_to_grid(mesh, config)?,
    };
    if mapped.is_reversed || config.winding == Winding::Back {
        for point in &mut points {
            point.normal = -point.normal;
        }
    }
    let receivers = ReceiverMap::new(&mapped.level);
    let distances = distances(&mapped.level, &receivers, &points);
    mapped.coverage = coverage(&points, &distances);
    let level = &mut mapped.level;
    mapped.paint = paint_level(level, painted, &receivers, &points, &distances);
    mapped.level.check()?;
    Ok(mapped)
}

fn map_to_grid(mesh: &TriangleMesh, config: &MapConfig) -> Result<Mapped, MapError> {
    let voxelizer = Voxelizer::new(mesh, config.winding)?;
    let cell = cell_width(&voxelizer, config)?;
    let space = voxelizer.free_space((cell / VOXELS_A_CELL).max(voxelizer.finest()))?;
    let joined = cut_and_join(&space, cell, config).map_err(|error| match error {
        MapError::NoFreeSpace => voxelizer.why_no_free_space(config),
        error => error,
    })?;
    Ok(Mapped {
        cell,
        crumbs: joined.crumbs,
        misfits: joined.misfits,
        closed_passages: joined.closed_passages,
        is_reversed: space.is_reversed,
        ..Mapped::new(joined.level)
    })
}

/// A mesh whose free space is looked for.
struct Voxelizer {
    triangles: Vec<[Vec3; 3]>,
    low: Vec3,
    high: Vec3,
    winding: Winding,
}

impl Voxelizer {
    fn new(mesh: &TriangleMesh, winding: Winding) -> Result<Self, MapError> {
        let triangles = (0..mesh.triangles.len()).map(|t| mesh.corners(t));
        let [low, high] = bounds(mesh).ok_or(MapError::NoFreeSpace)?;
        Ok(Self {
            triangles: triangles.collect(),
            low,
            high,
            winding,
        })
    }

    /// Edge of a voxel, metres, of which about `count` fill the mesh's bounds.
    fn edge(&self, count: f64) -> f64 {
        let size: DVec3 = (self.high - self.low).as_dvec3();
        // Flat scenes have an area but no volume to share out.
        let flat = size.max_element() / (count / 4.0).sqrt();
        (size.element_product() / count).cbrt().max(flat)
    }

    /// Edge of the smallest voxel that is made, metres.
    fn finest(&self) -> f64 {
        self.edge(MOST_VOXELS)
    }

    fn free_space(&self, edge: f64) -> Result<FreeSpace, MapError> {
        let grid = VoxelGrid::around(self.low, self.high, edge);
        find_free_space(&self.triangles, grid, self.winding).ok_or(MapError::TooDense)
    }

    /// The cause that explains best why no free space was found.
    fn why_no_free_space(&self, config: &MapConfig) -> MapError {
        let coarse = || self.free_space(self.edge(FIRST_VOXELS)).ok();
        if let Some(found) = config.cell
            && let Some(height) = coarse().and_then(|space| room_height(&space))
            && found > HEIGHTS_A_CELL * height
        {
            let expected = HEIGHTS_A_CELL * height;
            return MapError::CellTooLarge { expected, found };
        }
        if self.winding != Winding::Both && self.is_solid() {
            return MapError::Solid;
        }
        MapError::NoFreeSpace
    }

    /// True if the faces look away from what they enclose, as those of a statue: by the divergence theorem, the volume that
    /// they enclose is then positive. A mesh that encloses next to nothing for its area is not solid but open.
    fn is_solid(&self) -> bool {
        let center = (self.low + self.high).as_dvec3() / 2.0;
        let (mut volume, mut area) = (0.0, 0.0);
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3() - center);
            volume += a.dot(b.cross(c)) / 6.0;
            area += (b - a).cross(c - a).length() / 2.0;
        }
        let outward = if self.winding == Winding::Back {
            -volume
        } else {
            volume
        };
        // A ball has 1 / (6 sqrt(pi)) = 0.094, a box of 100 : 10 : 1 still 0.0094.
        outward > LEAST_SOLIDITY * area.powf(1.5)
    }
}

/// The width asked for, or one that suits the rooms, metres.
fn cell_width(voxelizer: &Voxelizer, config: &MapConfig) -> Result<f64, MapError> {
    match config.cell {
        Some(found) if found < voxelizer.finest() => Err(MapError::CellTooSmall {
            expected: voxelizer.finest(),
            found,
        }),
        Some(cell) => Ok(cell),
        None => {
            let space = voxelizer.free_space(voxelizer.edge(FIRST_VOXELS))?;
            usual_cell(&space, config.max_blocks).ok_or_else(|| voxelizer.why_no_free_space(config))
        }
    }
}

/// The rooms' typical height, metres; `None` without free space.
fn room_height(space: &FreeSpace) -> Option<f64> {
    ColumnRuns::new(space, 0.0).typical_height()
}

/// The rooms' typical height, which makes cubes. In levels of rooms of several sizes less, as far as half of the blocks
/// allow. `None` without free space.
fn usual_cell(space: &FreeSpace, max_blocks: usize) -> Option<f64> {
    let height = room_height(space)?;
    let volume = space.free_count() as f64 * space.grid.edge.powi(3);
    let is_one_room = volume < 8.0 * height.powi(3);
    if is_one_room {
        return Some(height);
    }
    let affordable = (2.0 * volume / max_blocks.max(1) as f64).cbrt();
    Some(affordable.clamp(0.6 * height, height))
}

/// Cuts the free space along grid lines and joins what becomes of it.
fn cut_and_join(space: &FreeSpace, cell: f64, config: &MapConfig) -> Result<GridLevel, MapError> {
    let columns = ColumnRuns::new(space, LEAST_HEADROOM * cell);
    if columns.runs.is_empty() {
        return Err(MapError::NoFreeSpace);
    }
    let line_config = LineConfig {
        cell,
        max_cells: config.max_blocks,
        tolerance: config.tolerance,
    };
    let lines = grid_lines::choose_lines(space, &columns, &line_config);
    let cells = cut::cut_into_cells(space, &columns, &lines);
    let join_config = JoinConfig {
        openness: config.openness,
        crumb_share: config.crumb_share,
    };
    grid_fit::join_cells(space, &lines, &cells, &join_config).map_err(|error| match error {
        LevelError::Empty => MapError::NoFreeSpace,
        error => MapError::Level(error),
    })
}

impl Mapped {
    /// A level of which nothing was left out; its coverage is not known yet.
    fn new(level: Level) -> Self {
        Self {
            level,
            cell: 0.0,
            crumbs: 0,
            misfits: 0,
            closed_passages: 0,
            is_reversed: false,
            coverage: paint::Coverage::default(),
            paint: PaintReport::default(),
        }
    }
}

fn closed_shape() -> &'static Shape {
    &SHAPES[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::surface_colours::SurfaceColours;
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
        map_grey(mesh, &config).expect("a level")
    }

    fn map_grey(mesh: &TriangleMesh, config: &MapConfig) -> Result<Mapped, MapError> {
        let colours = &SurfaceColours::of_materials(mesh);
        map_mesh(PaintedMesh { mesh, colours }, config)
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
        let mapped = map_grey(&mesh, &config).expect("a level");
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
        let level = map_grey(&mesh, &config).expect("a level").level;
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
        let grid = map_grey(&mesh, &MapConfig::default());
        assert_eq!(grid.expect_err("no rooms"), MapError::NoFreeSpace);
    }

    #[test]
    fn solids_and_cells_that_are_too_large_are_named() {
        let mut statue = rooms(&[[0..1, 0..2, 0..1], [0..1, 2..3, 0..3]]);
        statue.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let front = MapConfig {
            winding: Winding::Front,
            ..MapConfig::default()
        };
        assert_eq!(
            map_grey(&statue, &front).expect_err("solid"),
            MapError::Solid
        );
        let room = rooms(&[[0..4, 0..3, 0..4]]);
        let wide = MapConfig {
            cell: Some(200.0),
            ..MapConfig::default()
        };
        let error = map_grey(&room, &wide).expect_err("too large");
        let MapError::CellTooLarge { expected, found } = error else {
            panic!("expected that the cell is too large, found {error}");
        };
        assert!(
            found == 200.0 && (expected - 15.0).abs() < 0.5,
            "{expected}"
        );
        // What is said to be accepted is accepted.
        assert_eq!(map(&room, expected).level.blocks.len(), 1);
    }
}
