//! Settings of a bake and the named presets.

/// Everything that decides a dictionary's bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Name of the preset, kept in the file.
    pub preset: String,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Largest number of modes `k_b`.
    pub modes: usize,
    /// The light prior.
    pub prior: PriorConfig,
    /// Appendix A for blocks; `None` leaves the prior as it is.
    pub enrichment: Option<Enrichment>,
    /// Interface lightfields.
    pub lightfield: LightfieldConfig,
}

/// The light prior's samples.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorConfig {
    /// Lights along each axis, inside and beyond each opening.
    pub lights_per_axis: usize,
    /// Radius of the sphere lights, in block widths.
    pub light_radius: f64,
    /// Vectors kept, `k_d`. It costs nothing at run time.
    pub k_d: usize,
}

/// Weights of what joins the prior, relative to the prior's own Frobenius norm.
#[derive(Clone, Debug, PartialEq)]
pub struct Enrichment {
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
    /// Lightfield modes `k_rlf`.
    pub lightfield_modes: usize,
    /// Response modes `k_r`.
    pub response_modes: usize,
    /// Rounds of interface enrichment (appendix A).
    pub enrichment_rounds: usize,
    /// Frobenius weight of the propagated lightfields against the emitted ones.
    pub enrichment_weight: f64,
}

impl Default for LightfieldConfig {
    fn default() -> Self {
        Self {
            positions: 12,
            directions: 24,
            super_samples: 3,
            lightfield_modes: 128,
            response_modes: 32,
            enrichment_rounds: 1,
            enrichment_weight: 1.0,
        }
    }
}
