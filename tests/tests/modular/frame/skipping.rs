//! Work that frames skip changes no bit: they show what frames show that compute everything.

use allocation_counter::measure;
use glam::{DVec3, Vec3};
use mrt_core::storage::Storage;
use mrt_runtime::blocks::{Door, maze};
use mrt_runtime::shadows::{Openings, Rays, Versioned};
use mrt_runtime::{
    BlockIndex, Bounces, Frame, FrameConfig, FrameReport, Level, Light, LightError, Outputs,
    ProbeOrder, Scene,
};
use mrt_tests::{
    FrameForTests, Random, corridor, default_dictionary, difference, floor_plan, furnish,
    largest_apart, mobile, mobile_dictionary, random_albedo, random_level, random_lights, solved,
    stored, vector_dictionary, with_outputs,
};

/// All outputs that a frame can compute.
const OUTPUTS: Outputs = Outputs {
    lightmap: true,
    probes: Some(ProbeOrder::L2),
    vector: true,
};

/// How a frame is solved.
#[derive(Clone, Debug)]
enum Solve {
    /// With the shadows of openings.
    Openings,
    /// With rays: all points left of the plane x = this are lit.
    Rays(f64),
    /// As [`Solve::Rays`], with a version.
    Versioned(f64, u64),
    /// With the shadows of openings, as if they were rays with a version.
    VersionedOpenings,
    /// From direct light that is even in this block and 0 elsewhere.
    FromDirect(usize),
    /// With the shadows of openings and one more light, which is skipped since it has no direction.
    Faulty,
}

/// A random game, as far as frames see it.
struct Game {
    random: Random,
    level: Level,
    scene: Scene,
    lights: Vec<Light>,
    doors: Vec<f32>,
    /// All changes so far, for new frames.
    changes: Vec<Change>,
    bounces: Bounces,
    solve: Solve,
    version: u64,
    /// Direct light for [`Solve::FromDirect`].
    direct: Vec<f32>,
    /// Lights for [`Solve::Faulty`].
    faulty: Vec<Light>,
}

/// A change to a frame besides its lights.
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
        // Dictionaries of different sizes and outputs use different kernels.
        let dictionary = match seed % 12 {
            4 | 5 => vector_dictionary(),
            10 => default_dictionary(),
            _ => mobile_dictionary(),
        };
        let scene = stored(&level, dictionary, Storage::ALL[(seed % 5) as usize % 3]);
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

    /// Changes something, or nothing. Returns a change that is to be applied to frames.
    fn step(&mut self) -> Option<Change> {
        let mut change = None;
        match self.random.below(20) {
            kind @ 0..8 => self.change_lights(kind),
            8 if !self.doors.is_empty() => change = Some(self.turn_door()),
            9 => change = Some(self.paint()),
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
                ][self.random.below(8)];
            }
            11 => self.change_solve(),
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

    /// Moves a light, removes one or adds one, by `kind`.
    fn change_lights(&mut self, kind: usize) {
        let Self { random, lights, .. } = self;
        match kind {
            0..5 if !lights.is_empty() => {
                let which = random.below(lights.len());
                let new = random_lights(random, &self.level, &self.scene, 1);
                if let Some(&new) = new.first() {
                    lights[which] = new;
                }
            }
            5 if !lights.is_empty() => {
                let which = random.below(lights.len());
                lights.remove(which);
            }
            6 | 7 if lights.len() < 8 => {
                let at = random.below(lights.len() + 1);
                let new = random_lights(random, &self.level, &self.scene, 1);
                lights.splice(at..at, new);
            }
            _ => {}
        }
    }

    fn turn_door(&mut self) -> Change {
        let Self { random, doors, .. } = self;
        let door = random.below(doors.len());
        doors[door] = [0.0, 1.0, random.unit() as f32][random.below(3)];
        Change::Door(door, doors[door])
    }

    /// Changes what the walls of a block reflect or emit.
    fn paint(&mut self) -> Change {
        let random = &mut self.random;
        let block = random.below(self.level.blocks.len());
        let count = self.scene.level.blocks[block].texels.len();
        let colours: Vec<Vec3> = (0..count).map(|_| random_albedo(random)).collect();
        let block = BlockIndex::new(block);
        if random.below(2) == 0 {
            Change::Albedo(block, colours)
        } else {
            let on = random.below(2) as f32;
            Change::Emission(block, colours.iter().map(|c| *c * on).collect())
        }
    }

    fn change_solve(&mut self) {
        let random = &mut self.random;
        let x = 3.0 * random.unit();
        if random.below(2) == 0 {
            self.version += 1;
        }
        let block = random.below(self.level.blocks.len());
        self.solve = match random.below(9) {
            0 => Solve::Rays(x),
            // The plane depends on the version.
            1 => Solve::Versioned(self.version as f64 % 3.0, self.version),
            2 => Solve::VersionedOpenings,
            3 => Solve::FromDirect(block),
            4 => Solve::Faulty,
            _ => Solve::Openings,
        };
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
                // A version that rays never have.
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
        let mut frame = with_outputs(&self.scene, OUTPUTS);
        self.changes
            .iter()
            .for_each(|change| change.apply(&mut frame));
        frame
    }
}

