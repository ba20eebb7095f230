//! Tunnels: levels of round tubes.

use crate::levels::connected;
use glam::{DVec3, Vec3};
use mrt_runtime::Level;
use mrt_runtime::blocks::{Block, CubeRotation, Face, Hexahedron, Shape};
use mrt_runtime::low_level::level::shape::{Aperture, shape_set};

/// Albedo of all walls.
pub const ALBEDO: f32 = 0.6;

/// Tubes along a walk from cell to neighbouring cell. Both ends lead outside.
pub fn tunnel(cells: &[[i32; 3]]) -> Level {
    let shapes = shape_set("cylinders").expect("a set");
    let heading = |k: usize| {
        let step: [i32; 3] = std::array::from_fn(|axis| cells[k + 1][axis] - cells[k][axis]);
        let step = DVec3::from_array(step.map(f64::from));
        let mut faces = Face::ALL.into_iter();
        faces
            .find(|face| face.outward() == step)
            .expect("cells that are neighbours")
    };
    let last = cells.len() - 1;
    let mut level = Level::default();
    for (k, cell) in cells.iter().enumerate() {
        let entrance = heading(k.saturating_sub(1)).opposite();
        let exit = heading(k.min(last - 1));
        let (shape, orientation) = tube_between(&shapes, [entrance, exit]);
        let warp = Hexahedron::cell(DVec3::from_array(cell.map(f64::from)));
        let block = Block::new(shape, orientation, warp, Vec3::splat(ALBEDO));
        level.blocks.push(block);
        if k < last {
            level.connections.push(connected(k, heading(k), k + 1));
        }
    }
    level
}

/// The shape and the rotation that open towards both faces, upright if possible.
fn tube_between(shapes: &[&'static Shape], open: [Face; 2]) -> (&'static Shape, CubeRotation) {
    let upright = (0..4).map(CubeRotation::about_y);
    let fits = |shape: &Shape, rotation: CubeRotation| {
        let opens = |aperture: &Aperture| open.contains(&rotation.face(aperture.face));
        shape.openings.iter().all(opens)
    };
    upright
        .chain(CubeRotation::all())
        .flat_map(|rotation| shapes.iter().map(move |&shape| (shape, rotation)))
        .find(|&(shape, rotation)| fits(shape, rotation))
        .expect("a tube joins any two faces")
}
