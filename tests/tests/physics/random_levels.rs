//! Random levels: light stays finite, never multiplies, and converges over many bounces.

use glam::Vec3;
use mrt_runtime::{Bounces, Frame, Level, Light};
use mrt_tests::{
    Flux, FrameForTests, Random, add_doors, add_panel, assembled, floor_plan, random_cells,
    random_position, solved, texel_areas,
};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// What a random level is made from.
#[derive(Clone, Debug)]
struct Recipe {
    seed: u64,
    cells: usize,
    /// Share of the openings between neighbours that are not connected.
    unconnected: f64,
    /// Share of the connections that have a door.
    doors: f64,
    /// Probability of a face that shines.
    panels: f64,
    largest_albedo: f32,
    lights: usize,
    light_radius: f32,
}

fn recipe() -> impl Strategy<Value = Recipe> {
    let albedo = prop_oneof![Just(0.99f32), 0.0f32..0.99];
    let light_radius = prop_oneof![Just(0.0f32), Just(0.1f32)];
    (
        any::<u64>(),
        1usize..=40,
        0.0..0.4,
        (0.0..0.5, 0.0..1.0),
        albedo,
        1usize..=4,
        light_radius,
    )
        .prop_map(
            |(seed, cells, unconnected, (doors, panels), largest_albedo, lights, light_radius)| {
                Recipe {
                    seed,
                    cells,
                    unconnected,
                    doors,
                    panels,
                    largest_albedo,
                    lights,
                    light_radius,
                }
            },
        )
}

fn level(recipe: &Recipe, random: &mut Random) -> Level {
    let mut level = floor_plan(&random_cells(random, recipe.cells), 0.0);
    for block in &mut level.blocks {
        for albedo in &mut block.albedo {
            // The third power is often near 0. So many walls are nearly as bright as the brightest, and some are dark.
            let mut value = || (1.0 - random.unit().powi(3)) as f32 * recipe.largest_albedo;
            *albedo = Vec3::new(value(), value(), value());
        }
    }
    level
        .connections
        .retain(|_| random.unit() >= recipe.unconnected);
    add_doors(random, &mut level, recipe.doors);
    add_panel(random, &mut level, recipe.panels);
    level
}

/// Lights in random blocks, at least 1e-3 from the nearest wall.
fn lights(recipe: &Recipe, level: &Level, random: &mut Random) -> Vec<Light> {
    (0..recipe.lights)
        .map(|_| {
            let position = random_position(random, level, 1e-3);
            let intensity = Vec3::new(1.0, 0.5, 2.0) * (0.1 + random.unit() as f32);
            Light::sphere(position, recipe.light_radius, intensity)
        })
        .collect()
}

/// Largest excess of the flux of a bounce over the flux that the walls reflected and emitted, relative. Frames scale down any
/// excess above 5 %, up to rounding.
const GAIN: f64 = 0.0501;

fn is_sound(irradiance: &[f32]) -> bool {
    irradiance.iter().all(|e| e.is_finite() && *e >= 0.0)
}

/// Checks the flux of one bounce. Returns the largest ratio of arrived to sent light.
fn check_one_bounce(frame: &Frame, flux: &Flux) -> Result<f64, TestCaseError> {
    prop_assert!(is_sound(&frame.indirect()));
    let (reflected, emitted) = (flux.reflected(&frame.direct()), flux.emitted());
    let arrived = flux.arrived(&frame.indirect());
    let mut gain = 0.0f64;
    for c in 0..3 {
        let (sent, arrived) = (reflected[c] + emitted[c], arrived[c]);
        gain = gain.max(arrived / sent.max(1e-30));
        prop_assert!(arrived <= sent * (1.0 + GAIN), "{} of {}", arrived, sent);
    }
    Ok(gain)
}

/// Checks the flux of all bounces between walls with this largest albedo. Returns the largest share of the bound.
fn check_all_bounces(frame: &Frame, flux: &Flux, albedo: f64) -> Result<f64, TestCaseError> {
    prop_assert!(is_sound(&frame.indirect()));
    let (injected, emitted) = (flux.arrived(&frame.direct()), flux.emitted());
    let [direct, indirect] =
        [frame.direct(), frame.indirect()].map(|signal| flux.reflected(&signal));
    let mut share = 0.0f64;
    for c in 0..3 {
        // At most: reflected = albedo * (injected + emitted + reflected).
        let bound = (injected[c] * albedo + emitted[c] * albedo) / (1.0 - albedo);
        let reflected = direct[c] + indirect[c];
        share = share.max(reflected / bound.max(1e-30));
        prop_assert!(
            reflected <= bound * (1.0 + GAIN),
            "{} of {}",
            reflected,
            bound
        );
    }
    Ok(share)
}

proptest! {
    #![proptest_config(Config {
        cases: 60,
        rng_seed: RngSeed::Fixed(2011),
        failure_persistence: None,
        ..Config::default()
    })]

    #[test]
    fn light_in_random_levels_is_finite_and_never_multiplies(recipe in recipe()) {
        let mut random = Random(recipe.seed);
        let level = level(&recipe, &mut random);
        let lights = lights(&recipe, &level, &mut random);
        let scene = assembled(&level);

        let single = solved(&scene, &lights, Bounces::Count(1));
        let flux = Flux::new(&single, texel_areas(&scene));
        let gain = check_one_bounce(&single, &flux)?;

        let limit = 3000;
        let all = solved(&scene, &lights, Bounces::Converged { tolerance: 1e-3, limit });
        let passes = all.last_report().passes();
        prop_assert!(passes < limit, "still changing after {} passes", passes);
        let albedo = f64::from(recipe.largest_albedo);
        let share = check_all_bounces(&all, &flux, albedo)?;
        println!(
            "radius {} {} cells, albedo {:.2}: one bounce x {:.4}, all bounces {:.3} of the bound, {} passes",
            recipe.light_radius, level.blocks.len(), albedo, gain, share, passes
        );
    }
}
