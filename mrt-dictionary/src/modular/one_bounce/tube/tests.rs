//! Physics of the tubes' one-bounce operator.

use super::*;
use mrt_core::geometry::form_factor::point_to_polygon;
use mrt_core::linalg::matrix::multiply;

fn bounce(form: TubeForm, resolution: usize, parts: Parts) -> Matrix<f64> {
    tube_bounce(form, resolution, parts, &Progress::silent()).expect("nobody cancels")
}

/// Form factor of a disc opening of the straight tube, which every point of the wall sees whole: Lambert's
/// formula on a polygon of so many sides that its area is short of the disc's by 2e-6 of it.
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
fn smooth_light(form: TubeForm, resolution: usize) -> Matrix<f64> {
    let texels = tube_texels(form, resolution);
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
        let factors = bounce(TubeForm::Straight, resolution, Parts::STANDARD);
        for (i, texel) in tube_texels(TubeForm::Straight, resolution)
            .iter()
            .enumerate()
        {
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
    let form = TubeForm::Bend;
    let resolution = 6;
    let factors = bounce(form, resolution, Parts::STANDARD);
    let traced = ray_traced_tube_bounce(form, resolution, RAYS);
    for i in 0..factors.rows() {
        let sum = |m: &Matrix<f64>| (0..m.columns()).map(|j| m[(i, j)]).sum::<f64>();
        // An area under a curve of a net of 2^14 points: some n^-3/4, 7e-4, and the parts' shadows.
        let bound = 2e-3;
        assert!((sum(&factors) - sum(&traced)).abs() < bound, "{i}");
    }
}

#[test]
fn rays_agree_with_the_quadrature() {
    const RAYS: u32 = 4096;
    for form in TubeForm::ALL {
        let summed = bounce(form, 4, Parts { far: 8, near: 16 });
        let traced = ray_traced_tube_bounce(form, 4, RAYS);
        for (t, e) in traced.data().iter().zip(summed.data()) {
            // As in `bounce_rays`: six standard errors, and a grain of one ray.
            let bound = 6.0 * (e / f64::from(RAYS)).sqrt() + 1.0 / f64::from(RAYS);
            assert!((t - e).abs() <= bound, "{form:?}: {t} against {e}");
        }
    }
}

#[test]
fn transport_between_texels_is_reciprocal() {
    for form in TubeForm::ALL {
        let resolution = 16;
        let texels = tube_texels(form, resolution);
        let factors = bounce(form, resolution, Parts::STANDARD);
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
        // Exact for means over both texels; one is sampled at its centre, which costs the square of a
        // texel's size, and more at the edges of shadows.
        let error = (difference / whole).sqrt();
        assert!(error < 0.06, "{form:?}: {error}");
    }
}

#[test]
fn symmetry_fills_the_rows_that_direct_evaluation_gives() {
    for form in TubeForm::ALL {
        let resolution = 5;
        let texels = tube_texels(form, resolution);
        let parts = Parts { far: 3, near: 4 };
        let factors = bounce(form, resolution, parts);
        for (i, receiver) in texels.iter().enumerate() {
            for (j, source) in texels.iter().enumerate() {
                let near = is_near(form, resolution, &receiver.center, source);
                let parts = if near { parts.near } else { parts.far };
                let direct: f64 = wall_points(form, resolution, source, parts)
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

#[test]
fn fold_factors_are_those_of_the_tubes() {
    let count = |form| tube_parity_classes(form, 4).class_count();
    assert_eq!(TubeForm::ALL.map(count), [8, 4]);
}

#[test]
fn texels_are_found_by_their_centers() {
    for form in TubeForm::ALL {
        for (k, texel) in tube_texels(form, 7).iter().enumerate() {
            assert_eq!(tube_texel_at(form, 7, texel.center.position), k);
        }
    }
}

/// One bounce with the light itself under the integral, where F sees one value a texel.
fn bounce_of_continuous_light(form: TubeForm, resolution: usize, parts: usize) -> Matrix<f64> {
    let texels = tube_texels(form, resolution);
    let fine = tube_texels(form, resolution * parts);
    let light = smooth_light(form, resolution * parts);
    let value = |receiver: &TubeTexel| -> f64 {
        let sources = fine.iter().zip(light.data());
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
        let light = smooth_light(form, 16);
        let bounced = multiply(bounce(form, 16, Parts::STANDARD).view(), light.view());
        let error = relative_error(&bounced, &bounce_of_continuous_light(form, 16, 6));
        // Half of what one bounce may err by; at 32² texels a chart it is a quarter of this.
        assert!(error < 2.5e-3, "{form:?}: {error}");
    }
}

#[test]
fn one_bounce_of_smooth_light_is_as_good_as_with_finer_parts() {
    for form in TubeForm::ALL {
        let light = smooth_light(form, 8);
        let bounced = |parts| multiply(bounce(form, 8, parts).view(), light.view());
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
            let light = smooth_light(form, resolution);
            let run = |parts| {
                let start = std::time::Instant::now();
                let out = multiply(bounce(form, resolution, parts).view(), light.view());
                (out, start.elapsed().as_secs_f64())
            };
            let fine = Parts {
                far: if resolution == 32 { 16 } else { 32 },
                near: 64,
            };
            let (reference, _) = run(fine);
            let continuous = bounce_of_continuous_light(form, resolution, 128 / resolution);
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
