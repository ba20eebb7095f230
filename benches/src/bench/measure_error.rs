//! Why a level was not measured.

use super::dense::DenseError;
use super::exact_light::ExactLightError;
use super::library::WrongProduct;
use super::paper::PaperError;
use super::timed_frame::TimedFrameError;
use mrt_dictionary::progress::Cancelled;

/// How far the sum of all light may be from the exact one. Bases of few modes and sampled direct light move it by up to
/// 4 %, bounded virtual lights by 8 %, and rays by their noise.
pub(super) const FLUX_TOLERANCE: f64 = 0.15;

/// Why a level was not measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A frame cannot be measured.
    #[error("{case}: {source}")]
    Frame {
        /// What was measured.
        case: String,
        /// Why not.
        source: TimedFrameError,
    },
    /// The paper's products cannot be measured.
    #[error(transparent)]
    Paper(#[from] PaperError),
    /// The level has no dense operator.
    #[error(transparent)]
    Dense(#[from] DenseError),
    /// A library is wrong.
    #[error(transparent)]
    Product(#[from] WrongProduct),
    /// There is no exact light.
    #[error(transparent)]
    Exact(#[from] ExactLightError),
    /// The system gives no threads to compare with.
    #[error("no threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A method gives another light than the level's.
    #[error(
        "{case}: indirect light is {found:.3} times the exact one in all; expected within {FLUX_TOLERANCE} of 1"
    )]
    Light {
        /// What was measured.
        case: String,
        /// Its flux over the exact one.
        found: f64,
    },
}
