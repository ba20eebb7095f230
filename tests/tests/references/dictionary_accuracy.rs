//! Dictionaries of all presets against the reference files. The bounds are those that the project promises.

use glam::Vec3;
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::error_measure::{HOP_GROUPS, rel_l2, rel_l2_by_hop};
use mrt_core::reference::oracle_file::{Kind, RGB_BOUNCES, ReferenceFile, WHITE_LEVELS};
use mrt_dictionary::config::PriorConfig;
use mrt_dictionary::modular::light_prior::basis::light_prior;
use mrt_dictionary::modular::light_prior::cube::direct_samples;
use mrt_dictionary::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
use mrt_dictionary::modular::surface::mirrors::cube::texel_parity_classes;
use mrt_dictionary::modular::transport::modes::{block_transport, fold_bounce};
use mrt_dictionary::progress::Progress;
use mrt_runtime::blocks::Shape;
use mrt_runtime::{
    AssembleConfig, AssembleError, BlockIndex, Bounces, Coupling, Dictionary, Frame, Level, Light,
};
use mrt_tests::{CONVERGED, baked, configured, default_dictionary, reference, refusal, solved};
use std::sync::OnceLock;

/// Our indirect irradiance and the reference's, in the reference's order of texels and channels.
struct Pair {
    ours: Vec<f64>,
    theirs: Vec<f64>,
}

impl Pair {
    fn error(&self) -> f64 {
        rel_l2(&self.ours, &self.theirs)
    }
}

/// The reference's level with its own colours, or with this albedo if it has none.
fn level(reference: &ReferenceFile, albedo: f64) -> Level {
    let mut level = Level::from_cells(&reference.cells, Vec3::splat(albedo as f32))
        .expect("the dictionary has the shapes");
    if let Kind::IrradianceRgb { albedo } = &reference.kind {
        for (&(cell, face), colour) in reference.walls.iter().zip(albedo) {
            level.blocks[cell].albedo[face.index()] = Vec3::from_array(colour.map(|c| c as f32));
        }
    }
    level
}

/// Solves a reference's level with one of its lights after another. `albedo` is for files without colours.
fn solve_all(
    reference: &ReferenceFile,
    dictionary: &Dictionary,
    coupling: Coupling,
    bounces: ReferenceBounces,
    albedo: f64,
) -> Vec<Pair> {
    let level = level(reference, albedo);
    let config = AssembleConfig {
        coupling,
        ..AssembleConfig::default()
    };
    let scene = configured(&level, dictionary, &config);
    let coloured = matches!(reference.kind, Kind::IrradianceRgb { .. });
    let passes = match bounces {
        ReferenceBounces::First => Bounces::Count(1),
        // Coloured files have no more bounces.
        _ if coloured => Bounces::Count(RGB_BOUNCES as u32),
        _ => CONVERGED,
    };
    (0..reference.lights.len())
        .map(|light| {
            let position = reference.lights[light].as_vec3();
            let source = Light::sphere(position, 0.0, Vec3::splat(reference.intensity as f32));
            let frame = solved(&scene, &[source], passes);
            let ours = at_reference_texels(reference, &frame);
            let (ours, theirs): (Vec<f64>, Vec<f64>) = if coloured {
                let theirs = reference
                    .indirect_irradiance_rgb(light, bounces)
                    .expect("the file has the term");
                let ours = ours.as_flattened().iter().map(|&e| f64::from(e));
                (ours.collect(), theirs.as_flattened().to_vec())
            } else {
                let theirs = reference
                    .indirect_irradiance(light, bounces, albedo)
                    .expect("the file has the term");
                (ours.iter().map(|e| f64::from(e[0])).collect(), theirs)
            };
            Pair { ours, theirs }
        })
        .collect()
}

/// The lightmap at the centres of the reference's texels, in its order, looked up as a game does. Where the lightmap has the
/// reference's resolution, this gives its texels.
fn at_reference_texels(reference: &ReferenceFile, frame: &Frame) -> Vec<[f32; 3]> {
    let scene = frame.scene();
    let resolution = reference.resolution.expect("surfaces, no probes");
    let mut out = Vec::new();
    for &(block, face) in &reference.walls {
        let canonical = scene.level.blocks[block].orientation.inverse();
        let wall = canonical.face(face);
        for texel in 0..resolution * resolution {
            let center = face.texel_center(resolution, texel / resolution, texel % resolution);
            let point = canonical.point(center).as_vec3();
            let pixel = scene
                .atlas
                .pixel(
                    BlockIndex::new(block),
                    wall,
                    point[wall.u_axis()],
                    point[wall.v_axis()],
                )
                .expect("walls of the reference are walls of the level");
            out.push(scene.atlas.sample(frame.lightmap().pixels(), pixel));
        }
    }
    out
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// The dictionary of a preset: the committed one, or baked once.
fn preset(name: &str) -> &'static Dictionary {
    static MOBILE: OnceLock<Dictionary> = OnceLock::new();
    static HIGH: OnceLock<Dictionary> = OnceLock::new();
    static QUALITY: OnceLock<Dictionary> = OnceLock::new();
    let cell = match name {
        "standard" => return default_dictionary(),
        "mobile" => &MOBILE,
        "high" => &HIGH,
        "quality" => &QUALITY,
        other => panic!("no preset {other}"),
    };
    cell.get_or_init(|| baked(name, "cubes-2d", |_| ()))
}

