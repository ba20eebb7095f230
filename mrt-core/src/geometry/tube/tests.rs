//! Charts, areas, rays and segments of the tubes.

use super::*;
use crate::lighting::sampling::{sobol_point, sphere_from_square, square_from_unit};
use proptest::prelude::*;

/// Points err by a few ulp, and so do distances to the wall.
const ON_WALL: f64 = 1e-13;

fn form() -> impl Strategy<Value = TubeForm> {
    prop_oneof![Just(TubeForm::Straight), Just(TubeForm::Bend)]
}

fn unit() -> impl Strategy<Value = f64> {
    0.0..1.0f64
}

/// A place in a tube: a point of the wall, moved towards the centre line.
#[derive(Clone, Copy, Debug)]
struct Place {
    chart: usize,
    u: f64,
    v: f64,
    /// 0 on the wall, 1 on the centre line.
    depth: f64,
}

fn place() -> impl Strategy<Value = Place> {
    (0..4usize, unit(), unit(), unit()).prop_map(|(chart, u, v, depth)| Place {
        chart,
        u,
        v,
        depth,
    })
}

impl Place {
    fn on_wall(self) -> Self {
        Self { depth: 0.0, ..self }
    }

    fn surface(self, form: TubeForm) -> SurfacePoint {
        form.surface(form.charts()[self.chart], self.u, self.v)
    }

    fn position(self, form: TubeForm) -> DVec3 {
        let at = self.surface(form);
        at.position + at.normal * (self.depth * TUBE_RADIUS)
    }
}

proptest! {
    #[test]
    fn charts_round_trip(form in form(), chart in 0..4usize, u in unit(), v in unit()) {
        let face = form.charts()[chart];
        let at = form.surface(face, u, v);
        prop_assert!(form.wall_distance(at.position).abs() < ON_WALL);
        prop_assert!(form.contains(at.position));
        let (found, fu, fv) = form.chart_of(at.position);
        // At the edge of a chart the neighbouring chart is as good.
        if (0.001..0.999).contains(&v) {
            prop_assert_eq!(found, face);
            // Angles about the bend's edge lose a digit at a radius of 0.1.
            prop_assert!((fu - u).abs() < 1e-13 && (fv - v).abs() < 1e-13);
        }
    }

    #[test]
    fn tangents_and_areas_are_the_derivatives(
        form in form(), chart in 0..4usize, u in 0.1..0.9f64, v in 0.1..0.9f64,
    ) {
        const STEP: f64 = 1e-5;
        let face = form.charts()[chart];
        let at = form.surface(face, u, v);
        let position = |u, v| form.surface(face, u, v).position;
        let du = (position(u + STEP, v) - position(u - STEP, v)) / (2.0 * STEP);
        let dv = (position(u, v + STEP) - position(u, v - STEP)) / (2.0 * STEP);
        // Central differences err by STEP² times the third derivative, and by rounding over STEP.
        let bound = 1e-8;
        prop_assert!((du.normalize() - at.tangents[0]).length() < bound);
        prop_assert!((dv.normalize() - at.tangents[1]).length() < bound);
        prop_assert!((du.cross(dv).length() - at.area_per_uv).abs() < bound);
        prop_assert!(at.normal.dot(at.tangents[0]).abs() < 1e-14);
        prop_assert!(at.normal.dot(at.tangents[1]).abs() < 1e-14);
        prop_assert!((at.normal.length() - 1.0).abs() < 1e-14);
        prop_assert!(form.wall_distance(at.position + at.normal * 0.1) > 0.0);
        // u and v grow with the coordinates of the flat face.
        prop_assert!(at.tangents[0][face.u_axis()] > 0.0);
        prop_assert!(at.tangents[1][face.v_axis()] > 0.0);
    }

    #[test]
    fn rays_end_on_the_wall_or_in_an_opening(
        form in form(), place in place(), on_wall in any::<bool>(), (x, y) in (unit(), unit()),
    ) {
        let place = if on_wall { place.on_wall() } else { place };
        let origin = place.position(form);
        let mut direction = sphere_from_square(square_from_unit(DVec2::new(x, y)));
        if direction.dot(place.surface(form).normal) < 0.0 && on_wall {
            direction = -direction;
        }
        let hit = form.first_hit(origin, direction);
        prop_assert!(hit.distance >= 0.0);
        match hit.opening {
            None => prop_assert!(form.wall_distance(hit.point).abs() < 1e-9),
            Some(face) => {
                let plane = if face.is_positive() { 1.0 } else { 0.0 };
                prop_assert!((hit.point[face.axis()] - plane).abs() < 1e-14);
            }
        }
        prop_assert!(form.contains(hit.point));
        // The whole way to the end is inside.
        for k in 1..16 {
            let t = hit.distance * f64::from(k) / 16.0;
            prop_assert!(form.wall_distance(origin + direction * t) > -1e-9);
        }
        prop_assert!(form.segment_is_free(origin, origin + direction * (hit.distance * 0.999)));
    }

    #[test]
    fn segments_agree_with_rays(
        form in form(), a in place(), b in place(), on_wall in any::<bool>(),
    ) {
        let [from, to] = [a, b].map(|place| {
            let place = if on_wall { place.on_wall() } else { place };
            place.position(form)
        });
        let reached = form.first_hit(from, to - from).distance;
        // The ray and the segment may round differently within a billionth of the end, and everywhere on
        // chords that hardly leave the wall.
        let clear = (reached - 1.0).abs() > 1e-9 || on_wall;
        if clear && form.wall_distance(from.midpoint(to)).abs() > 1e-6 {
            let free = reached > 1.0 - 1e-9;
            prop_assert_eq!(form.segment_is_free(from, to), free);
            prop_assert_eq!(form.segment_is_free(to, from), free);
        }
    }

    #[test]
    fn segments_agree_with_steps_along_them(
        a in place(), b in place(),
    ) {
        let form = TubeForm::Bend;
        let from = a.on_wall().position(form);
        let to = Place { depth: 0.01 + 0.99 * b.depth, ..b }.position(form);
        let deepest = (1..2000)
            .map(|k| form.wall_distance(from.lerp(to, f64::from(k) / 2000.0)))
            .fold(f64::INFINITY, f64::min);
        // Between steps the distance changes by less than the square of half a step times the curvature.
        if deepest.abs() > 1e-5 {
            prop_assert_eq!(form.segment_is_free(from, to), deepest > 0.0);
        }
    }
}

