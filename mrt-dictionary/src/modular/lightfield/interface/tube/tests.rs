//! Physics of the lightfields at round openings.

use super::*;
use crate::modular::lightfield::symmetries::mirrored;
use crate::modular::lightfield::wall_response::tube::{tube_response, tube_wall_response};
use crate::modular::surface::area_weights::AreaWeights;
use crate::modular::surface::walls::tube::{TubeTexel, direction_around};
use mrt_core::lighting::sampling::{cosine_hemisphere_from_square, sobol_point};
use mrt_core::linalg::matrix::{multiply, transpose_multiply};
use rayon::prelude::*;
use std::f64::consts::PI;

fn grid() -> LightfieldGrid {
    LightfieldGrid::on_discs(&LightfieldConfig::default())
}

fn uniform(wall: &TubeWall) -> Matrix<f64> {
    Matrix::from_fn(wall.texels.len(), 1, |_, _| 1.0)
}

/// Radiosity that varies smoothly over a tube.
fn smooth_radiosity(wall: &TubeWall) -> Matrix<f64> {
    Matrix::from_fn(wall.texels.len(), 1, |k, _| {
        let p = wall.texels[k].center.position;
        1.0 + 0.8 * p.x - 0.5 * p.y + 0.3 * p.z * p.z
    })
}

/// Unit radiance all over the interface.
fn isotropic(grid: &LightfieldGrid) -> Matrix<f64> {
    Matrix::from_fn(grid.sample_count(), 1, |sample, _| grid.root_weight(sample))
}

/// The end of a ray's way through one tube: a texel, or an opening with (u, v) and direction in its frame.
enum Step {
    Wall(usize),
    Leaves(Face, DVec2, DVec3),
}

/// Follows a ray backwards through a tube.
fn follow(wall: &TubeWall, point: DVec3, backward: DVec3) -> Step {
    let hit = wall.form.first_hit(point, backward);
    match hit.opening {
        None => Step::Wall(wall.texel_at(hit.point)),
        Some(face) => {
            let frame = turn_to_heading(face.opposite()).inverse();
            let uv = uv_of_point(frame.point(hit.point).truncate());
            Step::Leaves(face, uv, frame.direction(-backward))
        }
    }
}

/// Light that leaves a tube by one of its openings.
struct Source {
    wall: TubeWall,
    radiosity: Matrix<f64>,
    exit: Face,
}

/// Irradiance at the texels of a tube that is entered at `entry`, from a source behind a chain of passages, by rays:
/// no lightfield grid anywhere.
fn traced_response(
    source: &Source,
    chain: &[TubePassage],
    receiver: &TubeWall,
    entry: Face,
) -> Vec<f64> {
    const RAYS: u32 = 1 << 14;
    let source_radiosity = |toward: DVec3, texel: &TubeTexel| -> Option<f64> {
        let Step::Leaves(face, mut uv, mut direction) =
            follow(receiver, texel.center.position, toward)
        else {
            return None;
        };
        if face != entry {
            return None;
        }
        for passage in chain.iter().rev() {
            (uv, direction) = passage.trace_back(uv, direction)?;
        }
        let (point, direction) = leaving_ray(source.exit, uv, direction);
        match follow(&source.wall, point, -direction) {
            Step::Wall(texel) => Some(source.radiosity.data()[texel]),
            Step::Leaves(..) => None,
        }
    };
    let at_texel = |(index, texel): (usize, &TubeTexel)| {
        let mut sum = 0.0;
        for ray in 0..RAYS {
            let local =
                cosine_hemisphere_from_square(square_from_unit(sobol_point(ray, index as u32)));
            let toward = direction_around(&texel.center, local);
            sum += source_radiosity(toward, texel).unwrap_or(0.0);
        }
        sum / f64::from(RAYS)
    };
    receiver
        .texels
        .par_iter()
        .enumerate()
        .map(at_texel)
        .collect()
}

fn relative_error(wall: &TubeWall, found: &[f64], exact: &[f64]) -> f64 {
    let roots = AreaWeights::of_tube(wall).roots;
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
    let mut difference = roots
        .iter()
        .zip(found.iter().zip(exact))
        .map(|(r, (a, b))| r * (a - b));
    norm(&mut difference) / norm(&mut roots.iter().zip(exact).map(|(r, b)| r * b))
}

#[test]
fn positions_on_the_disc_round_trip_and_weigh_its_flux() {
    let grid = grid();
    for position in 0..grid.positions * grid.positions {
        let uv = grid.position(position);
        assert!((uv_of_point(point_of_uv(uv)) - uv).length() < 1e-14);
        assert!((point_of_uv(uv) - 0.5).length() < TUBE_RADIUS);
    }
    let flux: f64 = (0..grid.sample_count())
        .map(|s| grid.root_weight(s) * grid.root_weight(s))
        .sum();
    // As on squares, the midpoint rule over directions is too large by 2 / (24 x 3)².
    let expected = PI * PI * TUBE_RADIUS * TUBE_RADIUS;
    assert!((flux / expected - 1.0).abs() < 4e-4);
}

