//! What frames skip changes nothing: bit by bit, they show what frames show that compute everything.

use allocation_counter::measure;
use glam::{DVec3, Vec3};
use mrt_runtime::BlockIndex;
use mrt_runtime::FrameReport;
use mrt_runtime::LightError;
use mrt_runtime::blocks::maze;
use mrt_runtime::shadows::{Openings, Rays, Versioned};
use mrt_runtime::{Bounces, Frame, FrameConfig, Level, Light, Outputs, ProbeOrder, Scene};
use mrt_tests::FrameForTests;
use mrt_tests::sequences::{
    STORAGES, difference, furnish, mobile, mobile_dictionary, random_albedo, random_level,
    random_lights, stored, vector_dictionary,
};
use mrt_tests::{Random, default_dictionary, floor_plan, sphere};

/// All that a frame can compute.
const OUTPUTS: Outputs = Outputs {
    lightmap: true,
    probes: Some(ProbeOrder::L2),
    vector: true,
};

/// What is done to a frame, and to its twin.
#[derive(Clone, Debug)]
enum Solve {
    Openings,
    /// Everything left of the plane x = this is lit.
    Rays(f64),
    /// The same, with a version.
    Versioned(f64, u64),
    /// Openings with a version, asked texel by texel.
    VersionedOpenings,
    /// Direct light that is even in one block.
    FromDirect(usize),
    /// One more light has no direction, and is skipped.
    Faulty,
}

/// A game, as far as frames see it.
struct Game {
    random: Random,
    level: Level,
    scene: Scene,
    lights: Vec<Light>,
    doors: Vec<f32>,
    /// All changes so far, for frames that are new.
    changes: Vec<Change>,
    bounces: Bounces,
    solve: Solve,
    version: u64,
    /// For [`Solve::FromDirect`].
    direct: Vec<f32>,
    /// For [`Solve::Faulty`].
    faulty: Vec<Light>,
}

/// What a game changes about a frame besides lights.
#[derive(Clone, Debug)]
enum Change {
    Door(usize, f32),
    Albedo(BlockIndex, Vec<Vec3>),
    Emission(BlockIndex, Vec<Vec3>),
}

impl Change {
    fn apply(&self, frame: &mut Frame) {
        match self {
            Change::Door(door, value) => frame.set_door(*door, *value).expect("a fraction"),
            Change::Albedo(block, colours) => {
                let set = frame.set_texel_albedo(*block, colours);
                set.expect("colours in range");
            }
            Change::Emission(block, colours) => {
                let set = frame.set_texel_emission(*block, colours);
                set.expect("colours in range");
            }
        }
    }
}