#[test]
fn texel_areas_add_up_to_the_wall() {
    for form in TubeForm::ALL {
        for resolution in [1, 2, 7, 32] {
            let sum: f64 = form
                .charts()
                .into_iter()
                .flat_map(|chart| (0..resolution).map(move |j| (chart, j)))
                .map(|(chart, j)| form.texel_area(chart, resolution, j) * resolution as f64)
                .sum();
            assert!((sum - form.wall_area()).abs() < 1e-14, "{form:?}");
        }
    }
    // The area of a whole torus is 4π² M R.
    let torus_quarter = std::f64::consts::PI * std::f64::consts::PI * 0.5 * TUBE_RADIUS;
    assert!((TubeForm::Bend.wall_area() - torus_quarter).abs() < 1e-14);
}

#[test]
fn texel_areas_are_the_integral_of_the_surface() {
    const STEPS: usize = 200;
    for form in TubeForm::ALL {
        for chart in form.charts() {
            for j in 0..3 {
                let sum: f64 = (0..STEPS)
                    .map(|k| {
                        let v = (j as f64 + (k as f64 + 0.5) / STEPS as f64) / 3.0;
                        form.surface(chart, 0.5, v).area_per_uv / (STEPS * 9) as f64
                    })
                    .sum();
                // The midpoint rule on a sine errs by step² / 24 of it, 3e-7. On the inner side the radius
                // that is left is a quarter of the sine.
                assert!((sum - form.texel_area(chart, 3, j)).abs() < 2e-6 * sum);
            }
        }
    }
}

#[test]
fn neighbouring_charts_meet() {
    for form in TubeForm::ALL {
        for chart in form.charts() {
            for v in [0.0, 1.0] {
                for u in [0.0, 0.3, 1.0] {
                    let point = form.surface(chart, u, v).position;
                    let neighbours = form
                        .charts()
                        .into_iter()
                        .flat_map(|other| [(other, 0.0), (other, 1.0)])
                        .filter(|&(other, v)| {
                            [u, 1.0 - u]
                                .into_iter()
                                .any(|u| form.surface(other, u, v).position.distance(point) < 1e-14)
                        })
                        .count();
                    // The chart itself and one other.
                    assert_eq!(neighbours, 2, "{form:?} {chart} {u} {v}");
                }
            }
        }
    }
}

