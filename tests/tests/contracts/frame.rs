//! What a game relies on in every frame: no allocation, no trace of a skipped light, and the right light of each kind.

use allocation_counter::measure;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_runtime::low_level::light::limits::MAX_LIGHTS;
use mrt_runtime::shadows::Rays;
use mrt_runtime::{Bounces, Frame, FrameConfig, FrameError, Level, Light, LightError, Scene};
use mrt_tests::{
    FrameForTests, assembled, by_texel, corridor, floor_plan, point_and_normal, position_of, shown,
    solved,
};

const CELLS: [[i32; 2]; 4] = [[0, 0], [1, 0], [2, 0], [1, 1]];

fn level() -> Level {
    floor_plan(&CELLS, 0.6)
}

/// Blocks 1 and 2 are not connected, so that the opening of block 1 towards block 2 leads outside.
fn level_open_to_outside() -> Level {
    let mut level = level();
    level
        .connections
        .retain(|c| (c.a.block, c.b.block) != (1, 2));
    level
}

const GOOD_SPHERE: Light = Light::Sphere {
    position: Vec3::new(0.4, 0.5, 0.6),
    radius: 0.1,
    intensity: Vec3::new(1.0, 2.0, 3.0),
};
const GOOD_SPOT: Light = Light::Spot {
    position: Vec3::new(1.5, 0.9, 0.5),
    radius: 0.05,
    intensity: Vec3::new(2.0, 1.0, 0.5),
    direction: Vec3::new(0.2, -2.0, 0.1),
    inner_angle: 0.4,
    outer_angle: 0.9,
};
const GOOD_DIRECTIONAL: Light = Light::Directional {
    direction: Vec3::new(-1.0, -0.3, 0.2),
    irradiance: Vec3::new(5.0, 4.0, 3.0),
};

/// The bits of all that a frame shows, and the number of its passes.
fn snapshot(frame: &Frame) -> (Vec<(&'static str, Vec<u32>)>, u32) {
    (shown(frame), frame.last_report().passes())
}

#[test]
fn a_frame_allocates_nothing() {
    let scene = assembled(&level_open_to_outside());
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let lights = [GOOD_SPHERE, GOOD_SPOT, GOOD_DIRECTIONAL];
    let mut outside = lights;
    outside[2] = Light::sphere(Vec3::new(50.0, 0.5, 0.5), 0.1, Vec3::ONE);
    let converged = Bounces::Converged {
        tolerance: 1e-3,
        limit: 50,
    };
    for bounces in [
        Bounces::Count(1),
        Bounces::Count(4),
        Bounces::Feedback,
        converged,
    ] {
        // The first frame counts too.
        let counted = measure(|| {
            for lights in [&lights[..], &lights[..1], &[], &lights[..]] {
                frame.light_with(lights, bounces);
            }
            frame.set_lights(&outside);
            assert_eq!(frame.solve().skipped_lights().len(), 1);
            let rays = Rays(|_: DVec3, _: DVec3| 0.5);
            frame.light_through(&lights, &rays, bounces);
        });
        assert_eq!(counted.count_total, 0, "{bounces:?}");
    }
    // The counter does count.
    assert!(measure(|| drop(std::hint::black_box(vec![1u8; 100]))).count_total > 0);
}

#[test]
fn the_largest_number_of_lights_needs_no_allocation_and_one_more_is_skipped() {
    let scene = assembled(&floor_plan(&corridor(1), 0.5));
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let lights = vec![GOOD_SPHERE; MAX_LIGHTS + 1];
    let counted = measure(|| {
        frame.light_with(&lights[..MAX_LIGHTS], Bounces::Count(1));
    });
    assert_eq!(counted.count_total, 0);
    let before = snapshot(&frame);
    let one_more = frame.add_light(GOOD_SPHERE);
    let report = frame.solve();
    let [skipped] = report.skipped_lights() else {
        panic!("{:?}", report.skipped_lights());
    };
    assert_eq!(
        (skipped.id, skipped.reason),
        (one_more, LightError::TooMany)
    );
    assert_eq!(snapshot(&frame), before);
}

const NOT_NUMBERS: [f32; 4] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2e9];
const NEGATIVE: [f32; 2] = [-1.0, -1e-30];

