//! What stays when a frame goes on with another scene.

use glam::{Vec3, vec3};
use mrt_runtime::blocks::Face;
use mrt_runtime::{
    AssembleConfig, BlockIndex, Dictionary, Frame, FrameConfig, Level, Light, Scene,
};

fn scene(cells: &[[i32; 3]]) -> Scene {
    let bytes = include_bytes!("../../assets/versions/2.mrt");
    let dictionary = Dictionary::from_bytes(bytes).expect("sound");
    let level = Level::from_cells(cells, Vec3::splat(0.7)).expect("a level");
    Scene::assemble(&level, &dictionary, &AssembleConfig::default()).expect("it fits")
}

/// Indirect light of a face of a block, row by row; none for an opening.
fn light_of_face(frame: &Frame, block: usize, face: Face) -> Vec<Vec3> {
    let block = BlockIndex::new(block);
    let size = frame.scene().resolution();
    let texels = (0..size * size).filter_map(|k| {
        let texel = frame.scene().texel(block, face, k / size, k % size)?;
        frame.indirect_at(block, texel)
    });
    texels.collect()
}

#[test]
fn walls_that_stay_keep_their_light() {
    // A bend, whose last block is a dead end. Then the first is gone, the last leads on to both sides, and the order is
    // another one.
    let before = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1]];
    let after = [[2, 0, 2], [2, 0, 1], [3, 0, 1], [2, 0, 0], [1, 0, 0]];
    let mut frame = Frame::new(&scene(&before), FrameConfig::default());
    let lamp = Light::sphere(vec3(1.6, 0.6, 0.45), 0.1, vec3(3.0, 2.0, 1.0));
    let lamp = frame.add_light(lamp);
    for _ in 0..3 {
        frame.solve();
    }
    let shown: Vec<_> = (0..before.len())
        .map(|block| Face::ALL.map(|face| light_of_face(&frame, block, face)))
        .collect();
    let old = |block: usize| before.iter().position(|cell| *cell == after[block]);
    frame.change_scene(&scene(&after), |block| {
        old(block.get()).map(BlockIndex::new)
    });
    assert!(frame.light(lamp).is_some());
    let mut kept = 0;
    for block in 0..after.len() {
        for face in Face::ALL {
            let light = light_of_face(&frame, block, face);
            let old_light = old(block).map(|old| &shown[old][face.index()]);
            match old_light.filter(|old| old.len() == light.len()) {
                Some(old_light) => {
                    assert_eq!(&light, old_light, "block {block}, face {face}");
                    kept += usize::from(light.iter().any(|e| e.max_element() > 0.0));
                }
                None => assert!(light.iter().all(|e| *e == Vec3::ZERO)),
            }
        }
    }
    // Three walls of the junction, four of the bend, and four of the block before it, which was open to both sides.
    assert_eq!(kept, 11);
}
