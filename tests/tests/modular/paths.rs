//! Transport along paths of openings, against form factors and against itself run backwards.

use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::modular::paths::ends::{EMITTER, RECEIVER};
use mrt_dictionary::modular::paths::gather::{Signals, gather};
use mrt_dictionary::modular::surface::output_grid::OutputGrid;
use mrt_dictionary::modular::surface::walls::cube::texel_at;
use mrt_dictionary::progress::Progress;
use mrt_runtime::BlockIndex;
use mrt_runtime::FrameConfig;
use mrt_runtime::low_level::level::shape::Hole;
use mrt_runtime::low_level::modular::path::{Crossing, Word, response_frame};
use mrt_runtime::{AssembleConfig, Bounces, Dictionary, Frame, Scene};
use mrt_tests::FrameForTests;
use mrt_tests::{Random, exact_of, floor_plan, in_level_order, largest_difference};
use std::sync::OnceLock;

const RESOLUTION: usize = 3;

/// As many modes of everything as there are texels.
fn full_rank() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        let mut config = BakeConfig::preset("standard").expect("a preset");
        let all = 6 * RESOLUTION * RESOLUTION;
        config.resolution = RESOLUTION;
        config.modes = all;
        config.coupling.emission_modes = all;
        config.coupling.response_modes = all;
        config.coupling.foreign_modes = all;
        config.outputs.probes = 0;
        // The lightfields are not what is looked at.
        config.lightfield.positions = 4;
        config.lightfield.directions = 8;
        config.lightfield.lightfield_modes = 8;
        config.check().expect("in range");
        bake(&config, &Progress::silent()).expect("nobody cancels")
    })
}

#[test]
fn all_modes_together_are_exact_form_factors_through_openings() {
    let mut random = Random(17);
    let ring = [
        [0, 0],
        [1, 0],
        [2, 0],
        [2, 1],
        [2, 2],
        [1, 2],
        [0, 2],
        [0, 1],
    ];
    let plans: [(&str, &[[i32; 2]]); 6] = [
        ("cube", &[[0, 0]]),
        ("pair", &[[0, 0], [1, 0]]),
        ("corridor", &[[0, 0], [1, 0], [2, 0], [3, 0]]),
        ("T", &[[0, 0], [1, 0], [2, 0], [1, 1], [1, 2]]),
        ("room", &[[0, 0], [1, 0], [0, 1], [1, 1], [2, 1], [2, 0]]),
        ("ring", &ring),
    ];
    for (name, cells) in plans {
        let level = floor_plan(cells, 1.0);
        let scene = Scene::assemble(&level, full_rank(), &exact_config()).expect("it fits");
        let exact = exact_of(&level, RESOLUTION);
        let transport = Transport::build(&exact);
        // Light on one block at a time, so that each path counts for itself.
        for source in 0..cells.len() {
            let mut light = vec![[0.0f32; 3]; exact.texel_count()];
            for wall in exact.walls().iter().filter(|wall| wall.block == source) {
                for e in &mut light[wall.first_texel..][..RESOLUTION * RESOLUTION] {
                    *e = [0, 1, 2].map(|_| random.unit() as f32);
                }
            }
            let expected: Vec<[f32; 3]> = (0..exact.texel_count())
                .map(|receiver| {
                    std::array::from_fn(|c| {
                        (0..exact.texel_count())
                            .map(|sender| {
                                transport.factor(receiver, sender) * f64::from(light[sender][c])
                            })
                            .sum::<f64>() as f32
                    })
                })
                .collect();
            let found = first_bounce(&level, &scene, &light);
            for (target, wall) in exact.walls().iter().enumerate() {
                let range = wall.first_texel..wall.first_texel + RESOLUTION * RESOLUTION;
                let largest =
                    |s: &[[f32; 3]]| s.as_flattened().iter().fold(0.0f32, |m, x| m.max(x.abs()));
                let apart = largest_difference(&found[range.clone()], &expected[range.clone()])
                    * f64::from(largest(&expected[range]));
                assert!(
                    apart < FULL_RANK,
                    "{name}, block {source}, wall {target}: {apart:.1e}"
                );
            }
        }
    }
}

/// Values are about 0.5 in the own block.
const FULL_RANK: f64 = 1e-4;

/// One bounce of direct light given in the order of the level.
fn first_bounce(
    level: &mrt_runtime::Level,
    scene: &mrt_runtime::Scene,
    light: &[[f32; 3]],
) -> Vec<[f32; 3]> {
    let mut direct = vec![0.0; 3 * scene.texel_count()];
    let mut next = light.iter();
    for (index, block) in level.blocks.iter().enumerate() {
        let texels = &scene.level.blocks[index].texels;
        for face in Face::ALL.into_iter().filter(|&face| !block.is_open(face)) {
            for k in 0..RESOLUTION * RESOLUTION {
                let texel = scene
                    .level
                    .level_texel(BlockIndex::new(index), face, k / RESOLUTION, k % RESOLUTION)
                    .expect("walls have texels");
                let value = next.next().expect("one value a texel");
                for c in 0..3 {
                    direct[3 * texels.start + c * texels.len() + texel] = value[c];
                }
            }
        }
    }
    let mut frame = Frame::new(scene, FrameConfig::default());
    frame.light_from(&direct, Bounces::Count(1));
    in_level_order(level, scene, &frame.indirect())
}