/// Lights with one faulty value each, for every value and every fault, and the name of that value.
fn faulty_lights() -> Vec<(&'static str, Light)> {
    let mut faulty = Vec::new();
    let all = || NOT_NUMBERS.into_iter().chain(NEGATIVE);
    for axis in 0..3 {
        let with = |mut vector: Vec3, value: f32| {
            vector[axis] = value;
            vector
        };
        for bad in all() {
            faulty.push((
                "intensity",
                Light::sphere(Vec3::splat(0.5), 0.1, with(Vec3::ONE, bad)),
            ));
            faulty.push((
                "irradiance",
                Light::Directional {
                    direction: Vec3::NEG_Y,
                    irradiance: with(Vec3::ONE, bad),
                },
            ));
        }
        for bad in NOT_NUMBERS {
            faulty.push((
                "position",
                Light::sphere(with(Vec3::splat(0.5), bad), 0.1, Vec3::ONE),
            ));
            faulty.push((
                "direction",
                Light::Directional {
                    direction: with(Vec3::NEG_Y, bad),
                    irradiance: Vec3::ONE,
                },
            ));
            faulty.push(("direction", spot(with(Vec3::NEG_Y, bad), 0.1, 0.2)));
        }
    }
    for bad in all() {
        faulty.push(("radius", Light::sphere(Vec3::splat(0.5), bad, Vec3::ONE)));
        faulty.push(("inner angle", spot(Vec3::NEG_Y, bad, 1.0)));
        faulty.push(("outer angle", spot(Vec3::NEG_Y, 0.0, bad)));
    }
    faulty.push(("outer angle", spot(Vec3::NEG_Y, 0.0, 3.2)));
    // The inner angle is larger than the outer.
    faulty.push(("inner angle", spot(Vec3::NEG_Y, 1.0, 0.9)));
    faulty
}

fn spot(direction: Vec3, inner_angle: f32, outer_angle: f32) -> Light {
    Light::Spot {
        position: Vec3::splat(0.5),
        radius: 0.1,
        intensity: Vec3::ONE,
        direction,
        inner_angle,
        outer_angle,
    }
}

#[test]
fn faulty_lights_are_named_and_the_others_shine() {
    let scene = assembled(&level());
    let mut frame = solved(&scene, &[GOOD_SPHERE], Bounces::Count(3));
    let alone = snapshot(&frame);
    let mut refuse = |light: Light| {
        let id = frame.add_light(light);
        let report = frame.solve();
        assert_eq!(snapshot(&frame), alone, "{light:?}");
        assert!(frame.remove_light(id).is_some(), "{light:?}");
        let [skipped] = report.skipped_lights() else {
            panic!("{light:?}: {:?}", report.skipped_lights());
        };
        assert_eq!(skipped.id, id);
        skipped.reason
    };
    for (field, light) in faulty_lights() {
        match refuse(light) {
            LightError::OutOfRange { what, .. } => assert_eq!(what, field, "{light:?}"),
            other => panic!("{light:?}: {other}"),
        }
    }
    for direction in [Vec3::ZERO, Vec3::new(0.0, -0.0, 0.0)] {
        let directional = Light::Directional {
            direction,
            irradiance: Vec3::ONE,
        };
        for light in [directional, spot(direction, 0.1, 0.2)] {
            let error = refuse(light);
            assert!(matches!(error, LightError::NoDirection { .. }), "{error}");
        }
    }
    for position in [
        Vec3::new(-0.01, 0.5, 0.5),
        Vec3::new(0.5, 0.5, 1.5),
        Vec3::splat(1e9),
        Vec3::new(0.5, 1.001, 0.5),
    ] {
        let error = refuse(Light::sphere(position, 0.1, Vec3::ONE));
        assert!(matches!(error, LightError::OutsideBlocks { .. }), "{error}");
    }
}

#[test]
fn extreme_but_legal_lights_give_finite_light() {
    let scene = assembled(&level_open_to_outside());
    let mut lights = Vec::new();
    for intensity in [0.0, f32::MIN_POSITIVE, 1e9] {
        for radius in [0.0, f32::MIN_POSITIVE, 1e9] {
            for position in [
                Vec3::splat(0.5),
                Vec3::ZERO,
                position_of(&scene, 17),
                Vec3::new(1.0, 0.5, 0.5),
            ] {
                lights.push(Light::sphere(position, radius, Vec3::splat(intensity)));
            }
        }
    }
    lights.push(spot(Vec3::splat(1e-38), 0.0, 0.0));
    lights.push(spot(
        Vec3::splat(1e9),
        std::f32::consts::PI,
        std::f32::consts::PI,
    ));
    for light in &lights {
        let frame = solved(&scene, &[*light], Bounces::Count(8));
        for signal in [frame.direct(), frame.indirect()] {
            assert!(
                signal.iter().all(|e| e.is_finite() && *e >= 0.0),
                "{light:?}"
            );
        }
    }
}

#[test]
fn without_lights_everything_is_zero() {
    let scene = assembled(&level());
    let mut frame = solved(&scene, &[GOOD_SPHERE], Bounces::Count(2));
    for bounces in [
        Bounces::Count(0),
        Bounces::Count(3),
        Bounces::Converged {
            tolerance: 0.0,
            limit: 5,
        },
    ] {
        frame.light_with(&[], bounces);
        let all = [
            frame.direct(),
            frame.indirect(),
            frame.lightmap().pixels().as_flattened().to_vec(),
        ];
        assert!(all.into_iter().flatten().all(|e| e == 0.0), "{bounces:?}");
    }
}

