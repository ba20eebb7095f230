//! The order of the spherical harmonics of probes.

/// Most coefficients of a probe: bands 0 to 2.
pub const PROBE_COEFFICIENTS: usize = 9;

/// Order of a probe's spherical harmonics: how well it tells the directions of light apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ProbeOrder {
    /// Bands 0 and 1: four coefficients.
    L1,
    /// Bands 0 to 2: nine coefficients.
    L2,
}

impl ProbeOrder {
    /// Number of coefficients of a probe.
    pub fn coefficients(self) -> usize {
        match self {
            ProbeOrder::L1 => 4,
            ProbeOrder::L2 => 9,
        }
    }
}