/// A path run backwards, and the symmetry that takes the axes of the path to its.
fn reversed(word: &Word) -> (Word, CubeSymmetry) {
    let letters = [Face::PosZ, Face::PosX, Face::PosY];
    let mut image: [Option<Face>; 3] = [None; 3];
    let mut used = 0;
    let mut back = Word::default();
    for crossing in word.crossings().iter().rev() {
        let axis = crossing.heading.axis();
        let heading = *image[axis].get_or_insert_with(|| {
            used += 1;
            letters[used - 1]
        });
        back = back.then(Crossing {
            heading,
            hole: crossing.hole,
        });
    }
    // Headings are reversed; axes that no crossing has go to what is left, and keep up where they can.
    let mut taken: Vec<usize> = image.iter().flatten().map(|face| face.axis()).collect();
    let mut images = [Face::PosX; 3];
    for axis in [1, 0, 2] {
        images[axis] = match image[axis] {
            Some(face) => face.opposite(),
            None => {
                let free = if taken.contains(&axis) {
                    (0..3).find(|a| !taken.contains(a)).expect("three axes")
                } else {
                    axis
                };
                taken.push(free);
                Face::from_axis(free, true)
            }
        };
    }
    let [x, y, z] = images;
    let symmetry = CubeSymmetry::from_images(x, y, z).expect("perpendicular");
    (back, symmetry)
}

/// Transport from wall to wall along a path and back, both per unit of area.
fn exchanged(word: &Word, resolution: usize) -> Vec<(f64, f64)> {
    let setup = OutputGrid {
        resolution,
        probes: 0,
        vector: false,
    };
    let (back, symmetry) = reversed(word);
    let there = gather(word, Signals::EachTexel, &setup).irradiance;
    let here = gather(&back, Signals::EachTexel, &setup).irradiance;
    let (frame, frame_back) = (response_frame(word), response_frame(&back));
    let emitter: Vec<(Face, DVec3)> = EMITTER.texels(resolution).collect();
    let receiver: Vec<(Face, DVec3)> = RECEIVER.texels(resolution).collect();
    // Where each texel of the path is on its way back.
    let sends: Vec<usize> = receiver
        .iter()
        .map(|&(face, point)| {
            let map = symmetry.after(frame);
            texel_at(&EMITTER, map.face(face), map.point(point), resolution).expect("a wall")
        })
        .collect();
    let receives: Vec<usize> = emitter
        .iter()
        .map(|&(face, point)| {
            let map = frame_back.inverse().after(symmetry);
            texel_at(&RECEIVER, map.face(face), map.point(point), resolution).expect("a wall")
        })
        .collect();
    let per_wall = resolution * resolution;
    let walls = EMITTER.wall_count();
    let sum = |factor: &dyn Fn(usize, usize) -> f64, to: usize, from: usize| -> f64 {
        (to * per_wall..(to + 1) * per_wall)
            .flat_map(|r| (from * per_wall..(from + 1) * per_wall).map(move |e| (r, e)))
            .map(|(r, e)| factor(r, e))
            .sum::<f64>()
            / per_wall as f64
    };
    let forth = |r: usize, e: usize| -> f64 { there[(r, e)] };
    let back = |r: usize, e: usize| -> f64 { at(&here, receives[e], sends[r]) };
    let mut pairs: Vec<(f64, f64)> = (0..walls)
        .flat_map(|to| (0..walls).map(move |from| (to, from)))
        .map(|(to, from)| (sum(&forth, to, from), sum(&back, to, from)))
        .collect();
    let total = pairs
        .iter()
        .fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
    pairs.push(total);
    pairs
}

fn at(matrix: &Matrix<f64>, row: usize, column: usize) -> f64 {
    matrix[(row, column)]
}

#[test]
fn light_goes_back_the_way_it_came() {
    let words = Word::all(3, 2, &Hole::ALL, true);
    assert!(words.iter().any(|word| word.name() == "zxy"));
    for word in &words {
        // Texels receive at their centres and send from all over, so both ways agree as texels shrink only.
        let errors = [4, 8].map(|resolution| {
            let pairs = exchanged(word, resolution);
            let total = pairs.last().expect("the sum").0;
            let worst = pairs.iter().fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            worst / total
        });
        println!("{}: {:.4} {:.4}", word.name(), errors[0], errors[1]);
        assert!(errors[1] < RECIPROCITY, "{}: {errors:?}", word.name());
    }
}

/// At 8², of all that the path carries.
const RECIPROCITY: f64 = 0.02;

/// Operators as they are, to compare with exact ones.
fn exact_config() -> AssembleConfig {
    AssembleConfig {
        transport_storage: mrt_core::storage::Storage::F32,
        negligible: Some(0.0),
        ..AssembleConfig::default()
    }
}
