//! Physics of the tubes' one-bounce operator.

use super::*;
use crate::modular::one_bounce::rays::ray_traced_tube_bounce;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::linalg::matrix::multiply;

fn bounce(wall: &TubeWall, parts: Parts) -> Matrix<f64> {
    tube_bounce(wall, parts, &Progress::silent()).expect("nobody cancels")
}

/// Form factor of a disc opening of the straight tube, which every point of the wall sees whole: Lambert's
/// formula on a polygon of 2048 sides, whose area is short of the disc's by 2e-6 of it.
fn disc_factor(at: &SurfacePoint, opening: Face) -> f64 {
    const SIDES: usize = 2048;
    let x = if opening.is_positive() { 1.0 } else { 0.0 };
    let rim: Vec<DVec3> = (0..SIDES)
        .map(|k| {
            let (sine, cosine) = (2.0 * PI * k as f64 / SIDES as f64).sin_cos();
            let r = mrt_core::geometry::tube::TUBE_RADIUS;
            DVec3::new(x, 0.5 + r * sine, 0.5 + r * cosine)
        })
        .collect();
    point_to_polygon(at.position, at.normal, &rim)
}

/// Light that varies over the tube like a lamp somewhere in it.
fn smooth_light(wall: &TubeWall) -> Matrix<f64> {
    let texels = &wall.texels;
    let lamp = DVec3::new(0.6, 0.6, 0.55);
    Matrix::from_fn(texels.len(), 1, |k, _| {
        let offset = lamp - texels[k].center.position;
        texels[k].center.normal.dot(offset).max(0.0) / offset.length_squared().max(0.01)
    })
}

fn relative_error(a: &Matrix<f64>, b: &Matrix<f64>) -> f64 {
    let difference: f64 = a
        .data()
        .iter()
        .zip(b.data())
        .map(|(a, b)| (a - b) * (a - b))
        .sum();
    difference.sqrt() / b.frobenius_norm()
}

#[test]
fn straight_tubes_lose_only_what_leaves_through_the_discs() {
    for resolution in [6, 16] {
        let wall = TubeWall::new(TubeForm::Straight, resolution);
        let factors = bounce(&wall, Parts::STANDARD);
        for (i, texel) in wall.texels.iter().enumerate() {
            let walls: f64 = (0..factors.columns()).map(|j| factors[(i, j)]).sum();
            let discs: f64 = TubeForm::Straight
                .openings()
                .map(|opening| disc_factor(&texel.center, opening))
                .iter()
                .sum();
            // The kernel jumps where the receiver is, by half a texel's share of the light.
            assert!(
                (walls + discs - 1.0).abs() < 2e-4,
                "{resolution}: {walls} {discs}"
            );
        }
    }
}

#[test]
fn bends_lose_only_what_rays_see_leaving() {
    const RAYS: u32 = 1 << 14;
    let wall = TubeWall::new(TubeForm::Bend, 6);
    let factors = bounce(&wall, Parts::STANDARD);
    let traced = ray_traced_tube_bounce(&wall, RAYS);
    for i in 0..factors.rows() {
        let sum = |m: &Matrix<f64>| (0..m.columns()).map(|j| m[(i, j)]).sum::<f64>();
        // A net of n = 2^14 points errs by some n^-3/4, or 7e-4, in an area under a curve. The other part is the shadows of
        // parts.
        let bound = 2e-3;
        assert!((sum(&factors) - sum(&traced)).abs() < bound, "{i}");
    }
}

#[test]
fn transport_between_texels_is_reciprocal() {
    for form in TubeForm::ALL {
        let wall = TubeWall::new(form, 16);
        let texels = &wall.texels;
        let factors = bounce(&wall, Parts::STANDARD);
        let (mut difference, mut whole) = (0.0, 0.0);
        for j in 0..texels.len() {
            for i in 0..texels.len() {
                let (there, back) = (
                    texels[i].area * factors[(i, j)],
                    texels[j].area * factors[(j, i)],
                );
                difference += (there - back) * (there - back);
                whole += there * there;
            }
        }
        // Means over both texels would be exactly reciprocal. Receivers are sampled at their centres, which costs the
        // square of a texel's size, and more at the edges of shadows.
        let error = (difference / whole).sqrt();
        assert!(error < 0.06, "{form:?}: {error}");
    }
}

