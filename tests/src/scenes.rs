//! Scenes: levels with dictionaries.

use crate::dictionaries::{default_dictionary, mobile_dictionary};
use mrt_core::storage::Storage;
use mrt_runtime::{AssembleConfig, AssembleError, Coupling, Dictionary, Level, Scene};

/// Both ways in which light comes from other blocks.
pub const COUPLINGS: [Coupling; 2] = [Coupling::Table, Coupling::Lightfield];

/// The level with a dictionary and default settings.
pub fn scene_of(level: &Level, dictionary: &Dictionary) -> Scene {
    configured(level, dictionary, &AssembleConfig::default())
}

/// The level with a dictionary and settings that suit it.
pub fn configured(level: &Level, dictionary: &Dictionary, config: &AssembleConfig) -> Scene {
    Scene::assemble(level, dictionary, config).expect("the level fits the dictionary")
}

/// Why the level does not fit a dictionary with default settings.
pub fn refusal(level: &Level, dictionary: &Dictionary) -> AssembleError {
    Scene::assemble(level, dictionary, &AssembleConfig::default()).expect_err("it does not fit")
}

/// The level with the default dictionary and settings.
pub fn assembled(level: &Level) -> Scene {
    scene_of(level, default_dictionary())
}

/// The level with the mobile dictionary and default settings.
pub fn mobile(level: &Level) -> Scene {
    scene_of(level, mobile_dictionary())
}

/// The level with all operators stored in one way.
pub fn stored(level: &Level, dictionary: &Dictionary, storage: Storage) -> Scene {
    let config = AssembleConfig {
        shape_storage: storage,
        transport_storage: storage,
        ..AssembleConfig::default()
    };
    configured(level, dictionary, &config)
}

/// Settings that keep transport in `f32` and leave no far light out, to compare with exact results.
pub fn lossless(coupling: Coupling) -> AssembleConfig {
    AssembleConfig {
        coupling,
        transport_storage: Storage::F32,
        negligible: Some(0.0),
        ..AssembleConfig::default()
    }
}
