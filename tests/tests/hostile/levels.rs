//! Levels from arbitrary text and in memory: every fault is a named error, and nothing panics.

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::HexahedronError;
use mrt_runtime::blocks::{Connection, Opening};
use mrt_runtime::{AssembleConfig, AssembleError, Level, LevelError, LevelTextError, Scene};
use mrt_tests::{corridor, default_dictionary, floor_plan, refusal};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// Two dead ends that face each other.
fn pair() -> Level {
    floor_plan(&corridor(2), 0.5)
}

/// The first fault that the check finds in [`pair`] after a change.
fn fault(change: impl FnOnce(&mut Level)) -> LevelError {
    let mut level = pair();
    change(&mut level);
    let error = level.check().expect_err("the level is faulty");
    // Assembly finds the same fault. Faults are compared as text, since NaN is not equal to itself.
    let same = |other: &LevelError| other.to_string() == error.to_string();
    let refusal = refusal(&level, default_dictionary());
    assert!(matches!(refusal, AssembleError::Level(other) if same(&other)));
    error
}

#[test]
fn faulty_geometry_is_named() {
    let overlap = fault(|level| {
        level.connections.clear();
        let corners = &mut level.blocks[1].warp.corners;
        *corners = corners.map(|c| c - DVec3::X * 0.3);
    });
    assert!(
        matches!(overlap, LevelError::Overlap { a: 0, b: 1, .. }),
        "{overlap}"
    );
    for (what, change) in [
        ("folded", (|c| *c = -*c - DVec3::X * 3.0) as fn(&mut DVec3)),
        ("mirrored", |c| c.x = -c.x),
        ("flat", |c| c.y = 0.5),
        ("all in one point", |c| *c = DVec3::ZERO),
        ("huge", |c| *c *= 1e150),
        ("tiny", |c| *c *= 1e-150),
    ] {
        let error = fault(|level| level.blocks[0].warp.corners.iter_mut().for_each(change));
        let named = matches!(
            error,
            LevelError::Warp {
                block: 0,
                source: HexahedronError::Folded { .. }
            }
        );
        assert!(named, "{what}: {error}");
    }
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = fault(|level| level.blocks[1].warp.corners[3].z = bad);
        let named = matches!(
            error,
            LevelError::Warp {
                block: 1,
                source: HexahedronError::NotFinite { corner: 3 }
            }
        );
        assert!(named, "{error}");
    }
    for bad in [f32::NAN, -0.1, 1.01, f32::INFINITY] {
        let error = fault(|level| level.blocks[1].albedo[2].y = bad);
        let named = matches!(
            error,
            LevelError::Albedo {
                block: 1,
                face: Face::NegY,
                ..
            }
        );
        assert!(named, "{error}");
    }
    let mut empty = pair();
    empty.blocks.clear();
    empty.connections.clear();
    assert_eq!(empty.check(), Err(LevelError::Empty));
}

#[test]
fn faulty_connections_are_named() {
    let connect = |a: (usize, Face), b: (usize, Face)| Connection {
        a: Opening {
            block: a.0,
            face: a.1,
        },
        b: Opening {
            block: b.0,
            face: b.1,
        },
    };
    let (right, left) = ((0, Face::PosX), (1, Face::NegX));
    for block in [2, usize::MAX] {
        let error = fault(|level| level.connections[0] = connect(right, (block, Face::NegX)));
        let named = matches!(
            error,
            LevelError::NoSuchBlock { connection: 0, expected: 2, found } if found == block
        );
        assert!(named, "{error}");
    }
    for again in [connect(right, left), connect(left, right)] {
        let error = fault(|level| level.connections.push(again));
        assert!(
            matches!(error, LevelError::ConnectedTwice { found: 2, .. }),
            "{error}"
        );
    }
    let error = fault(|level| level.connections[0] = connect(right, right));
    assert!(
        matches!(error, LevelError::ConnectedTwice { block: 0, .. }),
        "{error}"
    );
    for wall in [Face::NegX, Face::PosY, Face::NegZ] {
        let error = fault(|level| level.connections[0] = connect((0, wall), left));
        let named = matches!(
            error,
            LevelError::NotAnOpening { block: 0, face, .. } if face == wall
        );
        assert!(named, "{error}");
    }
    let apart = fault(|level| {
        let corners = &mut level.blocks[1].warp.corners;
        *corners = corners.map(|c| c + DVec3::X * 0.01);
    });
    assert!(
        matches!(apart, LevelError::InterfaceMismatch { .. }),
        "{apart}"
    );
    let smaller = fault(|level| {
        let corners = &mut level.blocks[1].warp.corners;
        *corners = corners.map(|c| (c - DVec3::X) * 0.5 + DVec3::X);
    });
    assert!(
        matches!(smaller, LevelError::InterfaceMismatch { .. }),
        "{smaller}"
    );
}

