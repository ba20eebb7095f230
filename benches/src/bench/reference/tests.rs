use super::super::ours::{Ours, Packing, Variant};
use super::*;
use mrt_core::simd::SimdLevel;
use mrt_editor::cli::dictionary_source::from_file;
use mrt_runtime::{Coupling, Dictionary};

fn mobile() -> Dictionary {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/versions/2.mrt");
    from_file(Path::new(file)).expect("the file of this version is read")
}

/// The error of a frame over all texels, and as estimated from a sample of them.
fn errors(dictionary: &Dictionary, sample: usize) -> [f64; 2] {
    let setting = Setting::new(11, None);
    let lights = setting.spheres();
    let variant = Variant {
        preset: "any",
        dictionary,
        storage: Packing::F32,
        coupling: Coupling::Table,
        simd: SimdLevel::detect(),
        threads: 1,
    };
    let ours = Ours::new(&setting, &variant).expect("a maze is a level");
    [usize::MAX, sample].map(|receivers| {
        let plan = Plan::new(&setting.level, &lights, dictionary.resolution, receivers);
        let reference = plan
            .solve(&lights, &Progress::silent())
            .expect("mazes can be solved");
        let count: f64 = reference.receivers.iter().map(|r| r.weight).sum();
        assert_eq!(count, ours.scene.texel_count() as f64);
        reference.rel_l2(&ours.irradiance(&reference.receivers))
    })
}

#[test]
fn a_sample_estimates_the_error_over_all_texels() {
    let [whole, estimate] = errors(&mobile(), 500);
    assert!(
        (estimate / whole - 1.0).abs() < 0.05,
        "{estimate} for {whole}"
    );
}

#[test]
fn a_window_shows_what_the_whole_level_shows() {
    let setting = Setting::new(30, Some(2));
    let lights = setting.spheres();
    let mut plan = Plan::new(&setting.level, &lights, 4, 300);
    plan.windows = plan.windows(&lights, 300);
    assert!(plan.windows.len() > 10);
    let parts = plan
        .solve(&lights, &Progress::silent())
        .expect("windows can be solved");
    plan.windows = vec![Window {
        blocks: (0..30).collect(),
        senders: (0..30).collect(),
        receivers: parts.receivers.clone(),
    }];
    let whole = plan
        .solve(&lights, &Progress::silent())
        .expect("mazes can be solved");
    let found = whole.rel_l2(&parts.irradiance);
    // What crosses more than six openings between lamp and wall is left out.
    assert!(found < 1e-3, "{found}");
}

#[test]
fn finer_walls_change_little() {
    let setting = Setting::new(2, None);
    let lights = setting.spheres();
    let mut plan = Plan::new(&setting.level, &lights, 16, 120);
    let kept = plan
        .solve(&lights, &Progress::silent())
        .expect("mazes can be solved");
    plan.fine = 80;
    let finer = plan
        .solve(&lights, &Progress::silent())
        .expect("mazes can be solved");
    let found = finer.rel_l2(&kept.irradiance);
    assert!(found < 5e-4, "{found}");
}
