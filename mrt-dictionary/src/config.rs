//! Settings of a bake and the named presets.

use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::{SHAPE_SETS, shape_set};
use mrt_runtime::low_level::modular::dictionary_file::MAX_MODES;

/// Everything that decides a dictionary's bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Name of the preset, kept in the file.
    pub preset: String,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Largest number of modes `k_b`; fewer are kept where a multiplet would be cut.
    pub modes: usize,
    /// The light prior.
    pub prior: PriorConfig,
    /// Appendix A for blocks; `None` leaves the prior as it is.
    pub enrichment: Option<Enrichment>,
    /// Interface lightfields.
    pub lightfield: LightfieldConfig,
    /// The set of shapes, one of [`SHAPE_SETS`].
    pub shapes: String,
    /// Transport between blocks.
    pub coupling: CouplingConfig,
    /// What is computed besides irradiance.
    pub outputs: OutputConfig,
}

/// Transport between blocks, by whole paths.
#[derive(Clone, Debug, PartialEq)]
pub struct CouplingConfig {
    /// Emission modes, at most.
    pub emission_modes: usize,
    /// Response modes `k_r`, at most.
    pub response_modes: usize,
    /// Modes that light from other blocks adds to a shape's own, at most.
    pub foreign_modes: usize,
    /// Openings that a path of the table crosses, at most.
    pub depth: usize,
    /// The same for paths with a hole in a wall.
    pub hole_depth: usize,
    /// Weight of the light on the walls beyond each opening against that on the shape's own, when its modes are
    /// chosen.
    pub beyond_weight: f64,
}

/// What is computed besides irradiance.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputConfig {
    /// Probes along an edge of a block; 0 for none.
    pub probes: usize,
    /// True for vector irradiance, four coefficients a texel.
    pub vector: bool,
}

/// The light prior's samples.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorConfig {
    /// Lights along each axis, inside and beyond each opening.
    pub lights_per_axis: usize,
    /// Radius of the sphere lights, in block widths.
    pub light_radius: f64,
    /// Vectors kept, `k_d`, at most. They cost nothing at run time, so presets keep all of them.
    pub k_d: usize,
}

/// Weights of what joins the prior, relative to the prior's own Frobenius norm.
///
/// The defaults were tuned on the reference files. Weights of 0.1 leave coloured walls 10 % wrong where 0.2
/// leaves 6, and 1 costs 0.1 to 0.4 % on white ones. Uniform light joins with a weight so large that the
/// bases hold it exactly: without it a white furnace is 13 % too dark in its corners, and all bounces at
/// albedo 0.9 err by 2.9 % instead of 2.1.
#[derive(Clone, Debug, PartialEq)]
pub struct Enrichment {
    /// Of uniform light.
    pub uniform_weight: f64,
    /// Of the functions that are constant on one wall.
    pub constant_weight: f64,
    /// Of the indirect basis.
    pub indirect_weight: f64,
}

/// The interface lightfields.
#[derive(Clone, Debug, PartialEq)]
pub struct LightfieldConfig {
    /// Positions along each axis of an opening.
    pub positions: usize,
    /// Directions along each axis of the hemisphere's square.
    pub directions: usize,
    /// Super-samples along each axis of a direction cell.
    pub super_samples: usize,
    /// Lightfield modes `k_rlf`, at most.
    pub lightfield_modes: usize,
    /// Rounds of interface enrichment (appendix A).
    pub enrichment_rounds: usize,
    /// Frobenius weight of the propagated lightfields against the emitted ones.
    pub enrichment_weight: f64,
}

/// A setting out of range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// No preset of that name.
    #[error("preset `{found}`; expected one of {}", PRESETS.join(", "))]
    UnknownPreset {
        /// The name given.
        found: String,
    },
    /// No set of shapes of that name.
    #[error(
        "set of shapes `{found}`; expected one of {}",
        SHAPE_SETS.map(|set| set.0).join(", ")
    )]
    UnknownSet {
        /// The name given.
        found: String,
    },
    /// A count or weight out of range.
    #[error("{what} is {found}; expected {low} to {high}")]
    OutOfRange {
        /// Which setting.
        what: &'static str,
        /// Smallest accepted.
        low: f64,
        /// Largest accepted.
        high: f64,
        /// The value given.
        found: f64,
    },
}

/// Largest resolution that is baked: F of the closed cube takes 8 bytes x 36 x resolution⁴, 302 MB there.
pub const MAX_BAKE_RESOLUTION: usize = 32;

/// Largest number of lightfield samples times modes: 2 GiB a matrix, of which a bake holds several.
const MAX_LIGHTFIELD_NUMBERS: f64 = (1u64 << 28) as f64;

