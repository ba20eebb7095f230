//! Levels with warped blocks, through whole frames, against the exact solver, for each transport that a block may have.

use glam::{DMat3, DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::lighting::sh::{rotate, rotation_matrices};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::radiosity::ExactScene;
use mrt_core::reference::radiosity::direct::{PointLight, direct_quarters};
use mrt_core::reference::radiosity::quarters::mean_of_quarters;
use mrt_core::reference::radiosity::solve::solve;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_dictionary::modular::variants::advice::{Thresholds, estimate_blocks};
use mrt_dictionary::modular::variants::build::{VariantConfig, VariantError, make_variants};
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_runtime::blocks::{Block, Shape, WarpTransport};
use mrt_runtime::{
    AssembleConfig, AssembleError, Bounces, Dictionary, Frame, FrameConfig, Level, Scene,
};
use mrt_tests::warped::{rel_l2_by, total};
use mrt_tests::{
    FrameForTests, baked, connected, exact_of, from_level_order, in_level_order, refusal, scene_of,
    set_lightfields, with_threads,
};
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

const RESOLUTION: usize = 8;
const ALBEDO: f32 = 0.6;
/// Radius of the light, metres.
const RADIUS: f64 = 0.15;
const BOUNCES: usize = 12;
/// The light, in the unit cube of the first block.
const LIGHT: DVec3 = DVec3::new(0.4, 0.55, 0.45);

/// The standard preset at half its resolution, without what these tests do not use. The bake takes some seconds.
fn dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("standard", "cubes-2d", |config| {
            config.resolution = RESOLUTION;
            config.outputs.probes = 2;
            config.lightfield.super_samples = 1;
            config.lightfield.enrichment_rounds = 0;
            set_lightfields(config, 4, 8, 8);
        })
    })
}

/// A row of cubes along x, each stretched to its length.
fn corridor(lengths: &[f64]) -> Level {
    let shape = |name: &str| Shape::from_name(name).expect("a shape");
    let mut blocks = Vec::new();
    let mut start = 0.0;
    for (index, &length) in lengths.iter().enumerate() {
        let (name, orientation) = match index {
            0 if lengths.len() == 1 => ("closed", "+x+y"),
            0 => ("dead_end", "+x+y"),
            _ if index + 1 == lengths.len() => ("dead_end", "-x+y"),
            _ => ("straight", "+x+y"),
        };
        let orientation = CubeRotation::from_name(orientation).expect("a rotation");
        let low = DVec3::new(start, 0.0, 0.0);
        let warp = Hexahedron::cuboid(low, low + DVec3::new(length, 1.0, 1.0));
        blocks.push(Block::new(
            shape(name),
            orientation,
            warp,
            Vec3::splat(ALBEDO),
        ));
        start += length;
    }
    let connections = (1..lengths.len()).map(|k| connected(k - 1, Face::PosX, k));
    Level {
        connections: connections.collect(),
        blocks,
        doors: Vec::new(),
        mesh: None,
    }
}

/// The level with all corners moved.
fn mapped(level: &Level, map: impl Fn(DVec3) -> DVec3) -> Level {
    let mut level = level.clone();
    for block in &mut level.blocks {
        block.warp.corners = block.warp.corners.map(&map);
    }
    level
}

fn with_transport(level: &Level, transport: WarpTransport) -> Level {
    let mut level = level.clone();
    for block in &mut level.blocks {
        block.transport = transport;
    }
    level
}

/// The dictionary with the variants that the level needs.
fn adapted(level: &Level) -> Dictionary {
    let mut dictionary = dictionary().clone();
    let config = VariantConfig::default();
    dictionary.variants =
        make_variants(level, &dictionary, &config, &Progress::silent()).expect("sound input");
    dictionary
}

/// Indirect irradiance of a frame in the first channel, in the order of the exact solver.
///
/// Direct light is the exact solver's, averaged over texels. With eight texels a wall, direct light at the texels' centres
/// would err by more than what these tests measure.
fn indirect(level: &Level, direct: &[f64]) -> Vec<f64> {
    let scene = scene_of(level, &adapted(level));
    let direct: Vec<[f32; 3]> = direct.iter().map(|&e| [e as f32; 3]).collect();
    let mut frame = Frame::new(&scene, FrameConfig::default());
    frame.light_from(
        &from_level_order(level, &scene, &direct),
        Bounces::Count(BOUNCES as u32),
    );
    let indirect = in_level_order(level, &scene, &frame.indirect());
    indirect.iter().map(|rgb| f64::from(rgb[0])).collect()
}

