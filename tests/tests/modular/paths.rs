//! Transport along paths of openings, against exact form factors and against the reversed paths.

use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_dictionary::modular::paths::ends::{EMITTER, RECEIVER};
use mrt_dictionary::modular::paths::gather::{Signals, gather};
use mrt_dictionary::modular::surface::output_grid::OutputGrid;
use mrt_dictionary::modular::surface::walls::cube::texel_at;
use mrt_runtime::low_level::level::shape::Hole;
use mrt_runtime::low_level::modular::path::{Crossing, Word, response_frame};
use mrt_runtime::{Bounces, Coupling, Dictionary, Frame, FrameConfig};
use mrt_tests::{
    FrameForTests, Random, baked, configured, corridor, exact_of, floor_plan, from_level_order,
    in_level_order, largest_apart, lossless, ring, set_lightfields,
};
use std::sync::OnceLock;

const RESOLUTION: usize = 3;

/// A dictionary with as many modes of everything as a closed cube has texels.
fn full_rank() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("standard", "cubes-2d", |config| {
            let all = 6 * RESOLUTION * RESOLUTION;
            config.resolution = RESOLUTION;
            config.modes = all;
            config.coupling.emission_modes = all;
            config.coupling.response_modes = all;
            config.coupling.foreign_modes = all;
            config.outputs.probes = 0;
            // No light of these tests comes by lightfields.
            set_lightfields(config, 4, 8, 8);
        })
    })
}

/// Largest error of irradiance whose values are about 0.5 in the lit block.
const FULL_RANK: f64 = 1e-4;

#[test]
fn all_modes_together_are_exact_form_factors_through_openings() {
    let mut random = Random(17);
    let plans: [(&str, Vec<[i32; 2]>); 6] = [
        ("cube", corridor(1)),
        ("pair", corridor(2)),
        ("corridor", corridor(4)),
        ("T", vec![[0, 0], [1, 0], [2, 0], [1, 1], [1, 2]]),
        ("room", vec![[0, 0], [1, 0], [0, 1], [1, 1], [2, 1], [2, 0]]),
        ("ring", ring()),
    ];
    for (name, cells) in plans {
        let level = floor_plan(&cells, 1.0);
        let scene = configured(&level, full_rank(), &lossless(Coupling::Table));
        let exact = exact_of(&level, RESOLUTION);
        let transport = Transport::build(&exact);
        // One block is lit at a time, so that no path hides the error of another.
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
            let mut frame = Frame::new(&scene, FrameConfig::default());
            frame.light_from(&from_level_order(&level, &scene, &light), Bounces::Count(1));
            let found = in_level_order(&level, &scene, &frame.indirect());
            for (target, wall) in exact.walls().iter().enumerate() {
                let range = wall.first_texel..wall.first_texel + RESOLUTION * RESOLUTION;
                let [found, expected] =
                    [&found, &expected].map(|light| light[range.clone()].as_flattened());
                let apart = f64::from(largest_apart(found, expected));
                assert!(
                    apart < FULL_RANK,
                    "{name}, block {source}, wall {target}: {apart:.1e}"
                );
            }
        }
    }
}

/// The reversed path, and the symmetry from the axes of the path to the axes of the reversed path.
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
    // Light on the reversed path has the opposite heading. An axis that no crossing has stays where it is, or goes to a free
    // axis; the vertical axis is the first to choose.
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

/// Transport between each two walls along a path and along the reversed path, per unit of area. The last pair is the sum
/// over all walls.
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
    // The texels that send and receive on the reversed path.
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
    let back = |r: usize, e: usize| -> f64 { here[(receives[e], sends[r])] };
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

/// Largest difference between both ways at 8² texels, relative to all transport of the path.
const RECIPROCITY: f64 = 0.02;

#[test]
fn transport_along_a_path_is_reciprocal() {
    let words = Word::all(3, 2, &Hole::ALL, true);
    assert!(words.iter().any(|word| word.name() == "zxy"));
    for word in &words {
        // A texel receives at its centre and sends from its whole area, so both ways agree only in the limit of small texels.
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