#[test]
fn the_mirror_of_x_and_z_keeps_the_bend() {
    for chart in TubeForm::Bend.charts() {
        let at = TubeForm::Bend.surface(chart, 0.2, 0.7);
        let mirrored = TubeForm::Bend.surface(chart, 0.8, 0.7);
        let swapped = DVec3::new(at.position.z, at.position.y, at.position.x);
        assert!(mirrored.position.distance(swapped) < 1e-15);
    }
}

#[test]
fn rays_from_an_opening_cross_to_the_other() {
    // Along the axis of the straight tube, across the bend, and out of the opening where it starts.
    let hit = TubeForm::Straight.first_hit(DVec3::new(0.0, 0.5, 0.5), DVec3::X);
    assert_eq!((hit.distance, hit.opening), (1.0, Some(Face::PosX)));
    let hit = TubeForm::Bend.first_hit(DVec3::new(1.0, 0.5, 0.8), DVec3::new(-1.0, 0.0, 1.0));
    assert_eq!(hit.opening, Some(Face::PosZ));
    let hit = TubeForm::Bend.first_hit(DVec3::new(1.0, 0.5, 0.5), DVec3::X);
    assert_eq!((hit.distance, hit.opening), (0.0, Some(Face::PosX)));
}

/// No ray from the wall into the hemisphere hits the wall where it starts.
#[test]
fn a_point_does_not_shadow_itself() {
    for chart in TubeForm::Bend.charts() {
        for k in 0..2000 {
            let [p, q] = [sobol_point(k, 1), sobol_point(k, 2)];
            let at = TubeForm::Bend.surface(chart, p.x, p.y);
            let mut direction = sphere_from_square(square_from_unit(q));
            if direction.dot(at.normal) < 0.0 {
                direction = -direction;
            }
            let hit = TubeForm::Bend.first_hit(at.position, direction);
            // A chord has the length of twice the cosine over the curvature, which is at most 10.
            let chord = 2.0 * direction.dot(at.normal) / 10.0;
            assert!(
                hit.opening.is_some() || hit.distance > 0.99 * chord,
                "{} against {chord}",
                hit.distance
            );
        }
    }
}

/// These rays hardly approach the plane of an opening. If they were followed all the way there, the first
/// dip into the wall would be too short to be seen, and the hit would lose digits.
#[test]
fn rays_nearly_along_an_opening_keep_their_digits() {
    let form = TubeForm::Bend;
    let from = form.surface(Face::NegZ, 0.7631346635316913, 0.19816957976641902);
    let to = form.surface(Face::NegY, 0.23788913323187916, 0.7334050011310489);
    let offset = to.position - from.position;
    assert!(offset.dot(from.normal) < 0.0);
    assert!(form.first_hit(from.position, offset).distance < 1e-9);
    let at = form.surface(Face::NegY, 0.77, 0.04);
    let origin = at.position + at.normal * 0.1;
    let hit = form.first_hit(origin, DVec3::new(-1.0, 0.0, 1e-12));
    assert!(form.wall_distance(hit.point).abs() < ON_WALL);
}

/// Prints the times that the documentation states: `cargo test --release -- --ignored --nocapture cost`.
#[test]
#[ignore = "prints times, checks nothing"]
fn cost() {
    const COUNT: u32 = 1 << 20;
    let form = TubeForm::Bend;
    let points: Vec<[SurfacePoint; 2]> = (0..COUNT)
        .map(|k| {
            [1, 2].map(|seed| {
                let p = sobol_point(k, seed);
                form.surface(
                    form.charts()[(k / (1 << (2 * seed))) as usize % 4],
                    p.x,
                    p.y,
                )
            })
        })
        .collect();
    let start = std::time::Instant::now();
    let free = points
        .iter()
        .filter(|[a, b]| form.segment_is_free(a.position, b.position))
        .count();
    let each = start.elapsed().as_secs_f64() / f64::from(COUNT);
    println!("{:.0} ns a segment, {free} free", each * 1e9);
    let start = std::time::Instant::now();
    let left = points
        .iter()
        .filter(|[a, b]| {
            let direction = a.normal + 0.9 * b.normal;
            form.first_hit(a.position, direction).opening.is_some()
        })
        .count();
    let each = start.elapsed().as_secs_f64() / f64::from(COUNT);
    println!("{:.0} ns a ray, {left} leave", each * 1e9);
}
