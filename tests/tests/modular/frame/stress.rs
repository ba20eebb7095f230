//! Large and unkind levels, long runs, and the work that frames do.

use allocation_counter::measure;
use glam::{DVec3, Vec3};
use mrt_runtime::blocks::maze;
use mrt_runtime::low_level::light::placed::place;
use mrt_runtime::low_level::modular::frame::report::FrameWork;
use mrt_runtime::{Bounces, Frame, FrameConfig, Level, Light, Scene};
use mrt_tests::{
    Flux, FrameForTests, Random, difference, floor_plan, furnish, largest_apart, mobile, normal_of,
    position_of, random_intensity, random_level, random_lights, shown, solved,
};
use std::ops::Range;

/// Largest excess of the flux of a bounce over the flux that left the walls, relative to direct light. Frames scale down any
/// excess above `SPOT_GAIN`, up to rounding.
const GAIN: f64 = 0.0501;

/// Tolerance for rounding of `f32` sums over a block, relative.
const ROUNDING: f64 = 1e-5;

/// Random lights, one light in the very centre of a texel, and lights close to a wall, of up to 1e6 W/sr.
fn unkind_lights(random: &mut Random, level: &Level, scene: &Scene) -> Vec<Light> {
    let count = random.below(9);
    let mut lights = random_lights(random, level, scene, count);
    let texel = random.below(scene.texel_count());
    let on = position_of(scene, texel);
    lights.push(Light::sphere(on, 0.0, random_intensity(random)));
    for distance in [1e-6, 1e-4, 1e-2] {
        let near = on + distance * normal_of(scene, texel);
        lights.push(Light::sphere(near, 0.0, random_intensity(random)));
    }
    // Through rounding, the centre of a texel may be outside.
    lights.retain(|&light| place(&scene.level, light).is_ok());
    lights
}

/// Solves once more. Checks that all numbers are finite, that irradiance is not negative, and that no bounce carries more flux
/// than left the walls.
fn check_solve(frame: &mut Frame, flux: &Flux, lights: &[Light], bounces: Bounces, case: &str) {
    let before = frame.indirect();
    frame.light_with(lights, bounces);
    for (name, values) in shown(frame) {
        let sound = |&bits: &u32| {
            let x = f32::from_bits(bits);
            x.is_finite() && (x >= 0.0 || name == "coefficients")
        };
        assert!(values.iter().all(sound), "{name}, {case}, {bounces:?}");
    }
    let arrived = flux.arrived(&frame.indirect());
    let sent = flux.reflected(&frame.direct());
    let emitted = flux.emitted();
    // Feedback also sends the indirect light of the frame before.
    let sent_again = match bounces {
        Bounces::Feedback => flux.reflected(&before),
        _ => [0.0; 3],
    };
    for c in 0..3 {
        let sent = (sent[c] + emitted[c]) * (1.0 + GAIN);
        let bound = match bounces {
            Bounces::Count(1) | Bounces::Feedback => sent + sent_again[c] * (1.0 + ROUNDING),
            // The sum of bounces between walls whose largest albedo is 0.99.
            _ => 100.0 * sent * (1.0 + ROUNDING),
        };
        let arrived = arrived[c];
        assert!(
            arrived <= bound,
            "{arrived} of {bound}, {case}, {bounces:?}"
        );
    }
}

/// Checks one level with all kinds of bounces, and that faulty lights change nothing.
fn stress(seed: u64, level: &Level) {
    let case = format!("seed {seed}");
    let mut random = Random(seed);
    let scene = mobile(level);
    let lights = unkind_lights(&mut random, level, &scene);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let flux = Flux::unweighted(&frame);
    for bounces in [
        Bounces::Count(1),
        Bounces::Feedback,
        Bounces::Feedback,
        Bounces::Count(2),
        Bounces::Converged {
            tolerance: 1e-2,
            limit: 200,
        },
    ] {
        check_solve(&mut frame, &flux, &lights, bounces, &case);
    }
    frame.light_with(&lights, Bounces::Count(1));
    let before = shown(&frame);
    for faulty in [f32::NAN, f32::INFINITY, -1.0, 2e9] {
        let inside = level.blocks[0].warp.point(DVec3::splat(0.5)).as_vec3();
        let faulty = Light::sphere(inside, 0.1, Vec3::new(1.0, faulty, 1.0));
        frame.set_lights(&[&lights[..], &[faulty]].concat());
        let report = frame.solve();
        assert_eq!(report.skipped_lights().len(), 1, "{case}");
        assert!(shown(&frame) == before, "{case}");
    }
}