struct Exact {
    scene: ExactScene,
    transport: Transport,
}

/// Irradiance of all texels.
struct ExactLight {
    /// Means over the texels.
    direct: Vec<f64>,
    indirect: Vec<f64>,
}

impl Exact {
    fn new(level: &Level) -> Self {
        let scene = exact_of(level, RESOLUTION);
        let transport = Transport::build(&scene);
        Self { scene, transport }
    }

    /// The light of a lamp at [`LIGHT`].
    fn lit(&self) -> ExactLight {
        let light = PointLight {
            position: self.scene.blocks()[0].point(LIGHT),
            intensity: 1.0,
            radius: RADIUS,
        };
        let quarters = direct_quarters(&self.scene, &light, 4);
        let albedo = vec![f64::from(ALBEDO); self.scene.texel_count()];
        let bounces = ReferenceBounces::Count(BOUNCES);
        let indirect = solve(&self.scene, &self.transport, &quarters, bounces, &albedo);
        ExactLight {
            direct: quarters.iter().map(mean_of_quarters).collect(),
            indirect: indirect.expect("sizes fit"),
        }
    }
}

/// Errors of light, weighted by area.
struct Error {
    /// Relative L2 error.
    l2: f64,
    /// Flux relative to the true flux, less 1.
    flux: f64,
}

/// Errors of a whole level and of each block.
struct Errors {
    whole: Error,
    blocks: Vec<Error>,
}

impl Errors {
    fn new(level: &Level, exact: &Exact, found: &[f64], truth: &[f64]) -> Self {
        let areas = exact.scene.areas();
        let error = |texels: Range<usize>| {
            let [areas, found, truth] = [areas, found, truth].map(|all| &all[texels.clone()]);
            Error {
                l2: rel_l2_by(areas, found, truth),
                flux: total(areas, found) / total(areas, truth) - 1.0,
            }
        };
        let mut end = 0;
        let blocks = level.blocks.iter().map(|block| {
            let start = end;
            end += block.shape.texel_count(RESOLUTION);
            error(start..end)
        });
        Self {
            blocks: blocks.collect(),
            whole: error(0..truth.len()),
        }
    }

    fn last_block(&self) -> &Error {
        self.blocks.last().expect("a level has blocks")
    }

    fn all(&self) -> impl Iterator<Item = &Error> {
        std::iter::once(&self.whole).chain(&self.blocks)
    }
}

/// Errors of canonical, re-gathered and rebuilt transport, printed as a table.
fn measured(name: &str, level: &Level) -> [Errors; 3] {
    let exact = Exact::new(level);
    let light = exact.lit();
    WarpTransport::ALL.map(|transport| {
        let found = indirect(&with_transport(level, transport), &light.direct);
        let errors = Errors::new(level, &exact, &found, &light.indirect);
        let cells: Vec<String> = errors
            .all()
            .map(|error| format!("{:.1} ({:+.1})", 100.0 * error.l2, 100.0 * error.flux))
            .collect();
        println!("| {name} | {} | {} |", transport.name(), cells.join(" | "));
        errors
    })
}

/// Bounds of relative L2 errors, measured and rounded up: of the whole level with each of the three transports, and of the
/// last block with re-gathered and rebuilt transport.
const BOUNDS: [[f64; 5]; 8] = [
    // Eight texels are coarse along a hall of length 4; `great_hall.rs` tests it with sixteen.
    [0.40, 0.14, 0.022, 0.14, 0.022],
    [0.48, 0.036, 0.013, 0.08, 0.022],
    [0.45, 0.105, 0.021, 0.04, 0.038],
    [0.25, 0.021, 0.013, 0.128, 0.128],
    [0.155, 0.014, 0.014, 0.17, 0.172],
    [0.12, 0.037, 0.033, 0.072, 0.075],
    [0.055, 0.020, 0.018, 0.033, 0.031],
    [0.075, 0.019, 0.019, 0.06, 0.06],
];

