//! A bake gives the same bytes for the same settings, on any number of threads, or no bytes when it is cancelled.

use mrt_core::storage::Storage;
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_tests::{DEFAULT_BYTES, bake_of, changed, set_lightfields, with_threads};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Settings of a bake that takes a second and has all stages.
fn small() -> BakeConfig {
    changed("mobile", "cubes-2d", |config| {
        config.resolution = 4;
        config.modes = 10;
        config.prior.lights_per_axis = 3;
        config.coupling.emission_modes = 12;
        config.coupling.response_modes = 8;
        config.coupling.foreign_modes = 4;
        config.coupling.depth = 2;
        set_lightfields(config, 4, 8, 24);
    })
}

fn bytes(config: &BakeConfig) -> Vec<u8> {
    bake_of(config).to_bytes().expect("six shapes fit a file")
}

#[test]
fn the_committed_dictionary_is_what_the_bake_gives() {
    let config = BakeConfig::preset("standard").expect("a preset");
    // The committed file is stored in half precision, which changes light by less than 0.03 %.
    let baked = bake_of(&config)
        .stored_as(Storage::F16)
        .to_bytes()
        .expect("six shapes fit a file");
    // Only the first difference is printed, not megabytes of bytes.
    let first = baked.iter().zip(DEFAULT_BYTES).position(|(a, b)| a != b);
    assert_eq!((baked.len(), first), (DEFAULT_BYTES.len(), None));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let on = |threads| with_threads(threads, || bytes(&small()));
    let one = on(1);
    assert!(on(3) == one, "three threads gave other bytes than one");
    assert!(on(7) == one, "seven threads gave other bytes than one");
}

#[test]
fn a_setting_that_changes_the_operators_changes_the_bytes() {
    let mut other = small();
    other.prior.light_radius *= 1.5;
    assert!(bytes(&other) != bytes(&small()));
}

#[test]
fn a_bake_can_be_cancelled_at_every_step() {
    let config = small();
    let steps = AtomicUsize::new(0);
    let count = |_: &str, _: usize, _: usize| {
        steps.fetch_add(1, Ordering::Relaxed);
    };
    bake(&config, &Progress::new(&count, &AtomicBool::new(false))).expect("nobody cancels");
    let steps = steps.into_inner();
    assert!(steps > 5, "{steps}");
    for last in 0..steps - 1 {
        let cancel = AtomicBool::new(false);
        let seen = AtomicUsize::new(0);
        let report = |_: &str, _: usize, _: usize| {
            if seen.fetch_add(1, Ordering::Relaxed) == last {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let result = bake(&config, &Progress::new(&report, &cancel));
        assert_eq!(result.err(), Some(Cancelled), "cancelled in step {last}");
        assert_eq!(
            seen.load(Ordering::Relaxed),
            last + 1,
            "no step after {last}"
        );
    }
}

#[test]
fn a_bake_cancelled_before_it_starts_does_nothing() {
    let cancel = AtomicBool::new(true);
    let report = |what: &str, _: usize, _: usize| panic!("step {what} was started");
    let result = bake(&small(), &Progress::new(&report, &cancel));
    assert_eq!(result.err(), Some(Cancelled));
}
