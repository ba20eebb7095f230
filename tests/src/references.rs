//! What frames are compared with: files that another renderer computed, and the exact solver.

use mrt_core::geometry::cube::Face;
use mrt_core::reference::oracle_file::{ReferenceFile, oracle_folder, read};
use mrt_core::reference::radiosity::{ExactScene, Side};
use mrt_runtime::Level;

/// The reference file `name` of the folder `oracle`. Tests that read one are ignored where the folder is absent.
pub fn reference(name: &str) -> ReferenceFile {
    let folder = oracle_folder().expect("shared/oracle exists");
    read(&folder.join(format!("{name}.json"))).expect("the reference file is sound")
}

/// The level for the exact solver. All openings must be whole faces; one without a connection leads to the sky.
pub fn exact_of(level: &Level, resolution: usize) -> ExactScene {
    let neighbours = level.neighbours();
    let sides = level
        .blocks
        .iter()
        .enumerate()
        .map(|(index, block)| {
            Face::ALL.map(|face| match neighbours[index][face.index()] {
                Some(there) => Side::Opening(there.block, there.face),
                None if block.is_open(face) => Side::Sky,
                None => Side::Wall,
            })
        })
        .collect();
    let blocks = level.blocks.iter().map(|block| block.warp).collect();
    ExactScene::new(blocks, sides, resolution).expect("the level is sound")
}
