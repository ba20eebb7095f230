use super::*;
use glam::{DQuat, DVec2};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use std::f64::consts::TAU;

/// Coordinates turned into the plane of a polygon are rounded; areas are of the order of 1.
const ROUNDING: f64 = 1e-9;

/// One round of corners about the origin, one for each radius.
fn star(radii: &[f64]) -> Vec<DVec2> {
    let count = radii.len() as f64;
    let corner = |(k, &radius): (usize, &f64)| DVec2::from_angle(TAU * k as f64 / count) * radius;
    radii.iter().enumerate().map(corner).collect()
}

/// A bar with teeth of these heights, which are all seen from nowhere at once.
fn comb(heights: &[f64]) -> Vec<DVec2> {
    let width = heights.len() as f64;
    let mut corners = vec![DVec2::ZERO, DVec2::new(width, 0.0)];
    for (k, &height) in heights.iter().enumerate().rev() {
        let x = k as f64;
        corners.extend([
            DVec2::new(x + 1.0, 0.5),
            DVec2::new(x + 0.7, 0.5 + height),
            DVec2::new(x + 0.3, 0.5 + height),
        ]);
    }
    corners.push(DVec2::new(0.0, 0.5));
    corners
}

/// A star with a hole that is one too, as one outline with a keyhole along one ray.
fn ring(radii: &[f64], key: usize) -> Vec<DVec2> {
    let key = key % radii.len();
    let outer: Vec<f64> = radii.iter().map(|radius| 0.5 + 0.5 * radius).collect();
    let inner: Vec<f64> = radii.iter().map(|radius| 0.45 * radius).collect();
    let [mut outer, mut inner] = [star(&outer), star(&inner)];
    outer.rotate_left(key);
    inner.rotate_left(key);
    outer.push(outer[0]);
    inner.push(inner[0]);
    inner.reverse();
    outer.extend(inner);
    outer
}

/// A wall with windows of these sizes in a row, each on a keyhole from the floor.
fn windows(sizes: &[f64]) -> Vec<DVec2> {
    let mut corners = vec![DVec2::ZERO];
    for (k, &size) in sizes.iter().enumerate() {
        let x = k as f64 + 0.2;
        let sill = DVec2::new(x, 0.3);
        let foot = DVec2::new(x, 0.0);
        let across = DVec2::X * 0.6 * size;
        let up = DVec2::Y * 0.6 * size;
        corners.extend([
            foot,
            sill,
            sill + up,
            sill + up + across,
            sill + across,
            sill,
            foot,
        ]);
    }
    let width = sizes.len() as f64;
    corners.extend([DVec2::new(width, 0.0), DVec2::new(width, 1.0), DVec2::Y]);
    corners
}

/// Puts corners on the edges, `more[k]` on the k-th.
fn with_corners_on_edges(corners: &[DVec2], more: &[usize]) -> Vec<DVec2> {
    let mut all = Vec::new();
    for (k, &corner) in corners.iter().enumerate() {
        let next = corners[(k + 1) % corners.len()];
        let parts = more[k % more.len()] + 1;
        all.extend((0..parts).map(|part| corner.lerp(next, part as f64 / parts as f64)));
    }
    all
}

fn cross(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

fn area(corners: &[DVec2]) -> f64 {
    let pairs = (0..corners.len()).map(|k| (corners[k], corners[(k + 1) % corners.len()]));
    pairs.map(|(a, b)| a.perp_dot(b)).sum::<f64>() / 2.0
}

/// How often the outline goes around a point.
fn turns(corners: &[DVec2], point: DVec2) -> i32 {
    let mut turns = 0;
    for (k, &a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % corners.len()];
        let side = cross(a, b, point);
        if a.y <= point.y && b.y > point.y && side > 0.0 {
            turns += 1;
        } else if a.y > point.y && b.y <= point.y && side < 0.0 {
            turns -= 1;
        }
    }
    turns
}

