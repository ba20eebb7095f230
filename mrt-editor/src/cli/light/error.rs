//! Why `mrt light` stops.

use crate::cli::dictionary_source::SourceError;
use crate::cli::hint::after_assembly;
use crate::cli::import_args::{ReadingMismatch, import_hint};
use crate::cli::output::ReportError;
use crate::cli::output_files::OutputError;
use crate::document::level_file::LevelFileError;
use crate::import::error::ImportError;
use crate::render::file::WriteError;
use glam::DVec3;
use mrt_runtime::{AssembleError, SkippedLight};
use std::path::PathBuf;

/// Why there are no pictures.
#[derive(Debug, thiserror::Error)]
pub enum LightCommandError {
    /// The output would replace the mesh or the level.
    #[error("--out {}: found the folder of {}; expected a folder of its own", out.display(), input.display())]
    OutHoldsInput {
        /// The output folder.
        out: PathBuf,
        /// The input in it.
        input: PathBuf,
    },
    /// The output folder is refused.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The mesh does not lie where the level is.
    #[error(
        "level {}: {:.1} % of the mesh's area lies in or near a block; expected at least {:.0} % (is it this \
         mesh's level, and are --scale and --up those of `mrt map`?)",
        path.display(), 100.0 * found, 100.0 * expected
    )]
    OtherMesh {
        /// The level file.
        path: PathBuf,
        /// Smallest share of the mesh's area accepted.
        expected: f64,
        /// Share of the mesh's area in or near a block.
        found: f64,
    },
    /// The mesh cannot be read.
    #[error("{source}{}", import_hint(source))]
    Import {
        /// Why.
        #[from]
        source: ImportError,
    },
    /// The level's file is at fault.
    #[error(transparent)]
    Level(#[from] LevelFileError),
    /// A flag contradicts the level.
    #[error(transparent)]
    Reading(#[from] ReadingMismatch),
    /// There is no dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Level and dictionary do not fit.
    #[error("{0}{hint}", hint = after_assembly(.0))]
    Assemble(#[from] AssembleError),
    /// A light is refused.
    #[error(transparent)]
    Skipped(#[from] SkippedLight),
    /// A light is outside every block.
    #[error(
        "light {light} at {position} m lies in no block: {distance:.3} m outside block {block}, the \
         nearest; expected a point inside the level"
    )]
    OutsideBlocks {
        /// Which light.
        light: usize,
        /// Its position, metres.
        position: DVec3,
        /// The nearest block.
        block: usize,
        /// Metres to the block.
        distance: f64,
    },
    /// A light is behind the mesh's faces.
    #[error(
        "light {light} at {position} m lies inside a wall: it sees the backs of faces in {backs:.0} % \
         of all directions; expected a point in a room"
    )]
    InWall {
        /// Which light.
        light: usize,
        /// Its position.
        position: DVec3,
        /// Directions in which it sees the backs of faces, percent.
        backs: f32,
    },
    /// There is no place for the default light.
    #[error(
        "no light was given and none of the level's blocks has free space at its centre; expected \
         --light x,y,z,intensity"
    )]
    NoPlace,
    /// The camera has no direction.
    #[error("--camera {from};{to}: expected two different points")]
    Camera {
        /// Where it stands.
        from: DVec3,
        /// Where it looks.
        to: DVec3,
    },
    /// The files cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
}