/// Errors of the first bounce in white levels, means over all lights: of whole levels, and of blocks at 0, 1, 2, and 3 or
/// more openings from the light.
fn first_bounce_errors(dictionary: &Dictionary, coupling: Coupling) -> [f64; 1 + HOP_GROUPS] {
    let mut groups: [Vec<f64>; 1 + HOP_GROUPS] = Default::default();
    for name in WHITE_LEVELS {
        let reference = reference(name);
        let pairs = solve_all(
            &reference,
            dictionary,
            coupling,
            ReferenceBounces::First,
            1.0,
        );
        for (light, pair) in pairs.iter().enumerate() {
            groups[0].push(pair.error());
            let hops = reference.hops(light).expect("the light is in the file");
            let errors = rel_l2_by_hop(&pair.ours, &pair.theirs, &hops);
            for (all, error) in groups[1..].iter_mut().zip(errors) {
                all.extend(error);
            }
        }
    }
    let means = groups.map(mean);
    println!(
        "first bounce, {}, {coupling:?}: whole {:.4}, hops {:.4?}",
        dictionary.preset,
        means[0],
        &means[1..]
    );
    means
}

/// Checks a preset against bounds for whole levels, and for 1, 2, and 3 or more openings.
fn check_first_bounce(name: &str, bounds: [f64; 4]) {
    let [whole, _, one, two, more] = first_bounce_errors(preset(name), Coupling::Table);
    for (what, error, bound) in [
        ("whole level", whole, bounds[0]),
        ("one opening", one, bounds[1]),
        ("two openings", two, bounds[2]),
        ("three or more openings", more, bounds[3]),
    ] {
        assert!(error <= bound, "{name}, {what}: {error}, expected {bound}");
    }
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn the_first_bounce_of_the_standard_preset_is_within_the_bounds() {
    check_first_bounce("standard", [0.020, 0.022, 0.030, 0.06]);
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn the_first_bounce_of_the_mobile_preset_is_within_the_bounds() {
    check_first_bounce("mobile", [0.08, 0.09, 0.10, 0.14]);
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn the_first_bounce_of_the_high_preset_is_within_the_bounds() {
    // Measured: 0.64, 0.93, 1.68 and 3.90 %. This preset takes half the time of the quality preset.
    check_first_bounce("high", [0.008, 0.013, 0.018, 0.04]);
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn the_first_bounce_of_the_quality_preset_is_within_the_bounds() {
    check_first_bounce("quality", [0.008, 0.009, 0.015, 0.04]);
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn tables_of_paths_err_no_more_than_lightfields() {
    let table = first_bounce_errors(default_dictionary(), Coupling::Table);
    let fields = first_bounce_errors(default_dictionary(), Coupling::Lightfield);
    for openings in [2, 3] {
        let (table, fields) = (table[1 + openings], fields[1 + openings]);
        assert!(
            table <= fields,
            "{openings} openings: {table}, lightfields {fields}"
        );
    }
    // Lightfields, which are the paper's method, have bounds of their own.
    assert!(fields[0] <= 0.030, "whole level {}", fields[0]);
    assert!(fields[2] <= 0.04, "one opening {}", fields[2]);
    assert!(fields[3] <= 0.08, "two openings {}", fields[3]);
    assert!(fields[4] <= 0.20, "three or more openings {}", fields[4]);
}

/// Mean error of all bounces, over all lights of the white levels.
fn all_bounces_error(dictionary: &Dictionary, albedo: f64) -> f64 {
    let error = mean(WHITE_LEVELS.iter().flat_map(|name| {
        let reference = reference(name);
        solve_all(
            &reference,
            dictionary,
            Coupling::Table,
            ReferenceBounces::All,
            albedo,
        )
        .iter()
        .map(Pair::error)
        .collect::<Vec<_>>()
    }));
    println!(
        "all bounces at albedo {albedo}, {}: {error:.4}",
        dictionary.preset
    );
    error
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn all_bounces_in_white_levels_are_within_the_bounds() {
    for (name, albedo, bound) in [
        ("standard", 0.5, 0.02),
        ("standard", 0.8, 0.02),
        ("standard", 0.9, 0.02),
        // The remaining error is that of the references: their later bounces scatter by about 1 % a texel, and those beyond
        // the sixth are extrapolated. The mean over these six files is 1.205 %. With `stack3`, which has 0.81 % (`mrt
        // accuracy --set cubes-3d --preset quality --bounces all`), the mean over seven files is 1.15 %.
        ("quality", 0.8, 0.0123),
    ] {
        let error = all_bounces_error(preset(name), albedo);
        assert!(error <= bound, "{name}, albedo {albedo}: {error}");
    }
}

/// Mean error over all lights of a coloured reference.
fn coloured_error(name: &str, dictionary: &Dictionary, bounces: ReferenceBounces) -> f64 {
    let reference = reference(name);
    let pairs = solve_all(&reference, dictionary, Coupling::Table, bounces, 1.0);
    mean(pairs.iter().map(Pair::error))
}

const COLOURED: [&str; 3] = ["cube_one_white", "cube_cornell", "corridor5_painted"];

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn coloured_walls_are_within_the_bounds() {
    for (name, bounds) in [("standard", [0.06, 0.04]), ("quality", [0.03, 0.02])] {
        for (bounces, bound) in [ReferenceBounces::First, ReferenceBounces::All]
            .into_iter()
            .zip(bounds)
        {
            let errors = COLOURED.map(|file| coloured_error(file, preset(name), bounces));
            let error = mean(errors);
            println!("coloured, {name}, {bounces:?}: {error:.4} of {errors:.4?}");
            assert!(error <= bound, "{name}, {bounces:?}: {error} of {errors:?}");
        }
    }
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn a_white_wall_among_dark_ones_keeps_its_brightness() {
    let reference = reference("cube_one_white");
    let Kind::IrradianceRgb { albedo } = &reference.kind else {
        panic!("cube_one_white has colours");
    };
    // The white wall is the one whose darkest channel is the brightest.
    let darkest = |wall: usize| albedo[wall].iter().copied().fold(f64::MAX, f64::min);
    let white = (0..albedo.len())
        .max_by(|&a, &b| darkest(a).total_cmp(&darkest(b)))
        .expect("there are walls");
    for bounces in [ReferenceBounces::First, ReferenceBounces::All] {
        let pairs = solve_all(
            &reference,
            default_dictionary(),
            Coupling::Table,
            bounces,
            1.0,
        );
        for (light, pair) in pairs.iter().enumerate() {
            let per_wall = pair.ours.len() / albedo.len();
            let wall = white * per_wall..(white + 1) * per_wall;
            let sum = |values: &[f64]| values[wall.clone()].iter().sum::<f64>();
            let ratio = sum(&pair.ours) / sum(&pair.theirs);
            println!("{bounces:?}, light {light}: mean on the white wall x {ratio:.4}");
            assert!(
                (ratio - 1.0).abs() <= 0.05,
                "{bounces:?}, light {light}: {ratio}"
            );
        }
    }
}

/// Mean error of the first bounce in the closed cube, with this number of modes of a light prior without enrichment.
fn unenriched_error(reference: &ReferenceFile, modes: usize) -> f64 {
    let resolution = reference.resolution.expect("surfaces, no probes");
    let shape = Shape::from_name("closed").expect("the shape is known");
    let classes = texel_parity_classes(shape, resolution);
    let closed = closed_cube_bounce(resolution, Reconstruction::Constant, &Progress::silent())
        .expect("nobody cancels");
    let folded = fold_bounce(&closed, &classes);
    let samples = direct_samples(shape, resolution, &PriorConfig::default());
    let prior = light_prior(&samples, &classes, usize::MAX);
    let transport = block_transport(&folded, &folded, &prior.basis, &classes, modes);
    let texels: Vec<_> = shape.texels(resolution).collect();
    mean((0..reference.lights.len()).map(|light| {
        let direct: Vec<f64> = texels
            .iter()
            .map(|&(face, point)| {
                let offset = reference.lights[light] - point;
                reference.intensity * sphere_light_irradiance(offset, -face.outward(), 0.0)
            })
            .collect();
        let direct = Matrix::from_column_major(direct.len(), 1, direct);
        let coefficients = multiply(transport.coefficients_from_direct.view(), direct.view());
        let ours = multiply(transport.indirect_basis.view(), coefficients.view());
        let theirs = reference
            .indirect_irradiance(light, ReferenceBounces::First, 1.0)
            .expect("the file has the term");
        rel_l2(ours.data(), &theirs)
    }))
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn modes_without_enrichment_are_within_the_bounds_in_a_closed_cube() {
    let cube = reference("cube");
    for (modes, bound) in [(32, 0.031), (64, 0.010)] {
        let error = unenriched_error(&cube, modes);
        println!("{modes} plain modes: {error:.4}");
        assert!(error <= bound, "{modes} modes: {error}");
    }
}

#[test]
#[cfg_attr(not(has_oracle), ignore = "needs the folder shared/oracle")]
fn a_stack_of_blocks_is_refused_by_name() {
    let stack = reference("stack3");
    // The default dictionary has no openings upwards.
    let error = refusal(&level(&stack, 1.0), default_dictionary());
    assert!(
        matches!(
            error,
            AssembleError::MissingShape { .. } | AssembleError::RolledInterface { .. }
        ),
        "{error}"
    );
}
