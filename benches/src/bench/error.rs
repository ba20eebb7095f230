//! Why there is no benchmark.

use super::exact_light::ExactLightError;
use super::measure_error::MeasureError;
use mrt_dictionary::config::ConfigError;
use mrt_dictionary::progress::Cancelled;
use mrt_editor::cli::dictionary_source::SourceError;
use mrt_editor::cli::output::ReportError;
use mrt_editor::cli::output_files::OutputError;
use mrt_editor::render::file::WriteError;

/// Why there is no benchmark.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A setting of a bake is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The user stopped it.
    #[error("{0}; no table and no plot was written")]
    Cancelled(#[from] Cancelled),
    /// A measurement failed.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// No exact light.
    #[error(transparent)]
    Exact(#[from] ExactLightError),
    /// Files cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A record has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}

impl BenchError {
    /// Makes [`BenchError::Cancelled`] of an interrupt, wherever it came from.
    pub(super) fn with_interrupts_on_top(self) -> Self {
        match self {
            BenchError::Measure(
                MeasureError::Cancelled(cancelled)
                | MeasureError::Exact(ExactLightError::Cancelled(cancelled)),
            )
            | BenchError::Exact(ExactLightError::Cancelled(cancelled)) => cancelled.into(),
            other => other,
        }
    }
}