#[test]
fn interfaces_rolled_by_a_quarter_turn_are_refused() {
    // A turn about the corridor's axis keeps the openings in place, but not the upward direction.
    for (x, y) in [(Face::NegX, Face::PosZ), (Face::NegX, Face::NegZ)] {
        let mut level = pair();
        level.blocks[1].orientation = CubeRotation::from_images(x, y).expect("perpendicular");
        assert_eq!(level.check(), Ok(()));
        let error = refusal(&level, default_dictionary());
        let named = matches!(
            error,
            AssembleError::RolledInterface {
                block: 0,
                other: 1,
                ..
            }
        );
        assert!(named, "{error}");
    }
}

/// Pieces of text that a mutation may insert.
const TOKENS: [&str; 24] = [
    "",
    "-1",
    "0",
    "1e400",
    "nan",
    "inf",
    "18446744073709551615",
    "-0.0",
    "\"\"",
    "[",
    "]",
    "[[block]]",
    "{",
    "}",
    "=",
    "\"-x\"",
    "\"cross\"",
    "\"+y+x\"",
    "\"+x+x\"",
    "\u{0}",
    "🙂",
    "'",
    "\n",
    "#",
];

/// A change to a list of tokens.
#[derive(Clone, Debug)]
enum Mutation {
    Delete(prop::sample::Index),
    Duplicate(prop::sample::Index),
    Replace(prop::sample::Index, usize),
    Swap(prop::sample::Index, prop::sample::Index),
    Cut(prop::sample::Index),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let index = any::<prop::sample::Index>;
    prop_oneof![
        index().prop_map(Mutation::Delete),
        index().prop_map(Mutation::Duplicate),
        (index(), 0..TOKENS.len()).prop_map(|(i, t)| Mutation::Replace(i, t)),
        (index(), index()).prop_map(|(a, b)| Mutation::Swap(a, b)),
        index().prop_map(Mutation::Cut),
    ]
}

/// The text as words, blanks and single signs.
fn tokens(text: &str) -> Vec<String> {
    let kind = |c: char| match c {
        c if c.is_alphanumeric() || "+-._".contains(c) => 0,
        c if c.is_whitespace() => 1,
        _ => 2,
    };
    let mut tokens: Vec<String> = Vec::new();
    let mut last = None;
    for c in text.chars() {
        match tokens.last_mut() {
            Some(token) if last == Some(kind(c)) && kind(c) != 2 => token.push(c),
            _ => tokens.push(c.to_string()),
        }
        last = Some(kind(c));
    }
    tokens
}

fn sound_text() -> String {
    let mut level = floor_plan(&[[0, 0], [1, 0], [1, 1], [2, 0]], 0.5);
    level.blocks[2].albedo[2] = Vec3::new(0.1, 0.2, 0.3);
    level.to_text().expect("levels have text")
}

