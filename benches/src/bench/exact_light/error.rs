//! Why there is no exact light.

use mrt_core::container::ContainerError;
use mrt_core::reference::radiosity::ExactError;
use mrt_dictionary::progress::Cancelled;
use mrt_runtime::LevelTextError;

/// Why there is no exact light.
#[derive(Debug, thiserror::Error)]
pub enum ExactLightError {
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The exact solver refuses the level.
    #[error("exact solution: {0}")]
    Exact(#[from] ExactError),
    /// The level has no form as text, by which its solution is found again.
    #[error(transparent)]
    Text(#[from] LevelTextError),
    /// The solution cannot be kept.
    #[error(transparent)]
    File(#[from] ContainerError),
    /// The solution cannot be encoded.
    #[error("the exact solution cannot be written: {0}")]
    Json(#[from] serde_json::Error),
}
