use super::*;

/// An answer that is wrong by a smooth factor which differs from place to place.
fn wrong(reference: &Reference) -> Vec<[f64; 3]> {
    let wave = |r: &Receiver| 1.0 + 0.05 * (3.0 * r.position.x + 2.0 * r.position.z).sin();
    let pairs = reference.irradiance.iter().zip(&reference.receivers);
    pairs.map(|(e, r)| e.map(|e| e * wave(r))).collect()
}

#[test]
fn a_sample_estimates_the_error_over_all_texels() {
    let setting = Setting::new(11, None);
    let lights = setting.spheres();
    let solve = |receivers| {
        Plan::new(&setting.level, &lights, 6, receivers)
            .solve(&lights)
            .expect("mazes can be solved")
    };
    let (all, some) = (solve(usize::MAX), solve(400));
    assert_eq!(all.receivers.len(), 46 * 36);
    assert!(some.receivers.len() < all.receivers.len() / 2);
    let count: f64 = some.receivers.iter().map(|r| r.weight).sum();
    assert_eq!(count, all.receivers.len() as f64);
    let [exact, estimate] = [&all, &some].map(|r| r.rel_l2(&wrong(r)));
    assert!(
        (estimate / exact - 1.0).abs() < 0.05,
        "{estimate} for {exact}"
    );
}

#[test]
fn a_window_shows_what_the_whole_level_shows() {
    let setting = Setting::new(30, Some(2));
    let lights = setting.spheres();
    let mut plan = Plan::new(&setting.level, &lights, 4, 300);
    plan.windows = plan.windows(&lights, 300);
    assert!(plan.windows.len() > 10);
    let parts = plan.solve(&lights).expect("windows can be solved");
    plan.windows = vec![Window {
        blocks: (0..30).collect(),
        senders: (0..30).collect(),
        receivers: parts.receivers.clone(),
    }];
    let whole = plan.solve(&lights).expect("mazes can be solved");
    let found = whole.rel_l2(&parts.irradiance);
    // What crosses more than six openings between lamp and wall is left out.
    assert!(found < 1e-3, "{found}");
}