#[test]
fn a_spot_is_a_sphere_inside_its_cone_and_dark_outside() {
    let scene = assembled(&level());
    let Light::Spot {
        position,
        radius,
        intensity,
        direction,
        inner_angle,
        outer_angle,
    } = GOOD_SPOT
    else {
        panic!("it is a spot");
    };
    let spot = solved(&scene, &[GOOD_SPOT], Bounces::Count(1));
    let sphere = solved(
        &scene,
        &[Light::sphere(position, radius, intensity)],
        Bounces::Count(1),
    );
    let (spot, sphere) = (
        by_texel(&scene, &spot.direct()),
        by_texel(&scene, &sphere.direct()),
    );
    let mut seen = [0; 3];
    for texel in 0..scene.texel_count() {
        let angle = (position_of(&scene, texel) - position).angle_between(direction);
        // `angle_between` here is `f32`: off by up to 1e-3 for small angles.
        if angle < inner_angle - 1e-3 {
            assert_eq!(spot[texel], sphere[texel]);
            seen[0] += 1;
        } else if angle > outer_angle + 1e-3 {
            assert_eq!(spot[texel], [0.0; 3]);
            seen[1] += 1;
        } else {
            assert!((0..3).all(|c| spot[texel][c] <= sphere[texel][c]));
            seen[2] += 1;
        }
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
}

#[test]
fn directional_light_enters_through_outside_openings_only() {
    let closed = assembled(&level());
    let frame = solved(&closed, &[GOOD_DIRECTIONAL], Bounces::Count(2));
    assert!(
        frame
            .direct()
            .iter()
            .chain(&frame.indirect())
            .all(|&e| e == 0.0)
    );

    let open = assembled(&level_open_to_outside());
    let frame = solved(&open, &[GOOD_DIRECTIONAL], Bounces::Count(1));
    let direct = by_texel(&open, &frame.direct());
    let flux = direct.iter().map(|e| f64::from(e[0])).sum::<f64>() / 256.0;
    let direction = DVec3::new(-1.0, -0.3, 0.2).normalize();
    // The flux through the unit opening in the plane x = 2. All of it ends on walls of blocks 0, 1 and 3.
    let expected = 5.0 * -direction.x;
    // The edges of the light cut through texels of 1/16, and err by about half a texel.
    assert!((flux / expected - 1.0).abs() < 0.05, "{flux} of {expected}");
    // Block 2 opens in the other direction: light that travels along -x does not enter through its face -x.
    for texel in open.level.blocks[2].texels.clone() {
        assert_eq!(direct[texel], [0.0; 3]);
    }
    check_against_rays(&open, direction, &direct);
}

/// Compares with rays from each texel back through the only opening to the outside, at x = 2.
fn check_against_rays(scene: &Scene, direction: DVec3, direct: &[[f32; 3]]) {
    // Rounding decides about texels whose ray passes the rim of the opening as closely as this.
    const RIM: f64 = 1e-6;
    for block in [0, 1] {
        for texel in scene.level.blocks[block].texels.clone() {
            let (position, normal) = point_and_normal(scene, texel);
            let distance = (2.0 - position.x) / -direction.x;
            let crossing = position - direction * distance;
            let [y, z] = [crossing.y, crossing.z].map(|u| u.min(1.0 - u));
            let depth = y.min(z);
            if depth.abs() < RIM {
                continue;
            }
            let cosine = -normal.dot(direction);
            let lit = depth > 0.0 && cosine > 0.0;
            // Block 0 sees the opening through block 1, whose sides are open or in one plane with the opening's sides.
            let expected = if lit { 5.0 * cosine } else { 0.0 };
            let found = f64::from(direct[texel][0]);
            assert!(
                (found - expected).abs() < 1e-5,
                "block {block}: {found} {expected}"
            );
        }
    }
    assert!(scene.level.blocks[1].shape.is_open(Face::PosX));
}

#[test]
fn a_spot_on_a_texel_and_rays_out_of_range_spread_no_nan() {
    let scene = assembled(&floor_plan(&corridor(1), 0.5));
    let mut frame = Frame::new(&scene, FrameConfig::default());
    let on_texel = Light::Spot {
        position: position_of(&scene, 0),
        radius: 0.1,
        intensity: Vec3::ONE,
        direction: Vec3::ONE,
        inner_angle: 0.5,
        outer_angle: 1.5,
    };
    frame.light_with(&[on_texel], Bounces::Count(1));
    assert!(frame.direct().iter().all(|e| e.is_finite()));
    assert!(frame.indirect().iter().sum::<f32>() > 0.0);

    let lamp = Light::sphere(Vec3::splat(0.5), 0.1, Vec3::ONE);
    let out_of_range = Rays(|from: DVec3, _| if from.x > 0.5 { f32::NAN } else { 7.0 });
    frame.light_through(&[lamp], &out_of_range, Bounces::Count(1));
    assert!(frame.direct().iter().all(|e| e.is_finite()));
    assert!(frame.indirect().iter().sum::<f32>() > 0.0);

    let wrong = vec![f32::NAN; frame.direct().len()];
    assert!(matches!(
        frame.solve_from_direct(&wrong),
        Err(FrameError::Direct {
            faulty: Some(0),
            ..
        })
    ));
}