#[test]
fn four_quarter_turns_change_nothing_and_one_takes_left_to_up() {
    let grid = grid();
    let field = Matrix::from_fn(grid.sample_count(), 1, |sample, _| {
        let position = grid.position(sample / grid.direction_count());
        let direction = grid.super_directions(sample % grid.direction_count())[4];
        position.x + 0.1 * position.y + direction.x
    });
    let once = rolled(&grid, &field);
    let four = (0..3).fold(once.clone(), |m, _| rolled(&grid, &m));
    assert_eq!(four.data(), field.data());
    for sample in 0..grid.sample_count() {
        let position = grid.position(sample / grid.direction_count());
        let direction = grid.super_directions(sample % grid.direction_count())[4];
        // (x, y) was at (y, -x), about the middle of the disc.
        let expected = position.y + 0.1 * (1.0 - position.x) + direction.y;
        assert!((once[(sample, 0)] - expected).abs() < 1e-12);
    }
}

#[test]
fn isotropic_light_lights_the_walls_by_the_disc_they_see() {
    let grid = grid();
    for form in TubeForm::ALL {
        let wall = TubeWall::new(form, 8);
        for opening in form.openings() {
            let response = tube_wall_response(&grid, &isotropic(&grid), &wall, opening);
            let (mut difference, mut whole) = (0.0, 0.0);
            for (k, texel) in wall.texels.iter().enumerate() {
                const RAYS: u32 = 1 << 13;
                let at = &texel.center;
                let leaving = (0..RAYS).filter(|&ray| {
                    let square = square_from_unit(sobol_point(ray, k as u32));
                    let toward = direction_around(at, cosine_hemisphere_from_square(square));
                    form.first_hit(at.position, toward).opening == Some(opening)
                });
                let exact = PI * leaving.count() as f64 / f64::from(RAYS);
                difference += (response[(k, 0)] - exact) * (response[(k, 0)] - exact);
                whole += exact * exact;
            }
            // The rays themselves err by some 1e-3.
            let error = (difference / whole).sqrt();
            assert!(error < 3e-3, "{form:?} {opening}: {error}");
        }
    }
}

#[test]
fn passages_gain_no_flux_and_light_that_fills_a_tube_stays_isotropic() {
    let grid = grid();
    let entering = isotropic(&grid);
    for passage in [TubePassage::STRAIGHT, TubePassage::LEFT, TubePassage::RIGHT] {
        let sent = tube_propagated(&grid, &entering, passage);
        assert!(sent.frobenius_norm() < entering.frobenius_norm());
        // Walls of unit radiosity fill what the entry leaves dark: together unit radiance.
        let wall = TubeWall::new(passage.form, 8);
        let emitted = tube_emitted_lightfield(&grid, &wall, passage.exit, &uniform(&wall));
        for ((s, e), whole) in sent.data().iter().zip(emitted.data()).zip(entering.data()) {
            assert!((s + e * PI - whole).abs() < 1e-12 * whole + 1e-15);
        }
    }
}

#[test]
fn right_is_the_mirror_of_left() {
    let grid = grid();
    let field = Matrix::from_fn(grid.sample_count(), 1, |sample, _| {
        grid.root_weight(sample) * f64::from((sample % 97) as u32)
    });
    let left = tube_propagated(&grid, &field, TubePassage::LEFT);
    let entering = mirrored(&grid, &field);
    let right = mirrored(
        &grid,
        &tube_propagated(&grid, &entering, TubePassage::RIGHT),
    );
    let difference: f64 = left
        .data()
        .iter()
        .zip(right.data())
        .map(|(a, b)| (a - b).abs())
        .sum();
    let whole: f64 = left.data().iter().map(|a| a.abs()).sum();
    // Mirrored rays differ by rounding, which decides only at the rim of the opening.
    assert!(difference < 1e-6 * whole, "{}", difference / whole);
}

/// Error of the chain of section 5.1 without reduction (source, passages, response) against rays.
fn chain_error(
    grid: &LightfieldGrid,
    chain: &[TubePassage],
    (receiver, entry): (TubeForm, Face),
) -> f64 {
    let wall = TubeWall::new(TubeForm::Bend, 8);
    let source = Source {
        radiosity: smooth_radiosity(&wall),
        wall,
        exit: Face::PosZ,
    };
    let mut field = tube_emitted_lightfield(grid, &source.wall, source.exit, &source.radiosity);
    for &passage in chain {
        field = tube_propagated(grid, &field, passage);
    }
    let receiver = TubeWall::new(receiver, 8);
    let found = tube_wall_response(grid, &field, &receiver, entry);
    let exact = traced_response(&source, chain, &receiver, entry);
    relative_error(&receiver, found.data(), &exact)
}

