//! Many bounces between nearly white walls: they converge, from below, to what energy allows.

use glam::Vec3;
use mrt_runtime::FrameConfig;
use mrt_runtime::low_level::modular::frame::config::MAX_PASSES;
use mrt_runtime::{Bounces, Frame, Level, Light, Scene};
use mrt_tests::FrameForTests;
use mrt_tests::{
    Random, assembled, by_texel, closed_floor_plans, floor_plan, random_cells, solved, sphere,
};

/// Sums over texels; blocks are unit cubes, so all texels have the same area.
fn flux(scene: &Scene, signal: &[f32], channel: usize) -> f64 {
    by_texel(scene, signal)
        .iter()
        .map(|e| f64::from(e[channel]))
        .sum()
}

/// Levels of nearly white walls by name, with a light in the first cell: boxes, corridors, loops, open rooms and
/// heaps of random cells, closed and with every fifth connection missing.
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
    sphere(Vec3::new(0.3, 0.6, 0.4), 0.1, Vec3::new(1.0, 0.5, 2.0))
}

/// What frames let direct light gain, for the difference between texel centres and walls.
const SPOT_GAIN: f64 = 0.05;

/// Texels are read in `f32`; a sum of some thousand of them, converged to 1e-6 of the brightest, is good to this.
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
        assert!(
            frame.last_report().passes() < MAX_PASSES,
            "{name}: {}",
            frame.last_report().passes()
        );
        let mut share = 0.0f64;
        for channel in 0..3 {
            let sent = flux(&scene, &frame.direct(), channel) * albedo;
            let bound = sent * (1.0 + SPOT_GAIN) / (1.0 - albedo);
            share = share.max(flux(&scene, &frame.indirect(), channel) / bound);
        }
        println!(
            "{name}: {} passes, {share:.4} of the bound",
            frame.last_report().passes()
        );
        assert!(share <= 1.0 + FLUX_ROUNDING, "{name}: {share}");
    }
}

#[test]
fn every_bounce_adds_light_and_never_more_than_the_one_before() {
    for (name, level) in levels() {
        let scene = assembled(&level);
        let mut frame = Frame::new(&scene, FrameConfig::default());
        let (mut before, mut last) = (0.0, f64::MAX);
        for pass in 0..40 {
            // A pass on the light of the frame before: the next of the iterates that `Converged` goes through.
            frame.light_with(&[lamp()], Bounces::Feedback);
            let now = flux(&scene, &frame.indirect(), 0);
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
fn walls_that_lose_nothing_gain_nothing_either() {
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
            for channel in 0..3 {
                // No bounce brings more than the direct light.
                let direct = flux(&scene, &frame.direct(), channel) * (1.0 + SPOT_GAIN);
                let bound = f64::from(frame.last_report().passes()) * direct;
                let found = flux(&scene, &frame.indirect(), channel);
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