fn is_near_an_edge(corners: &[DVec2], [a, b]: [usize; 2], point: DVec2) -> bool {
    let [a, b] = [corners[a], corners[b]];
    let along = (b - a) * ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    (point - a - along).length() < 1e-6 || a == b
}

/// Checks that the triangles cover the polygon once and nothing else, from whichever corner and in whichever sense the
/// outline is told.
fn check(flat: &[DVec2], start: usize, place: impl Fn(DVec2) -> DVec3, points: &[DVec2]) {
    let mut flat = flat.to_vec();
    let start = start % flat.len();
    flat.rotate_left(start);
    for _ in 0..2 {
        let corners: Vec<DVec3> = flat.iter().map(|&corner| place(corner)).collect();
        let mut cutter = Cutter::default();
        let (triangles, cut) = cutter.cut(&corners);
        assert_eq!(cut, Cut::Whole, "{flat:?}");
        let wanted = area(&flat);
        let corner = |k: u32| flat[k as usize];
        let areas = triangles
            .iter()
            .map(|&[a, b, c]| cross(corner(a), corner(b), corner(c)) / 2.0);
        let sum: f64 = areas.clone().map(f64::abs).sum();
        assert!(
            (sum - wanted.abs()).abs() < ROUNDING,
            "{sum} {wanted} {flat:?}"
        );
        assert!(
            areas.clone().all(|a| a * wanted.signum() > -ROUNDING),
            "{flat:?}"
        );
        let bounds = |f: fn(DVec2, DVec2) -> DVec2| flat.iter().copied().reduce(f);
        let [low, high] = [bounds(DVec2::min), bounds(DVec2::max)].map(Option::unwrap_or_default);
        for &point in points {
            let point = low + (high - low) * (point * 1.2 - 0.1);
            let covers = |&&[a, b, c]: &&[u32; 3]| {
                let sides =
                    [[a, b], [b, c], [c, a]].map(|[a, b]| cross(corner(a), corner(b), point));
                sides.iter().all(|&side| side * wanted.signum() > 0.0)
            };
            let is_near = triangles.iter().any(|&[a, b, c]| {
                let edges = [[a, b], [b, c], [c, a]].map(|edge| edge.map(|k| k as usize));
                edges
                    .iter()
                    .any(|&edge| is_near_an_edge(&flat, edge, point))
            });
            if !is_near {
                let found = triangles.iter().filter(covers).count() as i32;
                assert_eq!(found, turns(&flat, point).abs(), "{point} {flat:?}");
            }
        }
        flat.reverse();
    }
}

prop_compose! {
    fn any_polygon()(
        kind in 0..4,
        sizes in prop::collection::vec(0.05..1.0f64, 5..24),
        key in 0usize..24,
        more in prop::collection::vec(0usize..3, 1..8),
    ) -> Vec<DVec2> {
        let polygon = match kind {
            0 => star(&sizes),
            1 => comb(&sizes),
            2 => ring(&sizes, key),
            _ => windows(&sizes[..sizes.len().min(6)]),
        };
        with_corners_on_edges(&polygon, &more)
    }
}

prop_compose! {
    fn any_points()(
        points in prop::collection::vec([0.0..1.0f64, 0.0..1.0f64], 40)
    ) -> Vec<DVec2> {
        points.into_iter().map(DVec2::from_array).collect()
    }
}

