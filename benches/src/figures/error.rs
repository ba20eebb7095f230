//! Why figures are missing.

use mrt_core::reference::oracle_file::ReferenceError;
use mrt_core::reference::radiosity::ExactError;
use mrt_dictionary::progress::Cancelled;
use mrt_editor::accuracy::reference_file::CompareError;
use mrt_editor::cli::dictionary_source::SourceError;
use mrt_editor::cli::output::ReportError;
use mrt_editor::cli::output_files::OutputError;
use mrt_editor::render::file::WriteError;
use mrt_editor::render::level_view::ViewError;
use mrt_runtime::{AssembleError, LevelTextError, SkippedLight};

/// Why a figure was not drawn.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// There is nothing to compare with.
    #[error(
        "the reference files are absent; expected them in the folder oracle of shared/ or of $MRT_SHARED"
    )]
    NoReferences,
    /// The dictionary lacks what the figure shows.
    #[error(
        "the dictionary has no {missing}; expected one that `mrt bake` wrote with its defaults"
    )]
    NotInDictionary {
        /// What it lacks.
        missing: &'static str,
    },
    /// There is no further dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The user stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A reference is at fault.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A comparison failed.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The exact solver refuses.
    #[error("exact solution: {0}")]
    Exact(#[from] ExactError),
    /// The built-in level is at fault.
    #[error("the built-in maze: {0}")]
    Level(#[from] LevelTextError),
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// A light does not shine.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// Nothing can be seen.
    #[error(transparent)]
    View(#[from] ViewError),
}

impl FigureError {
    /// True if the figure's source is absent; nothing is then at fault.
    pub(super) fn is_absence(&self) -> bool {
        matches!(
            self,
            FigureError::NoReferences | FigureError::NotInDictionary { .. }
        )
    }
}

/// Why figures are missing.
#[derive(Debug, thiserror::Error)]
pub enum FiguresError {
    /// No dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Files cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A picture cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Some figures could not be drawn; the others were.
    #[error("{failed} of {count} figures could not be drawn (see above)")]
    Some {
        /// How many failed.
        failed: usize,
        /// How many were to be drawn.
        count: usize,
    },
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}