#[test]
fn symmetry_fills_the_rows_that_direct_evaluation_gives() {
    for form in TubeForm::ALL {
        let wall = TubeWall::new(form, 5);
        let parts = Parts { far: 3, near: 4 };
        let factors = bounce(&wall, parts);
        for (i, receiver) in wall.texels.iter().enumerate() {
            for (j, source) in wall.texels.iter().enumerate() {
                let near = is_near(&wall, &receiver.center, source);
                let parts = if near { parts.near } else { parts.far };
                let direct: f64 = wall_points(&wall, source, parts)
                    .map(|point| kernel(form, &receiver.center, &point))
                    .sum();
                // A point may fall on the edge of a shadow, or a texel on the bound of what is near.
                assert!(
                    (factors[(i, j)] - direct).abs() < 1e-3 * direct + 1e-9,
                    "{form:?} {i} {j}"
                );
            }
        }
    }
}

/// One bounce of the light itself, where F sees one value a texel: an integral over `parts`² parts of each texel.
fn bounce_of_continuous_light(wall: &TubeWall, parts: usize) -> Matrix<f64> {
    let (form, texels) = (wall.form, &wall.texels);
    let fine = TubeWall::new(form, wall.resolution * parts);
    let light = smooth_light(&fine);
    let value = |receiver: &TubeTexel| -> f64 {
        let sources = fine.texels.iter().zip(light.data());
        let parts = sources.map(|(source, &light)| {
            let point = WallPoint {
                position: source.center.position,
                normal: source.center.normal,
                area_over_pi: source.area / PI,
            };
            light * kernel(form, &receiver.center, &point)
        });
        parts.sum()
    };
    let values: Vec<f64> = texels.par_iter().map(value).collect();
    Matrix::from_column_major(texels.len(), 1, values)
}

#[test]
fn constant_texels_hold_smooth_light() {
    for form in TubeForm::ALL {
        let wall = TubeWall::new(form, 16);
        let light = smooth_light(&wall);
        let bounced = multiply(bounce(&wall, Parts::STANDARD).view(), light.view());
        let error = relative_error(&bounced, &bounce_of_continuous_light(&wall, 6));
        // Half of what one bounce may err by. At 32² texels a chart the error is a quarter of this.
        assert!(error < 2.5e-3, "{form:?}: {error}");
    }
}

#[test]
fn one_bounce_of_smooth_light_is_as_good_as_with_finer_parts() {
    for form in TubeForm::ALL {
        let wall = TubeWall::new(form, 8);
        let light = smooth_light(&wall);
        let bounced = |parts| multiply(bounce(&wall, parts).view(), light.view());
        let fine = bounced(Parts { far: 24, near: 64 });
        let error = relative_error(&bounced(Parts::STANDARD), &fine);
        assert!(error < 5e-4, "{form:?}: {error}");
    }
}

/// Figures for the documentation; `cargo test --release -- --ignored --nocapture measure`.
#[test]
#[ignore = "prints measurements, checks nothing"]
fn measure() {
    for form in TubeForm::ALL {
        for resolution in [8, 16, 32] {
            let wall = TubeWall::new(form, resolution);
            let light = smooth_light(&wall);
            let run = |parts| {
                let start = std::time::Instant::now();
                let out = multiply(bounce(&wall, parts).view(), light.view());
                (out, start.elapsed().as_secs_f64())
            };
            let fine = Parts {
                far: if resolution == 32 { 16 } else { 32 },
                near: 64,
            };
            let (reference, _) = run(fine);
            let continuous = bounce_of_continuous_light(&wall, 128 / resolution);
            println!(
                "{form:?} {resolution} far {fine:?} against continuous light: {:.2e}",
                relative_error(&reference, &continuous)
            );
            for (far, near) in [(1, 4), (2, 8), (4, 8), (4, 16), (8, 16)] {
                let (out, seconds) = run(Parts { far, near });
                let worst = out
                    .data()
                    .iter()
                    .zip(reference.data())
                    .map(|(a, b)| ((a - b) / b).abs())
                    .fold(0.0, f64::max);
                println!(
                    "{form:?} {resolution} far {far} near {near}: error {:.2e}, worst texel {worst:.2e}, {seconds:.2} s",
                    relative_error(&out, &reference)
                );
            }
        }
    }
}
