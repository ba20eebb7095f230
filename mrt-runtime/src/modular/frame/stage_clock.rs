//! Measures each stage of a frame. Without the feature `timing`, nothing is measured and no clock is read.

#[cfg(feature = "timing")]
use std::time::Duration;
#[cfg(feature = "timing")]
use web_time::Instant;

/// Time of each stage of a frame, summed over its passes.
#[cfg(feature = "timing")]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Direct light.
    pub direct: Duration,
    /// `b = T_d->b l`.
    pub coefficients: Duration,
    /// `r = T_b->r b`.
    pub responses: Duration,
    /// Irradiance from the joint basis, `U_b b + U_r r`.
    pub indirect: Duration,
    /// The lightmap, if asked for.
    pub lightmap: Duration,
    /// Probes, if asked for.
    pub probes: Duration,
    /// Vector irradiance, if asked for.
    pub vector: Duration,
}

#[cfg(feature = "timing")]
impl StageTimes {
    /// Sum over the stages.
    pub fn total(&self) -> Duration {
        self.direct
            + self.coefficients
            + self.responses
            + self.indirect
            + self.lightmap
            + self.probes
            + self.vector
    }
}

/// A stage of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    Direct,
    Coefficients,
    Responses,
    Indirect,
    Lightmap,
    Probes,
    Vector,
}

/// Adds up the time of each stage.
#[derive(Debug)]
pub(super) struct StageClock {
    #[cfg(feature = "timing")]
    last: Instant,
    #[cfg(feature = "timing")]
    times: StageTimes,
}

#[cfg(feature = "timing")]
impl StageClock {
    pub(super) fn start() -> Self {
        Self {
            last: Instant::now(),
            times: StageTimes::default(),
        }
    }

    /// Adds the time since the last call, or since the start, to a stage.
    pub(super) fn lap(&mut self, stage: Stage) {
        let now = Instant::now();
        let time = match stage {
            Stage::Direct => &mut self.times.direct,
            Stage::Coefficients => &mut self.times.coefficients,
            Stage::Responses => &mut self.times.responses,
            Stage::Indirect => &mut self.times.indirect,
            Stage::Lightmap => &mut self.times.lightmap,
            Stage::Probes => &mut self.times.probes,
            Stage::Vector => &mut self.times.vector,
        };
        *time += now - std::mem::replace(&mut self.last, now);
    }

    pub(super) fn times(&self) -> StageTimes {
        self.times
    }
}

#[cfg(not(feature = "timing"))]
impl StageClock {
    pub(super) fn start() -> Self {
        Self {}
    }

    pub(super) fn lap(&mut self, _: Stage) {}
}
