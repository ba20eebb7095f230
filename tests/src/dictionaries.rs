//! Dictionaries: the committed ones, and bakes for tests.

use mrt_core::container::Format;
use mrt_dictionary::config::BakeConfig;
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Progress;
use mrt_runtime::Dictionary;
use std::sync::OnceLock;

/// The committed default dictionary: the standard preset.
pub static DEFAULT_BYTES: &[u8] = include_bytes!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../assets/cubes-2d-standard.mrt"
));

/// The committed dictionary of the oldest version of the format.
pub static OLDEST_BYTES: &[u8] = include_bytes!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../assets/versions/1.mrt"
));

/// The committed dictionary of the newest version of the format: the mobile preset with 6² texels a wall.
pub static MOBILE_BYTES: &[u8] = include_bytes!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../assets/versions/2.mrt"
));

/// The file format of dictionaries, in this version.
pub const fn dictionary_format(version: u32) -> Format {
    Format {
        magic: *b"\x89MRT\r\n\x1a\n",
        kind: *b"DICT",
        version,
        oldest_version: 1,
    }
}

fn read(bytes: &[u8]) -> Dictionary {
    Dictionary::from_bytes(bytes).expect("the committed dictionary is sound")
}

/// The default dictionary, read once.
pub fn default_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| read(DEFAULT_BYTES))
}

/// A dictionary for tests that are repeated many times and whose subject does not depend on sizes: 6² texels a wall, 12
/// coefficients, 2³ probes a block.
pub fn mobile_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| read(MOBILE_BYTES))
}

/// The smallest dictionary with vector irradiance.
pub fn vector_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        baked("mobile", "cubes-2d", |config| {
            // An odd number of texels puts some on the planes of mirrors.
            config.resolution = 5;
            config.modes = 8;
            config.coupling.emission_modes = 8;
            config.coupling.response_modes = 8;
            config.coupling.foreign_modes = 8;
            config.coupling.depth = 2;
            config.outputs.vector = true;
            set_lightfields(config, 4, 4, 16);
        })
    })
}

/// The settings of a preset for a set of shapes, after a change.
pub fn changed(preset: &str, set: &str, change: impl FnOnce(&mut BakeConfig)) -> BakeConfig {
    let mut config = BakeConfig::preset_for(preset, set).expect("a preset and a set");
    change(&mut config);
    config.check().expect("the settings are in range");
    config
}

/// Sets how finely lightfields are sampled, along a side of an opening and around a direction, and how many of their modes
/// are kept.
pub fn set_lightfields(config: &mut BakeConfig, positions: usize, directions: usize, modes: usize) {
    config.lightfield.positions = positions;
    config.lightfield.directions = directions;
    config.lightfield.lightfield_modes = modes;
}

/// The dictionary that the settings give.
pub fn bake_of(config: &BakeConfig) -> Dictionary {
    bake(config, &Progress::silent()).expect("nobody cancels")
}

/// [`bake_of`] the settings of [`changed`].
pub fn baked(preset: &str, set: &str, change: impl FnOnce(&mut BakeConfig)) -> Dictionary {
    bake_of(&changed(preset, set, change))
}