proptest! {
    #![proptest_config(Config {
        cases: 4000,
        rng_seed: RngSeed::Fixed(7),
        failure_persistence: None,
        ..Config::default()
    })]

    #[test]
    fn mutated_level_text_never_panics(mutations in prop::collection::vec(mutation(), 1..6)) {
        let mut tokens = tokens(&sound_text());
        for mutation in mutations {
            if tokens.is_empty() {
                break;
            }
            let n = tokens.len();
            match mutation {
                Mutation::Delete(i) => {
                    tokens.remove(i.index(n));
                }
                Mutation::Duplicate(i) => {
                    let token = tokens[i.index(n)].clone();
                    tokens.insert(i.index(n), token);
                }
                Mutation::Replace(i, token) => TOKENS[token].clone_into(&mut tokens[i.index(n)]),
                Mutation::Swap(a, b) => tokens.swap(a.index(n), b.index(n)),
                Mutation::Cut(i) => tokens.truncate(i.index(n)),
            }
        }
        // A text that is still a level must pass all later steps.
        if let Ok(level) = Level::from_text(&tokens.concat()) {
            prop_assert_eq!(level.check(), Ok(()));
            let text = level.to_text().expect("a sound level has text");
            prop_assert_eq!(Level::from_text(&text).expect("and is read again"), level.clone());
            if level.blocks.len() <= 8 {
                let config = AssembleConfig {
                    max_depth: 2,
                    ..AssembleConfig::default()
                };
                match Scene::assemble(&level, default_dictionary(), &config) {
                    Ok(_) | Err(AssembleError::RolledInterface { .. }) => {}
                    Err(other) => prop_assert!(false, "{}", other),
                }
            }
        }
    }
}

#[test]
fn text_that_is_no_level_is_refused_by_a_named_error() {
    let sound = sound_text();
    let error = |text: &str| Level::from_text(text).expect_err("not a level");
    assert!(matches!(error(""), LevelTextError::NotALevel { .. }));
    assert!(matches!(
        error(&sound.replacen("version = 1", "version = 2\nfog = true", 1)),
        LevelTextError::UnsupportedVersion { found: 2 }
    ));
    assert!(matches!(
        error(&sound[..sound.len() / 2]),
        LevelTextError::Malformed(_)
    ));
    let replaced = |from: &str, to: &str| {
        assert!(sound.contains(from), "{from}");
        error(&sound.replacen(from, to, 1))
    };
    let foreign = replaced("\"mrt-level\"", "\"mrt-mesh\"");
    assert!(
        matches!(foreign, LevelTextError::NotALevel { .. }),
        "{foreign}"
    );
    let version = replaced("version = 1", "version = 2");
    assert!(
        matches!(version, LevelTextError::UnsupportedVersion { found: 2 }),
        "{version}"
    );
    let shape = replaced("\"dead_end\"", "\"dead end\"");
    assert!(
        matches!(shape, LevelTextError::UnknownShape { .. }),
        "{shape}"
    );
    let face = replaced("\"+x\"", "\"x\"");
    assert!(matches!(face, LevelTextError::UnknownFace { .. }), "{face}");
    let placement = replaced("cell =", "box = [[0, 0, 0], [1, 1, 1]]\ncell =");
    assert!(
        matches!(placement, LevelTextError::Placement { found: 2, .. }),
        "{placement}"
    );
    let unknown = replaced("cell =", "colour = 3\ncell =");
    assert!(matches!(unknown, LevelTextError::Malformed(_)), "{unknown}");
    assert!(unknown.to_string().contains("colour"), "{unknown}");
}

#[test]
fn far_levels_and_absurd_settings_are_refused() {
    let mut level = Level::from_cells(&[[0, 0, 0], [1, 0, 0]], Vec3::ONE).expect("two cells");
    let config = |max_depth, max_bytes| AssembleConfig {
        max_depth,
        max_bytes,
        ..AssembleConfig::default()
    };
    let refused = |level: &Level, config| {
        Scene::assemble(level, default_dictionary(), &config)
            .map(|_| ())
            .expect_err("refused")
    };
    assert!(matches!(
        refused(&level, config(usize::MAX, 1 << 30)),
        AssembleError::Depth { .. }
    ));
    assert!(matches!(
        refused(&level, config(8, 1 << 10)),
        AssembleError::TooLarge { .. }
    ));
    for share in [-0.1, 1.0, f32::NAN, f32::INFINITY] {
        let config = AssembleConfig {
            negligible: Some(share),
            ..AssembleConfig::default()
        };
        assert!(matches!(
            refused(&level, config),
            AssembleError::Negligible { .. }
        ));
    }
    for block in &mut level.blocks {
        for corner in &mut block.warp.corners {
            corner.z += 1e6;
        }
    }
    assert!(matches!(level.check(), Err(LevelError::TooFar { .. })));
}
