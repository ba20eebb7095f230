use super::super::frame_variant::{FrameVariant, Packing};
use super::super::timed_frame::TimedFrame;
use super::window::Window;
use super::*;
use mrt_core::simd::SimdLevel;
use mrt_editor::cli::dictionary_source::from_file;
use mrt_runtime::{Coupling, Dictionary};

fn mobile() -> Dictionary {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/versions/2.mrt");
    from_file(Path::new(file)).expect("the file of this version is read")
}

fn solve(plan: &Plan) -> ExactLight {
    let irradiance = plan.solve(&Progress::silent());
    ExactLight {
        texels: plan.texels(),
        irradiance: irradiance.expect("mazes can be solved"),
    }
}

/// The error of a frame over all texels, and as estimated from a sample of them.
fn errors(dictionary: &Dictionary, sample: usize) -> [f64; 2] {
    let maze = LitMaze::new(11, None);
    let variant = FrameVariant {
        preset: "any",
        dictionary,
        storage: Packing::F32,
        coupling: Coupling::Table,
        simd: SimdLevel::detect(),
        threads: 1,
    };
    let frame = TimedFrame::new(&maze, &variant).expect("a maze is a level");
    [usize::MAX, sample].map(|count| {
        let exact = solve(&Plan::new(&maze, dictionary.resolution, count));
        let all: f64 = exact.texels.iter().map(|texel| texel.weight).sum();
        assert_eq!(all, frame.scene.texel_count() as f64);
        exact.rel_l2(&frame.irradiance(&exact.texels))
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
fn a_window_has_the_light_of_the_whole_level() {
    let maze = LitMaze::new(30, Some(2));
    let mut plan = Plan::new(&maze, 4, 300);
    plan.windows = plan.windows(300);
    assert!(plan.windows.len() > 10);
    let parts = solve(&plan);
    plan.windows = vec![Window {
        blocks: (0..30).collect(),
        senders: (0..30).collect(),
        texels: parts.texels.clone(),
    }];
    let found = solve(&plan).rel_l2(&parts.irradiance);
    // Windows leave out light that crosses more than six openings between lamp and wall.
    assert!(found < 1e-3, "{found}");
}

#[test]
fn finer_walls_change_little() {
    let maze = LitMaze::new(2, None);
    let mut plan = Plan::new(&maze, 16, 120);
    let kept = solve(&plan);
    plan.problem.fine = 80;
    let found = solve(&plan).rel_l2(&kept.irradiance);
    assert!(found < 5e-4, "{found}");
}
