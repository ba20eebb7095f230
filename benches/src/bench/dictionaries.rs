//! Which dictionaries are measured: presets, files, and those baked for a sweep.

use super::args::BenchArgs;
use super::error::BenchError;
use super::goals::Presets;
use mrt_dictionary::config::{BakeConfig, ConfigError};
use mrt_editor::cli::dictionary_source::{
    DEFAULT_PRESET, DEFAULT_SET, SourceError, bake_with_progress, from_file, from_preset,
};
use mrt_runtime::Dictionary;

/// Presets that are baked when they are asked for.
const MOBILE: &str = "mobile";
const HIGH: &str = "high";

/// Dictionaries and what they are called; no two have the same name.
#[derive(Default)]
pub(super) struct Dictionaries(Vec<Named>);

/// A dictionary and what it is called.
pub(super) struct Named {
    pub(super) name: String,
    pub(super) dictionary: Dictionary,
}

impl Dictionaries {
    /// Reads and bakes all that the flags ask for.
    pub(super) fn new(args: &BenchArgs) -> Result<Self, BenchError> {
        let presets = presets(args);
        // All settings are checked before the first bake.
        for preset in &presets {
            BakeConfig::preset(preset)?;
        }
        let sweep = sweep(args)?;
        let mut all = Self::default();
        for file in &args.dictionary {
            let dictionary = from_file(file)?;
            all.add(dictionary.preset.replace('/', "-"), dictionary);
        }
        for preset in presets {
            all.add(preset.to_owned(), from_preset(DEFAULT_SET, Some(preset))?);
        }
        for config in sweep {
            let dictionary = bake_with_progress(&config).map_err(SourceError::Cancelled)?;
            all.add(config.preset.clone(), dictionary);
        }
        if args.figures {
            all.add_presets_of_goals()?;
        }
        Ok(all)
    }

    fn add(&mut self, name: String, dictionary: Dictionary) {
        let same = self.0.iter().filter(|other| other.name.starts_with(&name));
        let name = match same.count() {
            0 => name,
            count => format!("{name}-{}", count + 1),
        };
        self.0.push(Named { name, dictionary });
    }

    fn add_presets_of_goals(&mut self) -> Result<(), BenchError> {
        for preset in [DEFAULT_PRESET, MOBILE] {
            if self.named(preset).is_none() {
                let (name, dictionary) =
                    (preset.to_owned(), from_preset(DEFAULT_SET, Some(preset))?);
                self.0.push(Named { name, dictionary });
            }
        }
        Ok(())
    }

    fn named(&self, name: &str) -> Option<&Dictionary> {
        let found = self.0.iter().find(|named| named.name == name)?;
        Some(&found.dictionary)
    }

    /// The dictionaries that goals speak of.
    ///
    /// # Panics
    /// Without the flag that asks for goals, unless standard and mobile are there.
    pub(super) fn of_goals(&self) -> Presets<'_> {
        let added = "goals add it where it is not given";
        Presets {
            standard: self.named(DEFAULT_PRESET).expect(added),
            mobile: self.named(MOBILE).expect(added),
            high: self.named(HIGH),
        }
    }

    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = &Named> {
        self.0.iter()
    }
}

/// The presets asked for, or the usual ones.
fn presets(args: &BenchArgs) -> Vec<&str> {
    match (args.presets.is_empty(), args.dictionary.is_empty()) {
        (false, _) => args.presets.iter().map(String::as_str).collect(),
        (true, false) => Vec::new(),
        (true, true) if args.figures => Vec::new(),
        (true, true) if args.quick => vec![DEFAULT_PRESET, MOBILE],
        (true, true) => vec![DEFAULT_PRESET, MOBILE, HIGH],
    }
}

/// Settings of the dictionaries that vary resolution and modes.
fn sweep(args: &BenchArgs) -> Result<Vec<BakeConfig>, ConfigError> {
    let standard = BakeConfig::preset(DEFAULT_PRESET)?;
    if args.resolutions.is_empty() && args.modes.is_empty() {
        return Ok(Vec::new());
    }
    let or_standard = |given: &[usize], standard: usize| match given {
        [] => vec![standard],
        given => given.to_vec(),
    };
    let mut configs = Vec::new();
    for &resolution in &or_standard(&args.resolutions, standard.resolution) {
        for &modes in &or_standard(&args.modes, standard.modes) {
            let mut config = standard.clone();
            config.preset = format!("r{resolution}m{modes}");
            config.resolution = resolution;
            // The modes of light between blocks keep their ratio to those within one.
            let scaled = |count: usize| (count * modes).div_ceil(standard.modes);
            config.modes = modes;
            config.coupling.emission_modes = scaled(standard.coupling.emission_modes);
            config.coupling.response_modes = scaled(standard.coupling.response_modes);
            config.coupling.foreign_modes = scaled(standard.coupling.foreign_modes);
            config.outputs.probes = 0;
            config.check()?;
            configs.push(config);
        }
    }
    Ok(configs)
}