impl Game {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let level = if seed.is_multiple_of(2) {
            let blocks = 1 + random.below(30);
            random_level(&mut random, blocks)
        } else {
            let mut level = maze(1 + random.below(100), Vec3::ONE, seed);
            furnish(&mut random, &mut level);
            level
        };
        // Sizes and outputs differ, and with them the kernels.
        let dictionary = match seed % 12 {
            4 | 5 => vector_dictionary(),
            10 => default_dictionary(),
            _ => mobile_dictionary(),
        };
        let scene = stored(&level, dictionary, STORAGES[(seed % 5) as usize % 3]);
        Self {
            doors: scene.level.doors.clone(),
            changes: Vec::new(),
            random,
            level,
            scene,
            lights: Vec::new(),
            bounces: Bounces::Count(1),
            solve: Solve::Openings,
            version: 0,
            direct: Vec::new(),
            faulty: Vec::new(),
        }
    }

    /// One change, or none.
    fn step(&mut self) -> Option<Change> {
        let random = &mut self.random;
        let mut change = None;
        match random.below(20) {
            0..5 if !self.lights.is_empty() => {
                let which = random.below(self.lights.len());
                let new = random_lights(random, &self.level, &self.scene, 1);
                if let Some(&new) = new.first() {
                    self.lights[which] = new;
                }
            }
            5 if !self.lights.is_empty() => {
                let which = random.below(self.lights.len());
                self.lights.remove(which);
            }
            6 | 7 if self.lights.len() < 8 => {
                let at = random.below(self.lights.len() + 1);
                let new = random_lights(random, &self.level, &self.scene, 1);
                self.lights.splice(at..at, new);
            }
            8 if !self.doors.is_empty() => {
                let door = random.below(self.doors.len());
                self.doors[door] = [0.0, 1.0, random.unit() as f32][random.below(3)];
                change = Some(Change::Door(door, self.doors[door]));
            }
            9 => {
                let block = random.below(self.level.blocks.len());
                let count = self.scene.level.blocks[block].texels.len();
                let colours: Vec<Vec3> = (0..count).map(|_| random_albedo(random)).collect();
                let block = BlockIndex::new(block);
                change = Some(if random.below(2) == 0 {
                    Change::Albedo(block, colours)
                } else {
                    let on = random.below(2) as f32;
                    Change::Emission(block, colours.iter().map(|c| *c * on).collect())
                });
            }
            10 => {
                self.bounces = [
                    Bounces::Count(0),
                    Bounces::Count(1),
                    Bounces::Count(1),
                    Bounces::Count(3),
                    Bounces::Feedback,
                    Bounces::Feedback,
                    Bounces::Feedback,
                    Bounces::Converged {
                        tolerance: 1e-3,
                        limit: 30,
                    },
                ][random.below(8)];
            }
            11 => {
                let x = 3.0 * random.unit();
                if random.below(2) == 0 {
                    self.version += 1;
                }
                let block = random.below(self.level.blocks.len());
                self.solve = match random.below(9) {
                    0 => Solve::Rays(x),
                    // The plane moves with the version.
                    1 => Solve::Versioned(self.version as f64 % 3.0, self.version),
                    2 => Solve::VersionedOpenings,
                    3 => Solve::FromDirect(block),
                    4 => Solve::Faulty,
                    _ => Solve::Openings,
                };
            }
            // Nothing changes.
            _ => {}
        }
        if let Solve::FromDirect(block) = self.solve {
            let texels = &self.scene.level.blocks[block].texels;
            self.direct = vec![0.0; 3 * self.scene.texel_count()];
            self.direct[3 * texels.start..3 * texels.end].fill(1.5);
        }
        let nowhere = Light::Directional {
            direction: Vec3::ZERO,
            irradiance: Vec3::ONE,
        };
        self.faulty = self.lights.iter().copied().chain([nowhere]).collect();
        self.changes.extend(change.clone());
        change
    }

    fn solve(&self, frame: &mut Frame) -> FrameReport {
        let (lights, bounces) = (&self.lights[..], self.bounces);
        let left_of =
            |x: f64| Rays(move |from: DVec3, _: DVec3| if from.x < x { 1.0 } else { 0.0 });
        match self.solve {
            Solve::Openings => frame.light_with(lights, bounces),
            Solve::Rays(x) => frame.light_through(lights, &left_of(x), bounces),
            Solve::Versioned(x, version) => {
                let visibility = left_of(x);
                let versioned = Versioned {
                    visibility,
                    version,
                };
                frame.light_through(lights, &versioned, bounces)
            }
            Solve::VersionedOpenings => {
                // Versions of rays are below this one.
                let versioned = Versioned {
                    visibility: Openings,
                    version: u64::MAX,
                };
                frame.light_through(lights, &versioned, bounces)
            }
            Solve::FromDirect(_) => frame.light_from(&self.direct, bounces),
            Solve::Faulty => {
                frame.set_lights(&self.faulty);
                frame.set_bounces(bounces);
                let report = frame.solve();
                let skipped = report.skipped_lights();
                assert_eq!(skipped.len(), 1);
                assert!(matches!(skipped[0].reason, LightError::NoDirection { .. }));
                report
            }
        }
    }

    fn frame(&self) -> Frame {
        let config = FrameConfig {
            outputs: OUTPUTS,
            ..FrameConfig::default()
        };
        let mut frame = Frame::new(&self.scene, config);
        self.changes
            .iter()
            .for_each(|change| change.apply(&mut frame));
        frame
    }
}