#[test]
fn every_transport_improves_on_the_one_before() {
    let flat = corridor(&[1.0, 1.0, 1.0]);
    let shear = mapped(&flat, |p| p + DVec3::new(0.0, 0.0, 0.5 * p.y));
    let bent = mapped(&flat, |p| p + DVec3::new(0.0, 0.2, 0.15) * (p.x * p.y));
    let cases = [
        ("hall 1:1:4", corridor(&[4.0]), BOUNDS[0]),
        (
            "dead end of 4 behind a cube",
            corridor(&[1.0, 4.0]),
            BOUNDS[1],
        ),
        ("corridor 4, 1", corridor(&[4.0, 1.0]), BOUNDS[2]),
        ("corridor 2, 2, 2", corridor(&[2.0, 2.0, 2.0]), BOUNDS[3]),
        (
            "corridor 1, 2, 1, 2",
            corridor(&[1.0, 2.0, 1.0, 2.0]),
            BOUNDS[4],
        ),
        (
            "twice as high",
            mapped(&flat, |p| p * DVec3::new(1.0, 2.0, 1.0)),
            BOUNDS[5],
        ),
        ("sheared by 0.5", shear, BOUNDS[6]),
        ("bent", bent, BOUNDS[7]),
    ];
    println!("| level | transport | whole level: L2 % (flux %) | block by block |");
    for (name, level, bounds) in cases {
        let found = measured(name, &level);
        let whole = found.each_ref().map(|errors| errors.whole.l2);
        let last = found.each_ref().map(|errors| errors.last_block().l2);
        for (k, bound) in bounds[..3].iter().enumerate() {
            assert!(whole[k] < *bound, "{name}, transport {k}: {}", whole[k]);
        }
        assert!(last[1] < bounds[3], "{name}: {}", last[1]);
        assert!(last[2] < bounds[4], "{name}: {}", last[2]);
        assert!(whole[1] < 0.75 * whole[0], "{name}: {whole:?}");
        // Where re-gathering is as exact as the basis allows, rebuilding may be worse by rounding.
        assert!(whole[2] < whole[1] + 0.005, "{name}: {whole:?}");
    }
}

#[test]
fn adapting_the_stretched_blocks_is_enough() {
    let level = corridor(&[1.0, 2.0, 1.0]);
    let exact = Exact::new(&level);
    let light = exact.lit();
    let errors = |level: &Level| {
        let found = indirect(level, &light.direct);
        let errors = Errors::new(level, &exact, &found, &light.indirect);
        [errors.whole.l2, errors.last_block().l2]
    };
    let canonical = errors(&level);
    let mut mixed = level.clone();
    mixed.blocks[1].transport = WarpTransport::Regathered;
    let mixed = errors(&mixed);
    println!("canonical {canonical:.3?}, mixed {mixed:.3?}");
    assert!(mixed[0] < 0.25 * canonical[0]);
    assert!(mixed[1] < 0.25 * canonical[1]);
}

/// For a cube of any size and at any angle, re-gathered operators are the canonical ones.
#[test]
fn turned_and_scaled_cubes_need_nothing() {
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.4) * 3.0;
    let closed = mapped(&corridor(&[1.0]), |p| turn * p + DVec3::new(5.0, -2.0, 9.0));
    let corridor = mapped(&corridor(&[1.0, 1.0, 1.0]), |p| turn * p);
    // Warps are rounded to `f32`, and joint modes for light from other blocks are chosen anew.
    for (level, bound) in [(closed, 1e-5), (corridor, 0.01)] {
        let exact = Exact::new(&level);
        let direct = exact.lit().direct;
        let canonical = indirect(&level, &direct);
        let level = with_transport(&level, WarpTransport::Regathered);
        let found = indirect(&level, &direct);
        let errors = Errors::new(&level, &exact, &found, &canonical);
        for (k, error) in errors.all().enumerate() {
            assert!(error.l2 < bound, "error {k}: {}", error.l2);
        }
    }
}

