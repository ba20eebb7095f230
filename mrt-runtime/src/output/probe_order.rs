//! How much of the directions of light probes keep.

/// Coefficients of a probe: bands 0 to 2.
pub const PROBE_COEFFICIENTS: usize = 9;

/// How much of the light's directions probes keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ProbeOrder {
    /// Four coefficients: bands 0 and 1.
    L1,
    /// Nine: bands 0 to 2.
    L2,
}

impl ProbeOrder {
    /// Coefficients of a probe.
    pub fn coefficients(self) -> usize {
        match self {
            ProbeOrder::L1 => 4,
            ProbeOrder::L2 => 9,
        }
    }
}