/// Random games, each played with a frame that goes on from what it knows and one that forgets before every frame; where
/// nothing of the frame before is asked for, also with a new one. No frame allocates.
#[test]
fn frames_that_skip_show_what_frames_show_that_compute_everything() {
    const GAMES: u64 = 36;
    const FRAMES: usize = 120;
    let mut skipped = [0usize; 2];
    for seed in 0..GAMES {
        let mut game = Game::new(seed);
        let mut frame = game.frame();
        let mut forgetful = game.frame();
        for step in 0..FRAMES {
            let change = game.step();
            if let Some(change) = &change {
                change.apply(&mut forgetful);
            }
            let context = || {
                let Game { bounces, solve, .. } = &game;
                format!("game {seed}, frame {step}, {bounces:?}, {solve:?}")
            };
            forgetful.forget();
            let allocated = measure(|| {
                if let Some(change) = &change {
                    change.apply(&mut frame);
                }
                game.solve(&mut frame);
            });
            assert_eq!(allocated.count_total, 0, "{}", context());
            game.solve(&mut forgetful);
            let difference_of = difference(&frame, &forgetful);
            assert_eq!(difference_of, None, "{}", context());
            assert_eq!(
                frame.last_report().passes(),
                forgetful.last_report().passes(),
                "{}",
                context()
            );
            if game.bounces == Bounces::Count(1) {
                skipped[0] += frame.last_report().work().targets;
                skipped[1] += forgetful.last_report().work().targets;
            }
            if game.bounces != Bounces::Feedback {
                let mut fresh = game.frame();
                game.solve(&mut fresh);
                let difference = difference(&frame, &fresh);
                assert_eq!(difference, None, "fresh, {}", context());
            }
        }
    }
    println!("blocks computed in frames of one bounce: {skipped:?}");
    // There is something to skip.
    assert!(skipped[0] < skipped[1] * 4 / 5, "{skipped:?}");
}

/// A bent room beside a corridor sends a block light that is negative on all walls, so these stay dark, and not in the
/// probes: no bounce at all must be dark there too.
#[test]
fn without_bounces_probes_are_dark() {
    for seed in 0..60 {
        let mut game = Game::new(seed);
        let lights = random_lights(&mut game.random, &game.level, &game.scene, 3);
        let mut frame = game.frame();
        for bounces in [Bounces::Count(1), Bounces::Count(0)] {
            frame.light_with(&lights, bounces);
        }
        let probes = frame.probes().expect("asked for").values();
        assert!(probes.as_flattened().iter().all(|&x| x == 0.0), "{seed}");
    }
}

/// Who asks openings himself sees doors move, whatever his version says.
#[test]
fn doors_move_for_versioned_openings_too() {
    let mut level = floor_plan(&[[0, 0], [1, 0], [2, 0]], 0.5);
    level.doors.push(mrt_runtime::blocks::Door {
        connection: 0,
        value: 1.0,
    });
    let scene = mobile(&level);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let lamp = sphere(Vec3::new(0.3, 0.5, 0.4), 0.1, Vec3::ONE);
    let versioned = Versioned {
        visibility: Openings,
        version: 1,
    };
    for value in [1.0, 0.0, 0.5] {
        frame.set_door(0, value).expect("a fraction");
        frame.light_through(&[lamp], &versioned, Bounces::Count(1));
        let behind: f32 = frame.direct()[3 * scene.level.blocks[1].texels.start..]
            .iter()
            .sum();
        assert_eq!(behind > 0.0, value > 0.0, "{value}: {behind}");
    }
}

/// With a tolerance, blocks keep light that one of several lamps hardly changes, in lightmap and probes, err by no more than
/// is stated, and are dark once the lamps are out.
#[test]
fn light_that_hardly_changes_is_kept() {
    const ALBEDO: f32 = 0.7;
    let level = maze(41, Vec3::splat(ALBEDO), 7);
    let scene = mobile(&level);
    let lamp = |block: usize| {
        let middle = level.blocks[block].warp.center().as_vec3();
        sphere(middle + Vec3::new(0.1, 0.2, -0.15), 0.1, Vec3::ONE)
    };
    let mut lights = [5, 15, 25, 35].map(lamp);
    let outputs = Outputs {
        probes: Some(ProbeOrder::L2),
        ..Outputs::default()
    };
    let apart = |found: &[f32], expected: &[f32]| {
        let pairs = found.iter().zip(expected);
        pairs.fold(0.0f32, |m, (a, b)| m.max((a - b).abs()))
    };
    for (bounces, passed_on) in [
        (Bounces::Count(1), 1.0 + ALBEDO),
        (Bounces::Feedback, (1.0 + ALBEDO) / (1.0 - ALBEDO)),
    ] {
        let solve = |frame: &mut Frame, lights: &[Light]| {
            frame.light_with(lights, bounces);
        };
        let mut exact = Frame::new(
            &scene,
            FrameConfig {
                outputs,
                ..FrameConfig::default()
            },
        );
        solve(&mut exact, &lights);
        let brightest = exact.indirect().into_iter().fold(0.0, f32::max);
        let config = FrameConfig {
            outputs,
            tolerance: 1e-3 * brightest,
            ..FrameConfig::default()
        };
        let stated = config.tolerance * passed_on + 1e-6 * brightest;
        let mut frame = Frame::new(&scene, config);
        solve(&mut frame, &lights);
        let (mut targets, mut kept, mut all) = (0, 0, 0);
        for step in 0..50 {
            if let Light::Sphere { position, .. } = &mut lights[0] {
                position.x += if step % 2 == 0 { 0.01 } else { -0.01 };
            }
            solve(&mut frame, &lights);
            solve(&mut exact, &lights);
            targets += frame.last_report().work().targets;
            kept += frame.last_report().work().kept;
            all += exact.last_report().work().targets;
            let walls = apart(&frame.indirect(), &exact.indirect());
            let lightmap = apart(
                frame.lightmap().pixels().as_flattened(),
                exact.lightmap().pixels().as_flattened(),
            );
            assert!(
                walls <= stated && lightmap <= stated,
                "{bounces:?}, frame {step}: {walls} and {lightmap} of {stated}"
            );
            let probes = |frame: &Frame| {
                let probes = frame.probes().expect("they were asked for");
                probes.values().as_flattened().to_vec()
            };
            // Turning five coefficients to the world may add their errors up, as lengths are.
            let in_probes = apart(&probes(&frame), &probes(&exact));
            assert!(
                in_probes <= 5f32.sqrt() * stated,
                "{bounces:?}: {in_probes}"
            );
        }
        println!("{bounces:?}: {targets} targets and {kept} kept, of {all}");
        assert!(kept > 0 && targets < all);
        // Feedback takes as many frames as it has bounces to see.
        for _ in 0..100 {
            solve(&mut frame, &[]);
        }
        let left = frame.indirect().into_iter().fold(0.0, f32::max);
        assert!(left <= stated, "{bounces:?}: {left}");
        if bounces == Bounces::Count(1) {
            assert_eq!(left, 0.0);
        }
    }
}