/// Probes of variants use the axes of the level, however the block is turned.
#[test]
fn probes_of_turned_cubes_are_turned() {
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.4);
    let level = mapped(&corridor(&[1.0]), |p| turn * p);
    let dictionary = adapted(&with_transport(&level, WarpTransport::Regathered));
    let found = &dictionary.variants[0].operators;
    let canonical = &dictionary.shapes[0];
    assert_eq!(found.shape, canonical.shape);
    let bands = rotation_matrices(3, &turn);
    for mode in 0..canonical.modes() {
        let columns = [&canonical.probe_basis, &found.probe_basis].map(|m| m.column(mode));
        let [expected, found] = columns.map(|c| c.chunks_exact(9));
        for (expected, found) in expected.zip(found) {
            let mut expected: Vec<f64> = expected.iter().map(|&x| f64::from(x)).collect();
            rotate(&bands, &mut expected);
            for (a, b) in found.iter().zip(&expected) {
                // Radiance of modes, up to about 1, in `f32`.
                assert!((f64::from(*a) - b).abs() < 1e-5, "{a} against {b}");
            }
        }
    }
}

#[test]
fn equal_blocks_share_operators_and_the_number_of_threads_changes_no_bit() {
    let level = with_transport(&corridor(&[2.0, 2.0, 2.0, 2.0]), WarpTransport::Rebuilt);
    let on = |threads| with_threads(threads, || adapted(&level));
    let dictionary = on(1);
    // One for the two dead ends, which face each other, and one for the two blocks between them.
    assert_eq!(dictionary.variants.len(), 2);
    let scene = scene_of(&level, &dictionary);
    let used: Vec<usize> = scene.blocks.iter().map(|b| b.shape_index).collect();
    assert_eq!(used, [0, 1, 1, 0]);
    assert_eq!(scene.shapes.len(), 2);
    assert_eq!(dictionary, on(3));
}

#[test]
fn missing_variants_shapes_and_sources_are_named() {
    let level = with_transport(&corridor(&[2.0, 2.0]), WarpTransport::Rebuilt);
    let error = refusal(&level, dictionary());
    let expected = AssembleError::MissingVariant {
        block: 0,
        shape: "dead_end",
        transport: "rebuilt",
    };
    assert!(expected.to_string().contains("adapted to this level"));
    assert_eq!(error, expected);
    // A variant for another warp or transport does not do.
    let other = with_transport(&corridor(&[3.0, 3.0]), WarpTransport::Rebuilt);
    let regathered = with_transport(&level, WarpTransport::Regathered);
    for wanted in [other, regathered] {
        let dictionary = adapted(&wanted);
        assert!(Scene::assemble(&wanted, &dictionary, &AssembleConfig::default()).is_ok());
        assert!(Scene::assemble(&level, &dictionary, &AssembleConfig::default()).is_err());
    }
    let make = |dictionary: &Dictionary| {
        let config = VariantConfig::default();
        make_variants(&level, dictionary, &config, &Progress::silent()).map(|_| ())
    };
    let mut packed = dictionary().clone();
    for shape in &mut packed.shapes {
        // A packed dictionary has no implicit lighting.
        shape.implicit_lighting = Matrix::zeros(0, shape.modes());
    }
    let no_sources = |found| Err(VariantError::NoSources { found });
    assert_eq!(make(&packed), no_sources("implicit lighting"));
    packed.sources = None;
    assert_eq!(make(&packed), no_sources("emission and response bases"));
    packed.shapes.retain(|entry| entry.shape.name == "closed");
    let missing = VariantError::MissingShape {
        block: 0,
        shape: "dead_end",
    };
    assert_eq!(make(&packed), Err(missing));
    let cancel = AtomicBool::new(true);
    let progress = Progress::new(&|_, _, _| {}, &cancel);
    let config = VariantConfig::default();
    let cancelled = make_variants(&level, dictionary(), &config, &progress).map(|_| ());
    assert_eq!(cancelled, Err(VariantError::Cancelled(Cancelled)));
}

#[test]
fn advice_is_canonical_for_cubes_and_rebuilt_for_long_halls() {
    let level = corridor(&[1.0, 6.0]);
    let estimates =
        estimate_blocks(&level, dictionary(), &Progress::silent()).expect("a full dictionary");
    println!("{estimates:.3?}");
    let advice = |k: usize| estimates[k].advice(&Thresholds::default());
    assert_eq!(advice(0), WarpTransport::Canonical);
    assert_eq!(advice(1), WarpTransport::Rebuilt);
    // F of the cube is computed twice, with and without the general warp; only rounding to single precision differs.
    assert!(estimates[0].added(WarpTransport::Canonical) < 1e-6);
    assert!((estimates[1].stretch - 6.0).abs() < 1e-12);
}
