//! The range of every setting.

use super::{
    BakeConfig, ConfigError, CouplingConfig, Enrichment, LightfieldConfig, MAX_BAKE_RESOLUTION,
    PriorConfig,
};
use mrt_runtime::low_level::level::shape::shape_set;
use mrt_runtime::low_level::modular::dictionary_file::MAX_MODES;
use std::ops::RangeInclusive;

/// Largest number of lightfield samples times modes: 2 GiB a matrix, of which a bake holds several.
const MAX_LIGHTFIELD_NUMBERS: f64 = (1u64 << 28) as f64;

/// Longest paths of a table. In sets with openings up and down, each further opening more than triples the number of
/// paths.
const MAX_PATH_DEPTH: usize = 8;

/// A setting with its range.
struct Setting {
    what: &'static str,
    found: f64,
    range: RangeInclusive<f64>,
}

fn count(what: &'static str, found: usize, range: RangeInclusive<usize>) -> Setting {
    Setting {
        what,
        found: found as f64,
        range: *range.start() as f64..=*range.end() as f64,
    }
}

fn weight(what: &'static str, found: f64, largest: f64) -> Setting {
    Setting {
        what,
        found,
        range: 0.0..=largest,
    }
}

impl BakeConfig {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`ConfigError`], for the first setting that is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        if shape_set(&self.shapes).is_none() {
            return Err(ConfigError::UnknownSet {
                found: self.shapes.clone(),
            });
        }
        let of_block = [
            count("resolution", self.resolution, 1..=MAX_BAKE_RESOLUTION),
            count("number of modes", self.modes, 1..=MAX_MODES),
            count("probes along an edge", self.outputs.probes, 0..=8),
        ];
        let settings = of_block
            .into_iter()
            .chain(prior(&self.prior))
            .chain(self.enrichment.iter().flat_map(enrichment))
            .chain(lightfield(&self.lightfield))
            .chain(coupling(&self.coupling));
        for Setting { what, found, range } in settings {
            if !range.contains(&found) {
                return Err(ConfigError::OutOfRange {
                    what,
                    low: *range.start(),
                    high: *range.end(),
                    found,
                });
            }
        }
        self.check_outputs_of_tubes()
    }

    fn check_outputs_of_tubes(&self) -> Result<(), ConfigError> {
        let asked = [
            ("probes", self.outputs.probes > 0),
            ("vector irradiance", self.outputs.vector),
        ];
        match asked.into_iter().find(|&(_, is_asked)| is_asked) {
            Some((output, _)) if self.has_tubes() => Err(ConfigError::NotOfTubes {
                set: self.shapes.clone(),
                output,
            }),
            _ => Ok(()),
        }
    }
}

fn prior(config: &PriorConfig) -> [Setting; 3] {
    [
        count("lights per axis", config.lights_per_axis, 1..=32),
        weight("light radius", config.light_radius, 1.0),
        Setting {
            what: "k_d",
            found: config.k_d as f64,
            range: 1.0..=f64::INFINITY,
        },
    ]
}

fn enrichment(config: &Enrichment) -> [Setting; 3] {
    [
        weight("uniform weight", config.uniform_weight, 1000.0),
        weight("constant weight", config.constant_weight, 1000.0),
        weight("indirect weight", config.indirect_weight, 1000.0),
    ]
}

fn lightfield(config: &LightfieldConfig) -> [Setting; 7] {
    let side = config.positions as f64 * config.directions as f64;
    [
        count("lightfield positions", config.positions, 1..=64),
        count("lightfield directions", config.directions, 2..=64),
        count("super-samples", config.super_samples, 1..=9),
        count(
            "number of lightfield modes",
            config.lightfield_modes,
            1..=MAX_MODES,
        ),
        Setting {
            what: "lightfield samples times modes",
            found: side * side * config.lightfield_modes as f64,
            range: 1.0..=MAX_LIGHTFIELD_NUMBERS,
        },
        count("enrichment rounds", config.enrichment_rounds, 0..=8),
        weight("enrichment weight", config.enrichment_weight, 100.0),
    ]
}

fn coupling(config: &CouplingConfig) -> [Setting; 6] {
    [
        count(
            "number of emission modes",
            config.emission_modes,
            1..=MAX_MODES,
        ),
        count(
            "number of response modes",
            config.response_modes,
            1..=MAX_MODES,
        ),
        count(
            "number of foreign modes",
            config.foreign_modes,
            0..=MAX_MODES,
        ),
        count("path depth", config.depth, 1..=MAX_PATH_DEPTH),
        count(
            "path depth through holes",
            config.hole_depth,
            1..=MAX_PATH_DEPTH,
        ),
        weight("beyond weight", config.beyond_weight, 1000.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PRESETS;
    use mrt_runtime::low_level::level::shape::SHAPE_SETS;

    #[test]
    fn presets_are_in_range_for_every_set_and_zero_modes_are_not() {
        for name in PRESETS {
            for (set, _) in SHAPE_SETS {
                let mut config = BakeConfig::preset_for(name, set).expect("a preset");
                assert_eq!(config.check(), Ok(()));
                config.modes = 0;
                assert!(matches!(
                    config.check(),
                    Err(ConfigError::OutOfRange {
                        what: "number of modes",
                        ..
                    })
                ));
            }
        }
        assert!(BakeConfig::preset("ultra").is_err());
    }

    #[test]
    fn absurd_counts_are_refused_and_do_not_overflow() {
        let mut config = BakeConfig::preset("standard").expect("a preset");
        config.lightfield.positions = usize::MAX;
        config.lightfield.directions = usize::MAX;
        assert!(matches!(
            config.check(),
            Err(ConfigError::OutOfRange {
                what: "lightfield positions",
                ..
            })
        ));
        config = BakeConfig::preset("standard").expect("a preset");
        config.prior.light_radius = f64::NAN;
        assert!(config.check().is_err());
    }

    #[test]
    fn tubes_are_refused_outputs_that_they_lack() {
        let mut config = BakeConfig::preset_for("mobile", "cylinders").expect("a preset");
        config.outputs.vector = true;
        let error = config.check().expect_err("tubes have no vector irradiance");
        assert_eq!(
            error.to_string(),
            "the set `cylinders` has round tubes, which have no vector irradiance"
        );
    }
}
