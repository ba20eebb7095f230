//! Many bounces between nearly white walls converge from below to the bound of energy.

use glam::Vec3;
use mrt_runtime::low_level::modular::frame::config::MAX_PASSES;
use mrt_runtime::{Bounces, Frame, FrameConfig, Level, Light};
use mrt_tests::{
    Flux, FrameForTests, Random, assembled, closed_floor_plans, floor_plan, random_cells, solved,
};

/// Levels of nearly white walls, by name: boxes, corridors, loops, rooms and random cells, closed and with about every fifth
/// connection missing.
fn levels() -> Vec<(String, Level)> {
    let mut random = Random(99);
    let mut plans: Vec<(String, Vec<[i32; 2]>)> = closed_floor_plans()
        .into_iter()
        .filter(|(_, cells)| cells.len() <= 9)
        .map(|(name, cells)| (name.to_owned(), cells))
        .collect();
    plans.extend((0..3).map(|k| (format!("random {k}"), random_cells(&mut random, 5 + 3 * k))));
    let mut levels = Vec::new();
    for (name, cells) in plans {
        let closed = floor_plan(&cells, 0.99);
        let mut open = closed.clone();
        open.connections.retain(|_| random.below(5) > 0);
        if open.connections.len() < closed.connections.len() {
            levels.push((format!("{name}, open"), open));
        }
        levels.push((name, closed));
    }
    levels
}

fn lamp() -> Light {
    Light::sphere(Vec3::new(0.3, 0.6, 0.4), 0.1, Vec3::new(1.0, 0.5, 2.0))
}

/// Largest relative gain of direct light that frames allow, for the difference between centres of texels and whole walls.
const SPOT_GAIN: f64 = 0.05;

/// Relative error of a sum of some thousand `f32` texels that have converged to 1e-6 of the brightest.
const FLUX_ROUNDING: f64 = 1e-4;

#[test]
fn bounces_between_nearly_white_walls_converge_below_the_bound_of_energy() {
    let albedo = f64::from(0.99f32);
    for (name, level) in levels() {
        let scene = assembled(&level);
        let bounces = Bounces::Converged {
            tolerance: 1e-6,
            limit: MAX_PASSES,
        };
        let frame = solved(&scene, &[lamp()], bounces);
        let passes = frame.last_report().passes();
        assert!(passes < MAX_PASSES, "{name}: {passes}");
        let flux = Flux::unweighted(&frame);
        let direct = flux.arrived(&frame.direct());
        let indirect = flux.arrived(&frame.indirect());
        let mut share = 0.0f64;
        for channel in 0..3 {
            let sent = direct[channel] * albedo;
            let bound = sent * (1.0 + SPOT_GAIN) / (1.0 - albedo);
            share = share.max(indirect[channel] / bound);
        }
        println!("{name}: {passes} passes, {share:.4} of the bound");
        assert!(share <= 1.0 + FLUX_ROUNDING, "{name}: {share}");
    }
}

#[test]
fn every_bounce_adds_light_and_never_more_than_the_one_before() {
    for (name, level) in levels() {
        let scene = assembled(&level);
        let mut frame = Frame::new(&scene, FrameConfig::default());
        let flux = Flux::unweighted(&frame);
        let (mut before, mut last) = (0.0, f64::MAX);
        for pass in 0..40 {
            // Feedback is one pass on the light of the frame before, so these are the iterates of `Converged`.
            frame.light_with(&[lamp()], Bounces::Feedback);
            let [now, ..] = flux.arrived(&frame.indirect());
            let added = now - before;
            let rounding = FLUX_ROUNDING * now;
            assert!(added >= -rounding, "{name}, pass {pass}: {added} of {now}");
            assert!(
                added <= last + rounding,
                "{name}, pass {pass}: {added} after {last}"
            );
            (before, last) = (now, added);
        }
    }
}

#[test]
fn walls_that_absorb_nothing_create_no_light() {
    for cells in [vec![[0, 0]], vec![[0, 0], [1, 0], [1, 1]]] {
        let mut level = floor_plan(&cells, 1.0);
        for (mixed, name) in [(false, "white"), (true, "one wall darker")] {
            if mixed {
                level.blocks[0].albedo[2] = Vec3::new(1.0, 0.9, 0.5);
            }
            let scene = assembled(&level);
            let bounces = Bounces::Converged {
                tolerance: 0.0,
                limit: MAX_PASSES,
            };
            let frame = solved(&scene, &[lamp()], bounces);
            let passes = f64::from(frame.last_report().passes());
            let flux = Flux::unweighted(&frame);
            let direct = flux.arrived(&frame.direct());
            let indirect = flux.arrived(&frame.indirect());
            for channel in 0..3 {
                // No bounce brings more than the direct light.
                let bound = passes * (direct[channel] * (1.0 + SPOT_GAIN));
                let found = indirect[channel];
                println!(
                    "{} cells, {name}, channel {channel}: {:.4}",
                    cells.len(),
                    found / bound
                );
                assert!(found.is_finite() && found <= bound * (1.0 + FLUX_ROUNDING));
            }
        }
    }
}
