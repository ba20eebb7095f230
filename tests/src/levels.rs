//! Levels by floor plan.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_runtime::Level;
use mrt_runtime::blocks::{Connection, Opening};

/// A level of unit cells at floor height 0, given by (x, z). Neighbouring cells are connected.
pub fn floor_plan(cells: &[[i32; 2]], albedo: f32) -> Level {
    let cells: Vec<[i32; 3]> = cells.iter().map(|&[x, z]| [x, 0, z]).collect();
    Level::from_cells(&cells, Vec3::splat(albedo)).expect("cells side by side are a level")
}

/// Cells (0, 0) to (count - 1, 0).
pub fn corridor(count: i32) -> Vec<[i32; 2]> {
    (0..count).map(|x| [x, 0]).collect()
}

/// Cells (0, 0) to (side - 1, side - 1), row by row.
pub fn square(side: i32) -> Vec<[i32; 2]> {
    (0..side * side).map(|k| [k % side, k / side]).collect()
}

/// The eight cells around a pillar.
pub fn ring() -> Vec<[i32; 2]> {
    let mut cells = square(3);
    cells.retain(|&cell| cell != [1, 1]);
    cells
}

/// Levels without an opening to the outside, by name.
pub fn closed_floor_plans() -> Vec<(&'static str, Vec<[i32; 2]>)> {
    let mut t_junction = corridor(5);
    t_junction.extend([[2, 1], [2, 2]]);
    vec![
        ("cube", corridor(1)),
        ("corridor of 2", corridor(2)),
        ("corridor of 5", corridor(5)),
        ("corridor of 12", corridor(12)),
        ("T-junction", t_junction),
        ("loop of 8", ring()),
        ("room 2x2", square(2)),
        ("room 3x3", square(3)),
        ("room 5x5", square(5)),
    ]
}

/// Cells turned about the middle of cell (0, 0, 0).
pub fn turned_cells(cells: &[[i32; 3]], turn: CubeRotation) -> Vec<[i32; 3]> {
    let turned = |cell: &[i32; 3]| {
        let corner = DVec3::from_array(cell.map(f64::from));
        turn.direction(corner).as_ivec3().to_array()
    };
    cells.iter().map(turned).collect()
}

/// Connects an opening of a block with the opposite opening of another.
pub fn connected(block: usize, face: Face, other: usize) -> Connection {
    Connection {
        a: Opening { block, face },
        b: Opening {
            block: other,
            face: face.opposite(),
        },
    }
}
