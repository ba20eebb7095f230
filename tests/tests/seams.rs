//! Steps of light where a wall goes on from block to block.
//!
//! What each block computes for itself must meet at the edge between them. The light on either side is continued
//! to the edge along a line through its last two texels; the difference is the step that a viewer would see.

mod common;

use common::{Random, assembled, closed_floor_plans, floor_plan, random_cells, solved, sphere};
use glam::{DVec3, Vec3};
use mrt_core::cube::Face;
use mrt_runtime::frame::{Bounces, Frame};
use mrt_runtime::level::Level;
use mrt_runtime::scene::{Beyond, Scene};
use mrt_tests::oracle_file::{oracle_folder_or_report, read};

/// Largest step, as a fraction of the level's mean.
const LARGEST_STEP: f64 = 0.03;

/// Light within this distance of an edge, in block widths, shows a hot spot there, which a line does not continue.
const TOUCHES: f64 = 0.25;

/// A texel of a wall next to one of its sides, `depth` texels from it, at position `along` of the edge.
fn beside(
    scene: &Scene,
    block: usize,
    wall: Face,
    side: Face,
    depth: usize,
    along: DVec3,
) -> (usize, DVec3) {
    let step = (depth as f64 + 0.5) / scene.resolution as f64;
    let mut point = along;
    point[side.axis()] = if side.is_positive() { 1.0 - step } else { step };
    point[wall.axis()] = if wall.is_positive() { 1.0 } else { 0.0 };
    let offset = scene.blocks[block]
        .shape
        .wall_offset(wall, scene.resolution)
        .expect("a wall");
    (offset + wall.texel_index(point, scene.resolution), point)
}

/// The step at each position of each edge between joined walls, and where it is.
fn steps(scene: &Scene, frame: &Frame) -> Vec<(f64, DVec3)> {
    let mut steps = Vec::new();
    for (index, block) in scene.blocks.iter().enumerate() {
        for side in Face::ALL {
            let Beyond::Block {
                block: there,
                here_from_there,
                face: side_there,
            } = block.beyond[side.index()]
            else {
                continue;
            };
            // Each pair once.
            if there < index {
                continue;
            }
            let back = here_from_there.inverse();
            for wall in block
                .shape
                .walls()
                .filter(|wall| wall.axis() != side.axis())
            {
                let wall_there = back.face(wall);
                if scene.blocks[there].shape.is_open(wall_there) {
                    continue;
                }
                for k in 0..scene.resolution {
                    let along = DVec3::splat((k as f64 + 0.5) / scene.resolution as f64);
                    let at = |block: usize, wall: Face, side: Face, depth: usize, along: DVec3| {
                        let (texel, _) = beside(scene, block, wall, side, depth, along);
                        f64::from(frame.indirect_at(scene, block, texel)[0])
                    };
                    let edge = |block, wall, side, along| {
                        1.5 * at(block, wall, side, 0, along)
                            - 0.5 * at(block, wall, side, 1, along)
                    };
                    let (_, point) = beside(scene, index, wall, side, 0, along);
                    let along_there = back.point(point);
                    let step = edge(index, wall, side, along)
                        - edge(there, wall_there, side_there, along_there);
                    steps.push((step.abs(), block.warp.point(point)));
                }
            }
        }
    }
    steps
}

fn mean(frame: &Frame) -> f64 {
    let sum: f64 = frame.indirect().iter().map(|&e| f64::from(e)).sum();
    sum / frame.indirect().len() as f64
}

/// Largest step over the mean, of light from `position`.
fn largest_step(scene: &Scene, position: Vec3, bounces: Bounces) -> f64 {
    let frame = solved(scene, &[sphere(position, 0.1, Vec3::ONE)], bounces);
    let largest = steps(scene, &frame)
        .into_iter()
        .filter(|(_, place)| place.distance(position.as_dvec3()) > TOUCHES)
        .fold((0.0, DVec3::ZERO), |a, b| if b.0 > a.0 { b } else { a });
    let share = largest.0 / mean(&frame);
    println!(
        "light at {position:.2}, {bounces:?}: {:.2} % at {:.2}",
        100.0 * share,
        largest.1
    );
    share
}

fn check(name: &str, level: &Level, lights: &[Vec3]) {
    let scene = assembled(level);
    for &light in lights {
        for bounces in [Bounces::Count(1), Bounces::Count(20)] {
            let share = largest_step(&scene, light, bounces);
            assert!(share <= LARGEST_STEP, "{name}, light at {light}: {share}");
        }
    }
}

#[test]
fn joined_walls_of_the_reference_levels_show_no_step() {
    let Some(folder) = oracle_folder_or_report("steps in the reference levels") else {
        return;
    };
    for name in ["corridor5", "l_turn", "t_junction", "room3x3", "maze11"] {
        let reference = read(&folder.join(format!("{name}.json"))).expect("sound");
        let level = Level::from_cells(&reference.cells, Vec3::splat(0.7)).expect("a level");
        let lights: Vec<Vec3> = reference.lights.iter().map(|p| p.as_vec3()).collect();
        check(name, &level, &lights);
    }
}

#[test]
fn joined_walls_of_random_mazes_show_no_step() {
    let mut random = Random(5);
    for maze in 0..8 {
        let cells = random_cells(&mut random, 12);
        let level = floor_plan(&cells, 0.7);
        let lights: Vec<Vec3> = (0..3)
            .map(|_| {
                let [x, z] = cells[random.below(cells.len())];
                let mut inside = || 0.3 + 0.4 * random.unit() as f32;
                Vec3::new(x as f32 + inside(), inside(), z as f32 + inside())
            })
            .collect();
        check(&format!("maze {maze}"), &level, &lights);
    }
}

#[test]
fn uniform_light_shows_no_step() {
    for (name, cells) in closed_floor_plans() {
        let scene = assembled(&floor_plan(&cells, 0.5));
        let mut frame = Frame::new(&scene);
        frame
            .solve_from_direct(
                &scene,
                &vec![1.0; 3 * scene.texel_count()],
                Bounces::Count(1),
            )
            .expect("light of the right length");
        let largest = steps(&scene, &frame)
            .iter()
            .fold(0.0, |m: f64, s| m.max(s.0));
        println!("{name}: {:.3} %", 100.0 * largest / mean(&frame));
        assert!(largest <= LARGEST_STEP * mean(&frame), "{name}: {largest}");
    }
}