/// Longest paths of a table: 3D sets have a third more than triple the paths for each opening more.
const MAX_PATH_DEPTH: f64 = 8.0;

/// Names of the presets.
pub const PRESETS: [&str; 4] = ["mobile", "standard", "high", "quality"];

impl BakeConfig {
    /// A named preset: `mobile` (5² texels, 12 modes), `standard` (16², 32), `high` (16², 64) or `quality` (16², 96).
    ///
    /// # Errors
    /// [`ConfigError::UnknownPreset`].
    pub fn preset(name: &str) -> Result<Self, ConfigError> {
        let (resolution, modes, lightfield_modes, [emission, response, foreign], depth) = match name
        {
            "mobile" => (5, 12, 64, [32, 24, 8], 4),
            "standard" => (16, 32, 128, [96, 64, 32], 5),
            "high" => (16, 64, 192, [160, 160, 48], 5),
            "quality" => (16, 96, 192, [160, 160, 96], 5),
            _ => {
                return Err(ConfigError::UnknownPreset {
                    found: name.to_owned(),
                });
            }
        };
        Ok(Self {
            preset: name.to_owned(),
            resolution,
            modes,
            prior: PriorConfig::default(),
            enrichment: Some(Enrichment::default()),
            lightfield: LightfieldConfig {
                lightfield_modes,
                ..LightfieldConfig::default()
            },
            shapes: SHAPE_SETS[0].0.to_owned(),
            coupling: CouplingConfig {
                emission_modes: emission,
                response_modes: response,
                foreign_modes: foreign,
                depth,
                ..CouplingConfig::default()
            },
            outputs: OutputConfig {
                probes: if name == "mobile" { 2 } else { 4 },
                vector: false,
            },
        })
    }

    /// The preset for a set of shapes: tubes have 32² texels a chart, or 12² of `mobile`, and no probes.
    ///
    /// # Errors
    /// [`ConfigError::UnknownPreset`] and [`ConfigError::UnknownSet`].
    pub fn preset_for(name: &str, set: &str) -> Result<Self, ConfigError> {
        let mut config = Self::preset(name)?;
        config.shapes = set.to_owned();
        if shape_set(set).is_none() {
            return Err(ConfigError::UnknownSet {
                found: set.to_owned(),
            });
        }
        if config.has_tubes() {
            config.resolution = if name == "mobile" { 12 } else { 32 };
            config.outputs.probes = 0;
        }
        Ok(config)
    }

