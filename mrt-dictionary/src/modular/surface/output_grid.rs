//! How finely the outputs of a block are sampled.

use crate::config::BakeConfig;

/// The places at which a block's light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputGrid {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Probes along an edge of the block; 0 for none.
    pub probes: usize,
    /// True if vector irradiance is computed besides irradiance: four coefficients a texel.
    pub vector: bool,
}

impl OutputGrid {
    /// The grid that a bake is asked for.
    pub fn of(config: &BakeConfig) -> Self {
        Self {
            resolution: config.resolution,
            probes: config.outputs.probes,
            vector: config.outputs.vector,
        }
    }
}
