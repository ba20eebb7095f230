//! Large and unkind levels, long runs, and what frames cost by what is lit.

use allocation_counter::measure;
use glam::{DVec3, Vec3};
use mrt_runtime::BlockIndex;
use mrt_runtime::blocks::maze;
use mrt_runtime::low_level::modular::frame::report::FrameWork;
use mrt_runtime::{Bounces, Frame, FrameConfig, Level, Light, Scene};
use mrt_tests::FrameForTests;
use mrt_tests::normal_of;
use mrt_tests::position_of;
use mrt_tests::sequences::{
    difference, furnish, mobile, random_intensity, random_level, random_lights, shown,
};
use mrt_tests::{Random, by_texel, sphere};

/// A bounce may carry this much more flux than left the walls as direct light: frames scale down what is above
/// (`SPOT_GAIN`), and rounding is left.
const GAIN: f64 = 0.0501;

/// Flux over all texels, those of canonical blocks: what frames hold down.
fn flux(frame: &Frame, signal: &[f32], reflected: bool) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let scene = frame.scene();
    let albedo = texels(scene).map(|(block, texel)| frame.texel_albedo(block, texel));
    for (albedo, e) in albedo.zip(by_texel(scene, signal)) {
        let factor = albedo.filter(|_| reflected).unwrap_or(Vec3::ONE);
        for (c, sum) in sum.iter_mut().enumerate() {
            *sum += f64::from(factor[c]) * f64::from(e[c]);
        }
    }
    sum
}

/// All texels of a scene, block by block.
fn texels(scene: &Scene) -> impl Iterator<Item = (BlockIndex, usize)> {
    let blocks = scene.level.blocks.iter().enumerate();
    blocks.flat_map(|(block, placed)| {
        (0..placed.texels.len()).map(move |texel| (BlockIndex::new(block), texel))
    })
}

fn emitted(frame: &Frame) -> [f64; 3] {
    texels(frame.scene()).fold([0.0; 3], |sum, (block, texel)| {
        let e = frame.texel_emission(block, texel).expect("a texel");
        std::array::from_fn(|c| sum[c] + f64::from(e[c]))
    })
}

/// Lights as they come, one exactly on a texel, one a hair off a wall, all of up to 1e6 W/sr.
fn unkind_lights(random: &mut Random, level: &Level, scene: &Scene) -> Vec<Light> {
    let count = random.below(9);
    let mut lights = random_lights(random, level, scene, count);
    let texel = random.below(scene.texel_count());
    let on = position_of(scene, texel);
    lights.push(sphere(on, 0.0, random_intensity(random)));
    for distance in [1e-6, 1e-4, 1e-2] {
        let near = on + distance * normal_of(scene, texel);
        lights.push(sphere(near, 0.0, random_intensity(random)));
    }
    // A wall's texel may lie outside by rounding.
    lights
        .retain(|light| mrt_runtime::low_level::light::placed::place(&scene.level, *light).is_ok());
    lights
}

/// Checks one level: everything finite and not negative, no bounce with more flux than left, faulty lights skipped.
fn stress(seed: u64, level: &Level) {
    let mut random = Random(seed);
    let scene = mobile(level);
    let lights = unkind_lights(&mut random, level, &scene);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let emitted = emitted(&frame);
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
        let before = frame.indirect();
        frame.light_with(&lights, bounces);
        for (name, values) in shown(&frame) {
            let sound = |&bits: &u32| {
                let x = f32::from_bits(bits);
                x.is_finite() && (x >= 0.0 || name == "coefficients")
            };
            assert!(values.iter().all(sound), "{name}, seed {seed}, {bounces:?}");
        }
        // What arrived of what left: of direct light, and in feedback of the light before.
        let mut sent = flux(&frame, &frame.direct(), true);
        for c in 0..3 {
            sent[c] = (sent[c] + emitted[c]) * (1.0 + GAIN);
        }
        let arrived = flux(&frame, &frame.indirect(), false);
        let reflected = match bounces {
            Bounces::Feedback => flux(&frame, &before, true),
            _ => [0.0; 3],
        };
        if matches!(bounces, Bounces::Count(1) | Bounces::Feedback) {
            for c in 0..3 {
                let bound = sent[c] + reflected[c] * (1.0 + ROUNDING);
                assert!(
                    arrived[c] <= bound,
                    "{} of {bound}, seed {seed}, {bounces:?}",
                    arrived[c]
                );
            }
        } else {
            // With a the largest albedo, bounces shrink as its powers: 0.99.
            for c in 0..3 {
                assert!(
                    arrived[c] <= 100.0 * sent[c] * (1.0 + ROUNDING),
                    "seed {seed}"
                );
            }
        }
    }
    frame.light_with(&lights, Bounces::Count(1));
    let before = shown(&frame);
    for faulty in [f32::NAN, f32::INFINITY, -1.0, 2e9] {
        let intensity = Vec3::new(1.0, faulty, 1.0);
        let inside = level.blocks[0].warp.point(DVec3::splat(0.5)).as_vec3();
        let lights: Vec<Light> = lights
            .iter()
            .copied()
            .chain([sphere(inside, 0.1, intensity)])
            .collect();
        frame.set_lights(&lights);
        let report = frame.solve();
        assert_eq!(report.skipped_lights().len(), 1, "seed {seed}");
        assert!(shown(&frame) == before, "seed {seed}");
    }
}