proptest! {
    #![proptest_config(Config {
        cases: 500,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..Config::default()
    })]

    #[test]
    fn triangles_cover_the_polygon_and_nothing_else(
        flat in any_polygon(),
        start in 0usize..100,
        points in any_points(),
        axis in [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64],
        angle in 0.0..TAU,
        shift in -1000.0..1000.0f64,
    ) {
        let axis = DVec3::from_array(axis).normalize_or(DVec3::Y);
        let turn = DQuat::from_axis_angle(axis, angle);
        check(&flat, start, |p| turn * p.extend(0.0) + shift, &points);
        for up in 0..3 {
            check(&flat, start, |p| {
                let mut corner = DVec3::splat(shift.round());
                corner[(up + 1) % 3] += p.x;
                corner[(up + 2) % 3] += p.y;
                corner
            }, &points);
        }
    }

    #[test]
    fn corners_slightly_off_the_plane_change_nothing(
        flat in any_polygon(),
        start in 0usize..100,
        points in any_points(),
    ) {
        // A wave of a thousandth of the size; seen along the plane's normal, the polygon is the same.
        let off = |p: DVec2| p.extend(1e-3 * (7.0 * p.x).sin() * (5.0 * p.y).cos());
        check(&flat, start, off, &points);
    }
}

fn cut(corners: &[[f64; 3]]) -> (Vec<[u32; 3]>, Cut) {
    let corners: Vec<DVec3> = corners.iter().map(|&c| DVec3::from_array(c)).collect();
    let mut cutter = Cutter::default();
    let (triangles, cut) = cutter.cut(&corners);
    (triangles.to_vec(), cut)
}

#[test]
fn quads_are_cut_along_the_diagonal_inside_them() {
    let square = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    assert_eq!(cut(&square), (vec![[0, 1, 2], [0, 2, 3]], Cut::Whole));
    // An arrow head, its notch at each of the four corners in turn.
    let mut arrow = [
        [0.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.5, 1.0, 0.0],
    ];
    for _ in 0..4 {
        let flat: Vec<DVec2> = arrow.iter().map(|c| DVec2::new(c[0], c[1])).collect();
        check(&flat, 0, |p| p.extend(0.0), &[]);
        arrow.rotate_left(1);
    }
    // The middle of an edge as a corner: neither triangle is flat.
    let mut house = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
    ];
    for _ in 0..4 {
        let (triangles, _) = cut(&house);
        for [a, b, c] in triangles {
            let [a, b, c] = [a, b, c].map(|k| DVec3::from_array(house[k as usize]));
            assert!((b - a).cross(c - a).z > 0.5);
        }
        house.rotate_left(1);
    }
}

#[test]
fn polygons_without_area_become_as_many_triangles_without_area() {
    let line: Vec<[f64; 3]> = (0..6).map(|k| [0.1 * f64::from(k), 0.3, 0.0]).collect();
    assert_eq!(cut(&line), (vec![[0, 1, 0]; 4], Cut::NoArea));
    assert_eq!(cut(&[[0.5; 3]; 5]), (vec![[0, 1, 0]; 3], Cut::NoArea));
    // Both loops of an eight are as large.
    let eight = [
        [0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    assert_eq!(cut(&eight).1, Cut::NoArea);
}

#[test]
fn outlines_that_cross_themselves_are_told_apart() {
    let pentagram: Vec<[f64; 3]> = (0..5)
        .map(|k| {
            DVec2::from_angle(2.0 * TAU * f64::from(k) / 5.0)
                .extend(0.0)
                .to_array()
        })
        .collect();
    assert_eq!(cut(&pentagram).1, Cut::Crossing);
    let uneven_eight = [
        [0.0, 0.0, 0.0],
        [3.0, 1.0, 0.0],
        [3.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
    ];
    assert_eq!(cut(&uneven_eight).1, Cut::Crossing);
}

#[test]
fn every_triangle_of_a_polygon_with_a_corner_that_is_not_finite_has_that_corner() {
    for count in 3..8 {
        for bad in 0..count {
            let mut corners: Vec<[f64; 3]> = (0..count)
                .map(|k| [k as f64, (k * k) as f64, 0.0])
                .collect();
            corners[bad] = [f64::NAN, 0.0, 1e300];
            let (triangles, _) = cut(&corners);
            assert_eq!(triangles.len(), count - 2);
            assert!(triangles.iter().all(|t| t.contains(&(bad as u32))));
        }
    }
}