/// Beams have room for about twelve lights a block; beyond that, texels ask for each light.
#[test]
fn more_beams_than_there_is_room_for_come_and_go() {
    let level = random_level(&mut Random(5), 6);
    let scene = mobile(&level);
    let mut random = Random(9);
    let all = random_lights(&mut random, &level, &scene, 700);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    for step in 0..24 {
        // Up and down through the limit, with lights moved among those that stay.
        let count = [all.len(), 300, 3, 0][step % 4];
        let mut lights = all[..count].to_vec();
        if count > 0 {
            let which = random.below(count);
            lights.splice(which..=which, random_lights(&mut random, &level, &scene, 1));
        }
        let allocated = measure(|| {
            frame.light_with(&lights, Bounces::Count(1));
        });
        assert_eq!(allocated.count_total, 0, "frame {step}");
        let mut fresh = Frame::new(&scene, FrameConfig::default());
        fresh.light_with(&lights, Bounces::Count(1));
        assert_eq!(difference(&frame, &fresh), None, "frame {step}");
    }
}

/// Light that is within the tolerance goes out with its lamp, whatever larger shapes the same task computed before.
#[test]
fn faint_light_of_small_shapes_goes_out() {
    let cells = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [9, 0, 0]];
    let level = Level::from_cells(&cells, Vec3::splat(0.02)).expect("a row, and a closed block");
    let scene = mobile(&level);
    let rows = |block: usize| scene.shapes[scene.blocks[block].shape_index].rows;
    assert!(rows(3) < rows(1), "{} and {}", rows(3), rows(1));
    let lamp = |block: usize, aside: f32| {
        let middle = level.blocks[block].warp.center().as_vec3();
        sphere(middle + Vec3::new(aside, 0.2, -0.15), 0.1, Vec3::ONE)
    };
    let mut exact = Frame::new(&scene, FrameConfig::default());
    let lights = [lamp(3, 0.1), lamp(1, 0.1)];
    exact.light_with(&lights, Bounces::Count(1));
    let largest = |values: &[f32]| values.iter().fold(0.0f32, |m, &e| m.max(e));
    let closed = scene.level.blocks[3].texels.clone();
    let closed = 3 * closed.start..3 * closed.end;
    let (direct, indirect) = (exact.direct(), exact.indirect());
    let config = FrameConfig {
        tolerance: 0.5 * largest(&direct[closed.clone()]),
        ..FrameConfig::default()
    };
    assert!(largest(&indirect[closed.clone()]) < 0.2 * config.tolerance);
    let mut frame = Frame::new(&scene, config);
    // The second frame leaves what it summed up for the row of blocks behind.
    for lights in [&lights[..], &[lights[0], lamp(1, -0.2)], &[lamp(1, -0.2)]] {
        frame.light_with(lights, Bounces::Count(1));
    }
    assert_eq!(largest(&frame.indirect()[closed]), 0.0);
}