/// Sums of `f32` over a block.
const ROUNDING: f64 = 1e-5;

#[test]
fn unkind_levels_of_all_sizes_stay_within_physics() {
    for seed in 0..60u64 {
        let mut random = Random(seed);
        // From 1 to 200, small ones more often.
        let blocks = 200f64.powf(random.unit()) as usize;
        let level = random_level(&mut random, blocks);
        stress(seed, &level);
    }
    let mut random = Random(500);
    let mut level = maze(500, Vec3::ONE, 3);
    furnish(&mut random, &mut level);
    stress(500, &level);
}

/// 100,000 frames of one light that moves among three that stay, and one of 1e6 W/sr that goes on and off.
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
        let cells = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1]];
        let level = Level::from_cells(&cells, Vec3::splat(Self::ALBEDO)).expect("cells");
        let lamp = |x: f32, z: f32| sphere(Vec3::new(x, 0.6, z), 0.3, Vec3::new(1.0, 0.5, 2.0));
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
        self.lights[0] = sphere(at, 0.2, Vec3::new(1.0, 3.0, 0.5));
        match self.frame % 100 {
            20 => {
                let bright = sphere(Vec3::new(2.5, 0.5, 0.5), 0.1, Vec3::splat(1e6));
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
    let mut fresh = Frame::new(&run.scene, FrameConfig::default());
    fresh.light_with(&run.lights, Bounces::Count(1));
    assert_eq!(difference(&frame, &fresh), None);
    assert_eq!(difference(&feedback, &forgetful), None);
}

/// Largest difference between two signals.
fn largest_apart(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

/// With a tolerance, light errs by what [`FrameConfig::tolerance`] states, at any time: bounces pass errors on no larger
/// than they were.
#[test]
fn a_tolerance_errs_by_what_is_stated() {
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
                    sum.sources += frame.last_report().work().sources;
                    sum.targets += frame.last_report().work().targets;
                    sum.kept += frame.last_report().work().kept;
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
fn cost_follows_what_is_lit() {
    let level = maze(2000, Vec3::splat(0.5), 9);
    let scene = mobile(&level);
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let dark = FrameWork::default();
    let lamp = |x: f32| sphere(Vec3::new(20.0 + x, 0.5, 20.5), 0.2, Vec3::ONE);
    let lit = |frame: &Frame| {
        let direct = frame.direct();
        let is_lit = |texels: &std::ops::Range<usize>| {
            direct[3 * texels.start..3 * texels.end]
                .iter()
                .any(|&e| e > 0.0)
        };
        let blocks = scene.level.blocks.iter();
        blocks.filter(|block| is_lit(&block.texels)).count()
    };
    frame.light_with(&[], Bounces::Count(1));
    assert_eq!(frame.last_report().work(), dark);
    frame.light_with(&[lamp(0.5)], Bounces::Count(1));
    let (first, lit_blocks) = (frame.last_report().work(), lit(&frame));
    println!("{lit_blocks} blocks lit: {first:?}");
    assert!((1..=30).contains(&lit_blocks));
    assert_eq!(first.sources, lit_blocks);
    // Beams may enter blocks in which they meet no texel.
    assert!(first.direct <= 2 * lit_blocks, "{first:?}");
    // Light crosses at most eight openings from there.
    assert!(first.targets < 300, "{first:?}");
    frame.light_with(&[lamp(0.5)], Bounces::Count(1));
    assert_eq!(frame.last_report().work(), dark, "nothing changed");
    frame.light_with(&[lamp(0.55)], Bounces::Count(1));
    assert!(
        frame.last_report().work().direct <= 3 * lit_blocks,
        "{:?}",
        frame.last_report().work()
    );
    frame.light_with(&[], Bounces::Count(1));
    assert!(
        frame.last_report().work().targets < 300,
        "{:?}",
        frame.last_report().work()
    );
    frame.light_with(&[], Bounces::Count(1));
    assert_eq!(frame.last_report().work(), dark);
    // Feedback comes to rest, and stays so, once changes are small; without a tolerance rounding keeps it awake.
    let config = FrameConfig {
        tolerance: 1e-5,
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    let mut rest = None;
    for k in 0..100 {
        frame.light_with(&[lamp(0.5)], Bounces::Feedback);
        if frame.last_report().work() == dark {
            rest = rest.or(Some(k));
        } else {
            assert_eq!(rest, None, "frame {k}");
        }
    }
    println!("feedback is at rest after {rest:?} frames");
    assert!(rest.is_some());
}