#[test]
fn the_chain_reaches_what_rays_reach() {
    let grid = grid();
    let straight = (TubeForm::Straight, Face::NegX);
    let bend = (TubeForm::Bend, Face::PosX);
    // Bounds are twice what was measured; each passage interpolates the lightfield once more.
    for (chain, receiver, bound) in [
        (vec![], straight, 0.02),
        (vec![], bend, 0.02),
        (vec![TubePassage::STRAIGHT], bend, 0.05),
        (vec![TubePassage::LEFT], straight, 0.05),
        (
            vec![TubePassage::STRAIGHT, TubePassage::RIGHT],
            straight,
            0.1,
        ),
    ] {
        let error = chain_error(&grid, &chain, receiver);
        println!("{chain:?} {receiver:?}: {error:.4}");
        assert!(error < bound, "{chain:?} {receiver:?}: {error}");
    }
}

#[test]
fn reduced_operators_follow_the_full_ones() {
    let config = LightfieldConfig {
        positions: 6,
        directions: 12,
        lightfield_modes: 48,
        ..LightfieldConfig::default()
    };
    let grid = LightfieldGrid::on_discs(&config);
    let walls = TubeForm::ALL.map(|form| TubeWall::new(form, 8));
    // One emitter a chart: coarse stand-ins for the modes of a bake.
    let charts = Matrix::from_fn(walls[0].texels.len(), 16, |texel, k| {
        let [chart, j, i] = [texel / 64, texel / 8 % 8, texel % 8].map(|x| x as f64);
        let chart = (chart - (k / 4) as f64).abs() < 0.5;
        f64::from(u8::from(chart)) * [1.0, i / 8.0, j / 8.0, i * j / 64.0][k % 4]
    });
    let columns: Vec<Matrix<f64>> = walls
        .iter()
        .flat_map(|wall| wall.form.openings().map(|opening| (wall, opening)))
        .map(|(wall, opening)| tube_emitted_lightfield(&grid, wall, opening, &charts))
        .collect();
    let progress = Progress::silent();
    let modes = config.lightfield_modes;
    let plain = lightfield_basis(&grid, &columns, modes, &progress).expect("nobody cancels");
    let basis = tube_enriched_basis(&grid, &plain, &config, &progress).expect("nobody cancels");
    let operators = tube_interface(&grid, &basis, &progress).expect("nobody cancels");
    // A quarter turn loses only what the truncated basis does not hold.
    let turned = transpose_multiply(operators.roll.view(), operators.roll.view());
    let first = turned[(0, 0)];
    assert!((first - 1.0).abs() < 0.02, "{first}");
    for wall in &walls {
        let openings = wall.form.openings();
        let [a, b] = openings.map(|opening| tube_response(&grid, &basis, wall, opening, 16));
        for (x, y) in a.singular_values.iter().zip(&b.singular_values).take(16) {
            // The two openings are mirror images.
            assert!((x - y).abs() < 1e-6 * a.singular_values[0]);
        }
        let field = columns[0].leading_columns(1);
        let coefficients = lightfield_coefficients(&basis, &field);
        let response = multiply(a.response_from_lightfield.view(), coefficients.view());
        let found = multiply(a.response_basis.view(), response.view());
        let exact = tube_wall_response(&grid, &field, wall, openings[0]);
        let error = relative_error(wall, found.data(), exact.data());
        assert!(error < 0.05, "{:?}: {error}", wall.form);
    }
}

/// Times of a whole bake; `cargo test -- --ignored --nocapture whole_set`.
#[test]
#[ignore = "prints times, checks nothing"]
fn whole_set() {
    use crate::config::BakeConfig;
    use crate::modular::transport::tube::tube_transport;
    let start = std::time::Instant::now();
    let lap = |what: &str| println!("{:7.1} s  {what}", start.elapsed().as_secs_f64());
    let progress = Progress::silent();
    let bake = BakeConfig::preset_for("standard", "cylinders").expect("a preset");
    let config = &bake.lightfield;
    let grid = LightfieldGrid::on_discs(config);
    let walls = TubeForm::ALL.map(|form| TubeWall::new(form, bake.resolution));
    let mut columns = Vec::new();
    for wall in &walls {
        let transport = tube_transport(wall, &bake, &progress).expect("runs");
        lap("transport");
        println!("dropped energy {:.2e}", transport.dropped_energy);
        let radiosity = &transport.implicit_lighting;
        for opening in wall.form.openings() {
            columns.push(tube_emitted_lightfield(&grid, wall, opening, radiosity));
        }
        lap("emitted lightfields");
    }
    let plain = lightfield_basis(&grid, &columns, config.lightfield_modes, &progress);
    let plain = plain.expect("runs");
    lap("basis");
    let basis = tube_enriched_basis(&grid, &plain, config, &progress).expect("runs");
    lap("enriched basis");
    println!("dropped energy {:.2e}", basis.dropped_energy);
    tube_interface(&grid, &basis, &progress).expect("runs");
    lap("interface");
    for wall in &walls {
        for opening in wall.form.openings() {
            let response = tube_response(&grid, &basis, wall, opening, 32);
            lap("response");
            println!("dropped energy {:.2e}", response.dropped_energy);
        }
    }
}
