//! Where a command's dictionary comes from: a file, a preset baked on the spot, or the default that is part of the
//! program.

use crate::cli::progress::with_progress;
use mrt_core::container::{ByteBudget, ContainerError, read_file};
use mrt_dictionary::config::{BakeConfig, ConfigError};
use mrt_dictionary::modular::bake::bake;
use mrt_dictionary::progress::Cancelled;
use mrt_runtime::low_level::modular::dictionary::StoredDictionary;
use mrt_runtime::low_level::modular::dictionary_file::DEFAULT_BYTE_BUDGET;
use mrt_runtime::{Dictionary, DictionaryError};
use std::borrow::Cow;
use std::path::Path;

/// The preset whose dictionary is part of the program.
pub const DEFAULT_PRESET: &str = "standard";

/// The set of shapes of that dictionary.
pub const DEFAULT_SET: &str = "cubes-2d";

/// The default dictionary, as `mrt bake` writes it.
static DEFAULT_DICTIONARY: &[u8] = include_bytes!("../../../assets/cubes-2d-standard.mrt");

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

/// A preset's dictionary of a set of shapes; without a preset, the default's. All dictionaries but the one that is part
/// of the program are baked now.
///
/// # Errors
/// [`SourceError::Config`] and [`SourceError::Cancelled`].
pub fn from_preset(set: &str, preset: Option<&str>) -> Result<Dictionary, SourceError> {
    let preset = preset.unwrap_or(DEFAULT_PRESET);
    if (set, preset) == (DEFAULT_SET, DEFAULT_PRESET) {
        return DictionaryBytes::built_in().read();
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
    DictionaryBytes::of_file(path)?.read()
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

/// Bytes that should be a dictionary, and where they come from.
#[derive(Clone, Debug)]
pub struct DictionaryBytes {
    bytes: Cow<'static, [u8]>,
    place: String,
}

impl DictionaryBytes {
    /// Those of a file, or of the default dictionary.
    ///
    /// # Errors
    /// [`SourceError::File`] and [`SourceError::Dictionary`].
    pub fn of(file: Option<&Path>) -> Result<Self, SourceError> {
        file.map_or_else(|| Ok(Self::built_in()), Self::of_file)
    }

    /// Those of a file.
    ///
    /// # Errors
    /// [`SourceError::File`] and [`SourceError::Dictionary`].
    pub fn of_file(path: &Path) -> Result<Self, SourceError> {
        let place = path.display().to_string();
        match read_file(path, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET)) {
            Ok(bytes) => Ok(Self {
                bytes: bytes.into(),
                place,
            }),
            // Its message names the file already.
            Err(error @ ContainerError::Io { .. }) => Err(SourceError::File(error)),
            Err(error) => Err(SourceError::Dictionary {
                place,
                source: error.into(),
            }),
        }
    }

    /// Those of the default dictionary.
    pub fn built_in() -> Self {
        Self {
            bytes: DEFAULT_DICTIONARY.into(),
            place: "the built-in dictionary".to_owned(),
        }
    }

    /// Number of bytes.
    pub fn count(&self) -> usize {
        self.bytes.len()
    }

    /// The dictionary with all matrices as `f32`.
    ///
    /// # Errors
    /// [`SourceError::Dictionary`].
    pub fn read(&self) -> Result<Dictionary, SourceError> {
        self.named(Dictionary::from_bytes_within(
            &self.bytes,
            &mut ByteBudget::new(DEFAULT_BYTE_BUDGET),
        ))
    }

    /// The dictionary with matrices as they are stored.
    ///
    /// # Errors
    /// [`SourceError::Dictionary`].
    pub fn read_stored(&self) -> Result<StoredDictionary<'_>, SourceError> {
        self.named(StoredDictionary::read(
            &self.bytes,
            &mut ByteBudget::new(DEFAULT_BYTE_BUDGET),
        ))
    }

    fn named<T>(&self, result: Result<T, DictionaryError>) -> Result<T, SourceError> {
        result.map_err(|source| SourceError::Dictionary {
            place: self.place.clone(),
            source,
        })
    }
}
