//! Settings of a bake and the named presets.

mod check;

use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::{SHAPE_SETS, shape_set};

/// Everything that decides a dictionary's bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Name of the preset, kept in the file.
    pub preset: String,
    /// Texels along an edge of a wall, 1 to [`MAX_BAKE_RESOLUTION`].
    pub resolution: usize,
    /// Largest number of modes `k_b`; fewer are kept where a multiplet would be cut.
    pub modes: usize,
    /// The light prior.
    pub prior: PriorConfig,
    /// Enrichment of the prior (appendix A); `None` leaves the prior as it is.
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
    /// Largest number of emission modes.
    pub emission_modes: usize,
    /// Largest number of response modes `k_r`.
    pub response_modes: usize,
    /// Largest number of modes that light from other blocks adds to a shape's own.
    pub foreign_modes: usize,
    /// Largest number of openings that a path of the table crosses, 1 to 8.
    pub depth: usize,
    /// The same for paths through a hole in a wall.
    pub hole_depth: usize,
    /// Weight of the light on the walls beyond each opening against the light on the shape's own walls, when its modes
    /// are chosen.
    pub beyond_weight: f64,
}

/// What is computed besides irradiance.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputConfig {
    /// Probes along an edge of a block, 0 to 8; 0 for none. Tubes have none.
    pub probes: usize,
    /// True for vector irradiance, four coefficients a texel. Tubes have none.
    pub vector: bool,
}

/// The light prior's samples.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorConfig {
    /// Lights along each axis, in the block and beyond each opening, 1 to 32.
    pub lights_per_axis: usize,
    /// Radius of the sphere lights, in block widths, 0 to 1.
    pub light_radius: f64,
    /// Largest number of vectors `k_d`. Vectors cost nothing at run time, so presets keep all of them.
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
    /// Weight of uniform light.
    pub uniform_weight: f64,
    /// Weight of the functions that are constant on one wall.
    pub constant_weight: f64,
    /// Weight of the indirect basis.
    pub indirect_weight: f64,
}

/// The interface lightfields.
#[derive(Clone, Debug, PartialEq)]
pub struct LightfieldConfig {
    /// Positions along each axis of an opening, 1 to 64.
    pub positions: usize,
    /// Directions along each axis of the hemisphere's square, 2 to 64.
    pub directions: usize,
    /// Super-samples along each axis of a direction cell, 1 to 9.
    pub super_samples: usize,
    /// Largest number of lightfield modes `k_rlf`.
    pub lightfield_modes: usize,
    /// Rounds of interface enrichment (appendix A), 0 to 8.
    pub enrichment_rounds: usize,
    /// Weight of the propagated lightfields against the emitted ones, in Frobenius norm.
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
    /// An output that round tubes do not have.
    #[error("the set `{set}` has round tubes, which have no {output}")]
    NotOfTubes {
        /// The set of shapes.
        set: String,
        /// Which output.
        output: &'static str,
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

/// Names of the presets.
pub const PRESETS: [&str; 4] = ["mobile", "standard", "high", "quality"];

/// The settings in which presets differ.
struct PresetSizes {
    resolution: usize,
    modes: usize,
    lightfield_modes: usize,
    emission_modes: usize,
    response_modes: usize,
    foreign_modes: usize,
    depth: usize,
    probes: usize,
}

impl PresetSizes {
    const MOBILE: Self = Self {
        resolution: 5,
        modes: 12,
        lightfield_modes: 64,
        emission_modes: 32,
        response_modes: 24,
        foreign_modes: 8,
        depth: 4,
        probes: 2,
    };
    const STANDARD: Self = Self {
        resolution: 16,
        modes: 32,
        lightfield_modes: 128,
        emission_modes: 96,
        response_modes: 64,
        foreign_modes: 32,
        depth: 5,
        probes: 4,
    };
    const HIGH: Self = Self {
        modes: 64,
        lightfield_modes: 192,
        emission_modes: 160,
        response_modes: 160,
        foreign_modes: 48,
        ..Self::STANDARD
    };
    const QUALITY: Self = Self {
        modes: 96,
        foreign_modes: 96,
        ..Self::HIGH
    };

    fn of(name: &str) -> Option<Self> {
        match name {
            "mobile" => Some(Self::MOBILE),
            "standard" => Some(Self::STANDARD),
            "high" => Some(Self::HIGH),
            "quality" => Some(Self::QUALITY),
            _ => None,
        }
    }
}

impl BakeConfig {
    /// A named preset: `mobile` (5² texels, 12 modes), `standard` (16², 32), `high` (16², 64) or `quality` (16², 96).
    ///
    /// # Errors
    /// [`ConfigError::UnknownPreset`].
    pub fn preset(name: &str) -> Result<Self, ConfigError> {
        let sizes = PresetSizes::of(name).ok_or_else(|| ConfigError::UnknownPreset {
            found: name.to_owned(),
        })?;
        Ok(Self {
            preset: name.to_owned(),
            resolution: sizes.resolution,
            modes: sizes.modes,
            prior: PriorConfig::default(),
            enrichment: Some(Enrichment::default()),
            lightfield: LightfieldConfig {
                lightfield_modes: sizes.lightfield_modes,
                ..LightfieldConfig::default()
            },
            shapes: SHAPE_SETS[0].0.to_owned(),
            coupling: CouplingConfig {
                emission_modes: sizes.emission_modes,
                response_modes: sizes.response_modes,
                foreign_modes: sizes.foreign_modes,
                depth: sizes.depth,
                ..CouplingConfig::default()
            },
            outputs: OutputConfig {
                probes: sizes.probes,
                vector: false,
            },
        })
    }

    /// The preset for a set of shapes. Sets of tubes have 32² texels a chart (`mobile` has 12²) and no probes.
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

    /// The settings as text for people, which is kept in the file.
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