    /// True for a set of tubes.
    pub fn has_tubes(&self) -> bool {
        let is_tube = |shape: &&Shape| shape.tube().is_some();
        shape_set(&self.shapes).is_some_and(|shapes| shapes.iter().any(is_tube))
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`], for the first that is not within its bounds.
    pub fn check(&self) -> Result<(), ConfigError> {
        if shape_set(&self.shapes).is_none() {
            return Err(ConfigError::UnknownSet {
                found: self.shapes.clone(),
            });
        }
        let lightfield = &self.lightfield;
        let max_modes = MAX_MODES as f64;
        let max_resolution = MAX_BAKE_RESOLUTION as f64;
        let weights = self.enrichment.as_ref().map_or([0.0; 3], |e| {
            [e.uniform_weight, e.constant_weight, e.indirect_weight]
        });
        let ranges = [
            ("resolution", self.resolution as f64, 1.0, max_resolution),
            ("number of modes", self.modes as f64, 1.0, max_modes),
            (
                "lights per axis",
                self.prior.lights_per_axis as f64,
                1.0,
                32.0,
            ),
            ("light radius", self.prior.light_radius, 0.0, 1.0),
            ("k_d", self.prior.k_d as f64, 1.0, f64::INFINITY),
            ("uniform weight", weights[0], 0.0, 1000.0),
            ("constant weight", weights[1], 0.0, 1000.0),
            ("indirect weight", weights[2], 0.0, 1000.0),
            (
                "lightfield positions",
                lightfield.positions as f64,
                1.0,
                64.0,
            ),
            (
                "lightfield directions",
                lightfield.directions as f64,
                2.0,
                64.0,
            ),
            ("super-samples", lightfield.super_samples as f64, 1.0, 9.0),
            (
                "number of lightfield modes",
                lightfield.lightfield_modes as f64,
                1.0,
                max_modes,
            ),
            (
                "number of emission modes",
                self.coupling.emission_modes as f64,
                1.0,
                max_modes,
            ),
            (
                "number of response modes",
                self.coupling.response_modes as f64,
                1.0,
                max_modes,
            ),
            (
                "number of foreign modes",
                self.coupling.foreign_modes as f64,
                0.0,
                max_modes,
            ),
            (
                "path depth",
                self.coupling.depth as f64,
                1.0,
                MAX_PATH_DEPTH,
            ),
            (
                "path depth through holes",
                self.coupling.hole_depth as f64,
                1.0,
                MAX_PATH_DEPTH,
            ),
            ("beyond weight", self.coupling.beyond_weight, 0.0, 1000.0),
            (
                "probes along an edge",
                self.outputs.probes as f64,
                0.0,
                if self.has_tubes() { 0.0 } else { 8.0 },
            ),
            (
                "number of vector irradiances",
                f64::from(u8::from(self.outputs.vector)),
                0.0,
                if self.has_tubes() { 0.0 } else { 1.0 },
            ),
            (
                "lightfield samples times modes",
                (lightfield.positions * lightfield.directions).pow(2) as f64
                    * lightfield.lightfield_modes as f64,
                1.0,
                MAX_LIGHTFIELD_NUMBERS,
            ),
            (
                "enrichment rounds",
                lightfield.enrichment_rounds as f64,
                0.0,
                8.0,
            ),
            (
                "enrichment weight",
                lightfield.enrichment_weight,
                0.0,
                100.0,
            ),
        ];
        for (what, found, low, high) in ranges {
            if !(low..=high).contains(&found) {
                return Err(ConfigError::OutOfRange {
                    what,
                    low,
                    high,
                    found,
                });
            }
        }
        Ok(())
    }

    /// The settings as text for people, kept in the file.
    pub fn describe(&self) -> String {
        let enrichment = match &self.enrichment {
            None => "not enriched".to_owned(),
            Some(e) => format!(
                "enriched (uniform {}, constant faces {}, indirect {})",
                e.uniform_weight, e.constant_weight, e.indirect_weight
            ),
        };
        let (prior, field, coupling) = (&self.prior, &self.lightfield, &self.coupling);
        let paths = if self.has_tubes() {
            String::new()
        } else {
            format!(
                " with paths of up to {} openings ({} with a hole), k_e <= {}, k_r <= {}",
                coupling.depth,
                coupling.hole_depth,
                coupling.emission_modes,
                coupling.response_modes
            )
        };
        let k_d = match prior.k_d {
            usize::MAX => "all".to_owned(),
            k_d => k_d.to_string(),
        };
        format!(
            "{0}² texels a wall, k_b <= {1}; prior of {2}³ lights of radius {3} inside and beyond each \
             opening, k_d {k_d}, {enrichment}; lightfields of {4}² positions x {5}² directions with {6}² \
             super-samples, k_rlf <= {7}, {8} enrichment rounds of weight {9}; {10}{paths}, up to {11} modes for foreign light, weight {12} \
             beyond openings; {13}³ probes{14}",
            self.resolution,
            self.modes,
            prior.lights_per_axis,
            prior.light_radius,
            field.positions,
            field.directions,
            field.super_samples,
            field.lightfield_modes,
            field.enrichment_rounds,
            field.enrichment_weight,
            self.shapes,
            coupling.foreign_modes,
            coupling.beyond_weight,
            self.outputs.probes,
            if self.outputs.vector {
                ", vector irradiance"
            } else {
                ""
            },
        )
    }
}

impl Default for PriorConfig {
    /// The paper's 6³ lights (section 7.1), and every vector that they span.
    fn default() -> Self {
        Self {
            lights_per_axis: 6,
            light_radius: 0.1,
            k_d: usize::MAX,
        }
    }
}

impl Default for Enrichment {
    fn default() -> Self {
        Self {
            uniform_weight: 10.0,
            constant_weight: 0.2,
            indirect_weight: 0.2,
        }
    }
}

impl Default for CouplingConfig {
    /// The standard preset's.
    fn default() -> Self {
        Self {
            emission_modes: 96,
            response_modes: 64,
            foreign_modes: 32,
            depth: 5,
            hole_depth: 3,
            beyond_weight: 1.0,
        }
    }
}

impl Default for LightfieldConfig {
    /// The paper's resolution and mode counts (section 7.1), with the super-sampling and the single round
    /// of enrichment that measured best.
    fn default() -> Self {
        Self {
            positions: 12,
            directions: 24,
            super_samples: 3,
            lightfield_modes: 128,
            enrichment_rounds: 1,
            enrichment_weight: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_in_range_and_zero_modes_are_not() {
        for name in PRESETS {
            let mut config = BakeConfig::preset(name).expect("a preset");
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
        assert!(BakeConfig::preset("ultra").is_err());
    }
}