/// Plays random games with one frame that skips what it can, with one that forgets everything before it solves, and, except
/// for feedback, with a new frame every time. No frame allocates.
#[test]
fn skipped_work_changes_no_bit() {
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
                skipped[0] += frame.work().targets;
                skipped[1] += forgetful.work().targets;
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
    // A fifth of the work is skipped at least.
    assert!(skipped[0] < skipped[1] * 4 / 5, "{skipped:?}");
}

/// In a bent room beside a corridor, light from another block may be negative on all walls of a block, which stay dark, and
/// positive in its probes. Such light must vanish from the probes too when there are no bounces.
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

/// Doors change the light even if the caller's version of shadows stays the same.
#[test]
fn doors_move_for_versioned_openings_too() {
    let mut level = floor_plan(&corridor(3), 0.5);
    level.doors.push(Door {
        connection: 0,
        value: 1.0,
    });
    let scene = mobile(&level);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let lamp = Light::sphere(Vec3::new(0.3, 0.5, 0.4), 0.1, Vec3::ONE);
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

/// A maze with four lamps, one of which moves to and fro.
struct MovingLamp {
    scene: Scene,
    lights: [Light; 4],
    bounces: Bounces,
}

impl MovingLamp {
    const ALBEDO: f32 = 0.7;
    const OUTPUTS: Outputs = Outputs {
        lightmap: true,
        probes: Some(ProbeOrder::L2),
        vector: false,
    };

    fn new(bounces: Bounces) -> Self {
        let level = maze(41, Vec3::splat(Self::ALBEDO), 7);
        let lamp = |block: usize| {
            let middle = level.blocks[block].warp.center().as_vec3();
            Light::sphere(middle + Vec3::new(0.1, 0.2, -0.15), 0.1, Vec3::ONE)
        };
        Self {
            lights: [5, 15, 25, 35].map(lamp),
            scene: mobile(&level),
            bounces,
        }
    }

    fn step(&mut self, step: usize) {
        if let Light::Sphere { position, .. } = &mut self.lights[0] {
            position.x += if step.is_multiple_of(2) { 0.01 } else { -0.01 };
        }
    }

    fn solve(&self, frame: &mut Frame) {
        frame.light_with(&self.lights, self.bounces);
    }
}

/// Largest differences between two frames on the walls, in the lightmap and in probes.
fn largest_differences(a: &Frame, b: &Frame) -> [f32; 3] {
    let probes = |frame: &Frame| {
        let probes = frame.probes().expect("the frame was asked for probes");
        probes.values().as_flattened().to_vec()
    };
    let [map_a, map_b] = [a, b].map(|frame| frame.lightmap().pixels().as_flattened());
    [
        largest_apart(&a.indirect(), &b.indirect()),
        largest_apart(map_a, map_b),
        largest_apart(&probes(a), &probes(b)),
    ]
}

/// With a tolerance, blocks keep light that the one lamp that moves hardly changes. Lightmap and probes err by no more than
/// stated, and become dark once the lamps are out.
#[test]
fn light_that_hardly_changes_is_kept() {
    let albedo = MovingLamp::ALBEDO;
    for (bounces, passed_on) in [
        (Bounces::Count(1), 1.0 + albedo),
        (Bounces::Feedback, (1.0 + albedo) / (1.0 - albedo)),
    ] {
        let mut game = MovingLamp::new(bounces);
        let mut exact = with_outputs(&game.scene, MovingLamp::OUTPUTS);
        game.solve(&mut exact);
        let brightest = exact.indirect().into_iter().fold(0.0, f32::max);
        let config = FrameConfig {
            outputs: MovingLamp::OUTPUTS,
            tolerance: 1e-3 * brightest,
            ..FrameConfig::default()
        };
        let stated = config.tolerance * passed_on + 1e-6 * brightest;
        let mut frame = Frame::new(&game.scene, config);
        game.solve(&mut frame);
        let (mut targets, mut kept, mut all) = (0, 0, 0);
        for step in 0..50 {
            game.step(step);
            game.solve(&mut frame);
            game.solve(&mut exact);
            targets += frame.work().targets;
            kept += frame.work().kept;
            all += exact.work().targets;
            let [walls, lightmap, probes] = largest_differences(&frame, &exact);
            assert!(
                walls <= stated && lightmap <= stated,
                "{bounces:?}, frame {step}: {walls} and {lightmap} of {stated}"
            );
            // Turning five coefficients to world axes may add up their errors, as the components of a vector do.
            assert!(probes <= 5f32.sqrt() * stated, "{bounces:?}: {probes}");
        }
        println!("{bounces:?}: {targets} targets and {kept} kept, of {all}");
        assert!(kept > 0 && targets < all);
        // Feedback needs a frame for each bounce.
        for _ in 0..100 {
            frame.light_with(&[], bounces);
        }
        let left = frame.indirect().into_iter().fold(0.0, f32::max);
        assert!(left <= stated, "{bounces:?}: {left}");
        if bounces == Bounces::Count(1) {
            assert_eq!(left, 0.0);
        }
    }
}

/// Beams have room for about twelve lights a block. With more lights, texels walk to each light instead.
#[test]
fn beams_may_exceed_their_room_and_fit_again() {
    let level = random_level(&mut Random(5), 6);
    let scene = mobile(&level);
    let mut random = Random(9);
    let all = random_lights(&mut random, &level, &scene, 700);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    for step in 0..24 {
        // The number of lights crosses the limit in both directions, and one light moves.
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
        let fresh = solved(&scene, &lights, Bounces::Count(1));
        assert_eq!(difference(&frame, &fresh), None, "frame {step}");
    }
}

/// A block with a small shape becomes dark with its lamp, although its light is within the tolerance, and although the same
/// task has just computed larger shapes.
#[test]
fn faint_light_of_small_shapes_goes_out() {
    let cells = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [9, 0, 0]];
    let level = Level::from_cells(&cells, Vec3::splat(0.02)).expect("a row, and a closed block");
    let scene = mobile(&level);
    let rows = |block: usize| scene.shapes[scene.blocks[block].shape_index].rows;
    assert!(rows(3) < rows(1), "{} and {}", rows(3), rows(1));
    let lamp = |block: usize, aside: f32| {
        let middle = level.blocks[block].warp.center().as_vec3();
        Light::sphere(middle + Vec3::new(aside, 0.2, -0.15), 0.1, Vec3::ONE)
    };
    let lights = [lamp(3, 0.1), lamp(1, 0.1)];
    let exact = solved(&scene, &lights, Bounces::Count(1));
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
    // The second frame leaves the sums for the row of blocks in scratch memory.
    for lights in [&lights[..], &[lights[0], lamp(1, -0.2)], &[lamp(1, -0.2)]] {
        frame.light_with(lights, Bounces::Count(1));
    }
    assert_eq!(largest(&frame.indirect()[closed]), 0.0);
}
