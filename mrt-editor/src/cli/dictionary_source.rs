//! Where a command's dictionary comes from: a file, a preset baked on the spot, or the default that is
//! part of the program.

use mrt_core::container::{ByteBudget, ContainerError, read_file};
use mrt_dictionary::config::{BakeConfig, ConfigError};
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_runtime::low_level::modular::dictionary_file::DEFAULT_BYTE_BUDGET;
use mrt_runtime::{Dictionary, DictionaryError};
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// The preset whose dictionary is part of the program.
pub const DEFAULT_PRESET: &str = "standard";

/// The set of shapes of that dictionary.
pub const DEFAULT_SET: &str = "cubes-2d";

/// The default dictionary, as `mrt bake` writes it.
pub static DEFAULT_DICTIONARY: &[u8] = include_bytes!("../../../assets/cubes-2d-standard.mrt");

/// Why there is no dictionary.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] ContainerError),
    /// The bytes are no dictionary.
    #[error("{place}: {source}")]
    Dictionary {
        /// The file, or "the built-in dictionary".
        place: String,
        /// What is wrong.
        source: DictionaryError,
    },
    /// The bake's settings are at fault.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The user stopped the bake.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The dictionary in `file`; without a file, the named preset's; without either, the default.
///
/// Presets other than the default are baked now, with progress on standard error.
///
/// # Errors
/// [`SourceError`].
pub fn load(file: Option<&Path>, preset: Option<&str>) -> Result<Dictionary, SourceError> {
    match file {
        Some(path) => from_file(path),
        None => from_preset(DEFAULT_SET, preset),
    }
}

/// A preset's dictionary of a set of shapes; without a preset, the default's. All but the one that is part of the
/// program are baked now.
///
/// # Errors
/// [`SourceError::Config`] and [`SourceError::Cancelled`].
pub fn from_preset(set: &str, preset: Option<&str>) -> Result<Dictionary, SourceError> {
    let preset = preset.unwrap_or(DEFAULT_PRESET);
    if (set, preset) == (DEFAULT_SET, DEFAULT_PRESET) {
        return parse(DEFAULT_DICTIONARY, "the built-in dictionary".to_owned());
    }
    let mut config = BakeConfig::preset(preset)?;
    set.clone_into(&mut config.shapes);
    config.check()?;
    Ok(bake_with_progress(&config)?)
}

/// Reads a dictionary file.
///
/// # Errors
/// [`SourceError::File`] and [`SourceError::Dictionary`].
pub fn from_file(path: &Path) -> Result<Dictionary, SourceError> {
    let bytes = read_dictionary_file(path)?;
    parse(&bytes, path.display().to_string())
}

/// The bytes of a file that may be a dictionary.
///
/// # Errors
/// [`SourceError::File`] and [`SourceError::Dictionary`].
pub fn read_dictionary_file(path: &Path) -> Result<Vec<u8>, SourceError> {
    let bytes = read_file(path, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET));
    bytes.map_err(|error| match error {
        // These name the file themselves.
        ContainerError::Io { .. } => SourceError::File(error),
        other => SourceError::Dictionary {
            place: path.display().to_string(),
            source: other.into(),
        },
    })
}

fn parse(bytes: &[u8], place: String) -> Result<Dictionary, SourceError> {
    Dictionary::from_bytes_within(bytes, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET))
        .map_err(|source| SourceError::Dictionary { place, source })
}

/// Bakes with progress on standard error; an interrupt (Ctrl-C) stops it and leaves no file.
///
/// # Errors
/// [`Cancelled`].
pub fn bake_with_progress(config: &BakeConfig) -> Result<Dictionary, Cancelled> {
    with_progress(&format!("baking {}", config.preset), |progress| {
        bake(config, progress)
    })
}

/// Runs long work with progress on standard error; an interrupt (Ctrl-C) asks it to stop.
pub fn with_progress<T>(name: &str, work: impl FnOnce(&Progress) -> T) -> T {
    let terminal = std::io::stderr().is_terminal();
    let report = |what: &str, step: usize, steps: usize| {
        let line = format!("{name}: step {step} of {steps}, {what}");
        // On a terminal one line is rewritten; in a log every step keeps its own.
        if terminal {
            eprint!("\r\x1b[K{line}");
            // Progress that cannot be shown is no reason to stop.
            let _ = std::io::stderr().flush();
        } else {
            eprintln!("{line}");
        }
    };
    let result = work(&Progress::new(&report, interrupted()));
    if terminal {
        eprintln!();
    }
    result
}

/// Set when the user interrupts the program.
fn interrupted() -> &'static AtomicBool {
    static FLAG: AtomicBool = AtomicBool::new(false);
    static HANDLER: OnceLock<bool> = OnceLock::new();
    // Without a handler an interrupt ends the program at once, which leaves no file either.
    HANDLER.get_or_init(|| ctrlc::set_handler(|| FLAG.store(true, Ordering::Relaxed)).is_ok());
    &FLAG
}