#[test]
fn unkind_levels_of_all_sizes_stay_within_physics() {
    for seed in 0..60u64 {
        let mut random = Random(seed);
        // Between 1 and 200, mostly small.
        let blocks = 200f64.powf(random.unit()) as usize;
        let level = random_level(&mut random, blocks);
        stress(seed, &level);
    }
    let mut random = Random(500);
    let mut level = maze(500, Vec3::ONE, 3);
    furnish(&mut random, &mut level);
    stress(500, &level);
}

/// Frames with a light that moves, three lights that stay, and a light of 1e6 W/sr that goes on and off.
struct LongRun {
    scene: Scene,
    random: Random,
    lights: Vec<Light>,
    frame: u32,
}

impl LongRun {
    const FRAMES: u32 = 100_000;
    const ALBEDO: f32 = 0.8;

    fn new() -> Self {
        let level = floor_plan(&[[0, 0], [1, 0], [2, 0], [2, 1]], Self::ALBEDO);
        let lamp =
            |x: f32, z: f32| Light::sphere(Vec3::new(x, 0.6, z), 0.3, Vec3::new(1.0, 0.5, 2.0));
        Self {
            scene: mobile(&level),
            random: Random(1),
            lights: vec![
                lamp(0.5, 0.5),
                lamp(0.3, 0.4),
                lamp(1.5, 0.7),
                lamp(2.5, 1.4),
            ],
            frame: 0,
        }
    }

    fn step(&mut self) {
        self.frame += 1;
        let mut place = || 0.1 + 0.8 * self.random.unit() as f32;
        let at = Vec3::new(2.0 * place(), place(), place());
        self.lights[0] = Light::sphere(at, 0.2, Vec3::new(1.0, 3.0, 0.5));
        match self.frame % 100 {
            20 => {
                let bright = Light::sphere(Vec3::new(2.5, 0.5, 0.5), 0.1, Vec3::splat(1e6));
                self.lights.push(bright);
            }
            30 => self.lights.truncate(4),
            _ => {}
        }
    }
}

#[test]
fn a_hundred_thousand_frames_do_not_drift() {
    let mut run = LongRun::new();
    let mut frame = Frame::new(&run.scene, FrameConfig::default());
    let mut feedback = Frame::new(&run.scene, FrameConfig::default());
    let mut forgetful = Frame::new(&run.scene, FrameConfig::default());
    let allocated = measure(|| {
        while run.frame < LongRun::FRAMES {
            if run.lights.len() == 4 && run.lights.capacity() == 4 {
                run.lights.reserve(1);
            }
            run.step();
            frame.light_with(&run.lights, Bounces::Count(1));
            if run.frame.is_multiple_of(4) {
                feedback.light_with(&run.lights, Bounces::Feedback);
                forgetful.forget();
                forgetful.light_with(&run.lights, Bounces::Feedback);
            }
        }
    });
    // The list of lights grows once.
    assert!(allocated.count_total <= 1, "{allocated:?}");
    let fresh = solved(&run.scene, &run.lights, Bounces::Count(1));
    assert_eq!(difference(&frame, &fresh), None);
    assert_eq!(difference(&feedback, &forgetful), None);
}

