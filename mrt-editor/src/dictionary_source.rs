//! Where a command's dictionary comes from: a file, a preset baked on the spot, or the default that is
//! part of the program.

use mrt_core::container::{ByteBudget, ContainerError, read_file};
use mrt_dictionary::bake::bake;
use mrt_dictionary::config::{BakeConfig, ConfigError};
use mrt_dictionary::progress::{Cancelled, Progress};
use mrt_runtime::dictionary::Dictionary;
use mrt_runtime::dictionary_file::{DEFAULT_BYTE_BUDGET, DictionaryError};
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// The preset whose dictionary is part of the program.
pub const DEFAULT_PRESET: &str = "standard";

/// The default dictionary, as `mrt bake` writes it.
pub static DEFAULT_DICTIONARY: &[u8] = include_bytes!("../../assets/cubes-2d-standard.mrt");

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
    match (file, preset) {
        (Some(path), _) => from_file(path),
        (None, None | Some(DEFAULT_PRESET)) => {
            parse(DEFAULT_DICTIONARY, "the built-in dictionary".to_owned())
        }
        (None, Some(name)) => {
            let config = BakeConfig::preset(name)?;
            Ok(bake_with_progress(&config)?)
        }
    }
}

/// Reads a dictionary file.
///
/// # Errors
/// [`SourceError::File`] and [`SourceError::Dictionary`].
pub fn from_file(path: &Path) -> Result<Dictionary, SourceError> {
    let place = path.display().to_string();
    let bytes = read_file(path, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET));
    let bytes = bytes.map_err(|error| match error {
        // These name the file themselves.
        ContainerError::Io { .. } => SourceError::File(error),
        other => SourceError::Dictionary {
            place: place.clone(),
            source: other.into(),
        },
    })?;
    parse(&bytes, place)
}

fn parse(bytes: &[u8], place: String) -> Result<Dictionary, SourceError> {
    Dictionary::from_bytes(bytes, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET))
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
