//! Levels with warped blocks, end to end through a frame, for each transport that a block may have: against the
//! exact solver.

mod common;

use common::{in_level_order, solved, sphere};
use glam::{DMat3, DVec3, Vec3};
use mrt_core::cube::{CubeRotation, Face};
use mrt_core::hexahedron::Hexahedron;
use mrt_dictionary::bake::bake;
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::progress::Progress;
use mrt_dictionary::variants::{OpeningTransfer, VariantConfig, VariantError, make_variants};
use mrt_runtime::assemble::{AssembleConfig, AssembleError, assemble};
use mrt_runtime::dictionary::{Dictionary, WarpTransport};
use mrt_runtime::frame::{Bounces, Frame};
use mrt_runtime::level::{Block, Connection, Level, Opening};
use mrt_runtime::shape::Shape;
use mrt_tests::exact::direct::{PointLight, direct_quarters};
use mrt_tests::exact::solve::solve;
use mrt_tests::exact::transport::Transport;
use mrt_tests::exact::{ExactScene, Side};
use std::sync::OnceLock;

/// As the standard preset, at half the resolution and without what the tests do not read: some seconds.
fn dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        let mut config = BakeConfig::preset("standard").expect("a preset");
        config.resolution = RESOLUTION;
        config.outputs.probes = 2;
        config.lightfield.positions = 4;
        config.lightfield.directions = 8;
        config.lightfield.super_samples = 1;
        config.lightfield.lightfield_modes = 8;
        config.lightfield.enrichment_rounds = 0;
        bake(&config, &Progress::silent()).expect("nobody cancels")
    })
}

const RESOLUTION: usize = 8;
const ALBEDO: f32 = 0.6;

/// Cubes side by side along x, every one stretched by its length; a light in the first.
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
    let connections = (1..lengths.len()).map(|k| Connection {
        a: Opening {
            block: k - 1,
            face: Face::PosX,
        },
        b: Opening {
            block: k,
            face: Face::NegX,
        },
    });
    Level {
        connections: connections.collect(),
        blocks,
        doors: Vec::new(),
    }
}

/// Moves every corner.
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

/// Indirect light of a frame, one channel.
fn indirect(level: &Level, light: DVec3, openings: OpeningTransfer) -> Vec<f64> {
    let config = VariantConfig {
        openings,
        ..VariantConfig::default()
    };
    let mut dictionary = dictionary().clone();
    dictionary.variants =
        make_variants(level, &dictionary, &config, &Progress::silent()).expect("sound input");
    let scene = assemble(level, &dictionary, &AssembleConfig::default()).expect("a sound level");
    let light = sphere(light.as_vec3(), RADIUS as f32, Vec3::ONE);
    let frame = solved(&scene, &[light], Bounces::Count(BOUNCES as u32));
    in_level_order(level, &scene, frame.indirect())
        .into_iter()
        .map(|rgb| f64::from(rgb[0]))
        .collect()
}

const RADIUS: f64 = 0.15;
const BOUNCES: usize = 12;

struct Exact {
    scene: ExactScene,
    transport: Transport,
}

impl Exact {
    fn new(level: &Level) -> Self {
        let neighbours = level.neighbours();
        let sides = level.blocks.iter().zip(&neighbours).map(|(block, beyond)| {
            Face::ALL.map(|face| match beyond[face.index()] {
                Some(there) => Side::Opening(there.block, there.face),
                None if block.is_open(face) => Side::Sky,
                None => Side::Wall,
            })
        });
        let blocks = level.blocks.iter().map(|block| block.warp).collect();
        let scene = ExactScene::new(blocks, sides.collect(), RESOLUTION).expect("a sound level");
        let transport = Transport::build(&scene);
        Self { scene, transport }
    }

    fn indirect(&self, light: DVec3) -> Vec<f64> {
        let light = PointLight {
            position: light,
            intensity: 1.0,
            radius: RADIUS,
        };
        let direct = direct_quarters(&self.scene, &light, 4);
        let albedo = vec![f64::from(ALBEDO); self.scene.texel_count()];
        let bounces = mrt_tests::Bounces::Count(BOUNCES);
        solve(&self.scene, &self.transport, &direct, bounces, &albedo).expect("sizes fit")
    }
}

/// Relative L2 by area and relative level: of everything, and of each block.
fn errors(level: &Level, exact: &Exact, found: &[f64], truth: &[f64]) -> Vec<(f64, f64)> {
    let mut ranges = vec![0..truth.len()];
    let mut start = 0;
    for block in &level.blocks {
        let end = start + block.shape.texel_count(RESOLUTION);
        ranges.push(start..end);
        start = end;
    }
    ranges
        .into_iter()
        .map(|range| {
            let (mut miss, mut size, mut sum, mut expected) = (0.0, 0.0, 0.0, 0.0);
            for k in range {
                let area = exact.scene.areas()[k];
                miss += area * (found[k] - truth[k]) * (found[k] - truth[k]);
                size += area * truth[k] * truth[k];
                sum += area * found[k];
                expected += area * truth[k];
            }
            ((miss / size).sqrt(), sum / expected - 1.0)
        })
        .collect()
}

#[test]
fn table() {
    let shear = |p: DVec3| p + DVec3::new(0.0, 0.0, 0.5 * p.y);
    let cases = [
        ("hall 4", corridor(&[4.0])),
        ("cubes 3", corridor(&[1.0, 1.0, 1.0])),
        ("2 2", corridor(&[2.0, 2.0])),
        ("2 2 2", corridor(&[2.0, 2.0, 2.0])),
        ("1 4", corridor(&[1.0, 4.0])),
        ("4 1", corridor(&[4.0, 1.0])),
        ("3 .5 3", corridor(&[3.0, 0.5, 3.0])),
        ("1 2 1 2", corridor(&[1.0, 2.0, 1.0, 2.0])),
        (
            "tall 2",
            mapped(&corridor(&[1.0, 1.0, 1.0]), |p| {
                p * DVec3::new(1.0, 2.0, 1.0)
            }),
        ),
        ("shear 3", mapped(&corridor(&[1.0, 1.0, 1.0]), shear)),
    ];
    for (name, level) in cases {
        let exact = Exact::new(&level);
        let warp = &level.blocks[0].warp;
        for unit in [DVec3::new(0.4, 0.55, 0.45)] {
            let light = warp.point(unit);
            let truth = exact.indirect(light);
            for transport in WarpTransport::ALL {
                for openings in [OpeningTransfer::Scaled, OpeningTransfer::Viewed] {
                    let level = with_transport(&level, transport);
                    let found = indirect(&level, light, openings);
                    let e: Vec<String> = errors(&level, &exact, &found, &truth)
                        .iter()
                        .map(|(l2, level)| format!("{:5.1} ({:+5.1})", 100.0 * l2, 100.0 * level))
                        .collect();
                    println!(
                        "{name:8} {:10} {openings:?} {}",
                        transport.name(),
                        e.join("  ")
                    );
                    if transport == WarpTransport::Canonical {
                        break;
                    }
                }
            }
        }
    }
}