/// Errors do not add up over frames, since bounces never enlarge them.
#[test]
fn a_tolerance_changes_light_by_no_more_than_stated() {
    let a = LongRun::ALBEDO;
    let of_all = (1.0 + a) / (1.0 - a);
    for (bounces, passed_on) in [(Bounces::Count(1), 1.0 + a), (Bounces::Feedback, of_all)] {
        for tolerance in [1e-3, 0.1, 10.0] {
            let mut run = LongRun::new();
            let config = FrameConfig {
                tolerance,
                ..FrameConfig::default()
            };
            let mut frame = Frame::new(&run.scene, config);
            let mut exact = Frame::new(&run.scene, FrameConfig::default());
            let mut worst = 0.0f32;
            let mut work = [FrameWork::default(); 2];
            for _ in 0..3000 {
                run.step();
                frame.light_with(&run.lights, bounces);
                exact.light_with(&run.lights, bounces);
                for (sum, frame) in work.iter_mut().zip([&frame, &exact]) {
                    sum.sources += frame.work().sources;
                    sum.targets += frame.work().targets;
                    sum.kept += frame.work().kept;
                }
                let (found, expected) = (frame.indirect(), exact.indirect());
                let peak = expected.iter().fold(0.0f32, |m, &x| m.max(x));
                let apart = largest_apart(&found, &expected) - 1e-6 * peak;
                worst = worst.max(apart);
            }
            let stated = tolerance * passed_on;
            println!("{bounces:?} {tolerance}: {worst:.2e} of {stated:.2e}, {work:?}");
            assert!(
                worst <= stated,
                "{bounces:?} {tolerance}: {worst} of {stated}"
            );
        }
    }
}

#[test]
fn work_follows_lit_and_changed_blocks() {
    let level = maze(2000, Vec3::splat(0.5), 9);
    let scene = mobile(&level);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let dark = FrameWork::default();
    let lamp = |x: f32| Light::sphere(Vec3::new(20.0 + x, 0.5, 20.5), 0.2, Vec3::ONE);
    let lit = |frame: &Frame| {
        let direct = frame.direct();
        let is_lit = |texels: &Range<usize>| {
            direct[3 * texels.start..3 * texels.end]
                .iter()
                .any(|&e| e > 0.0)
        };
        let blocks = scene.level.blocks.iter();
        blocks.filter(|block| is_lit(&block.texels)).count()
    };
    frame.light_with(&[], Bounces::Count(1));
    assert_eq!(frame.work(), dark);
    frame.light_with(&[lamp(0.5)], Bounces::Count(1));
    let (first, lit_blocks) = (frame.work(), lit(&frame));
    println!("{lit_blocks} blocks lit: {first:?}");
    assert!((1..=30).contains(&lit_blocks));
    assert_eq!(first.sources, lit_blocks);
    // A beam may enter a block and miss all of its texels.
    assert!(first.direct <= 2 * lit_blocks, "{first:?}");
    // From these blocks, light crosses at most eight openings.
    assert!(first.targets < 300, "{first:?}");
    frame.light_with(&[lamp(0.5)], Bounces::Count(1));
    assert_eq!(frame.work(), dark, "nothing changed");
    frame.light_with(&[lamp(0.55)], Bounces::Count(1));
    assert!(frame.work().direct <= 3 * lit_blocks, "{:?}", frame.work());
    frame.light_with(&[], Bounces::Count(1));
    assert!(frame.work().targets < 300, "{:?}", frame.work());
    frame.light_with(&[], Bounces::Count(1));
    assert_eq!(frame.work(), dark);
    // With a tolerance, feedback comes to rest once changes are small. Without a tolerance, rounding keeps it in motion.
    let config = FrameConfig {
        tolerance: 1e-5,
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    let mut rest = None;
    for k in 0..100 {
        frame.light_with(&[lamp(0.5)], Bounces::Feedback);
        if frame.work() == dark {
            rest = rest.or(Some(k));
        } else {
            assert_eq!(rest, None, "frame {k}");
        }
    }
    println!("feedback is at rest after {rest:?} frames");
    assert!(rest.is_some());
}
