//! How blocks are laid around a mesh, and why there may be none.

use super::voxels::{MOST_CROSSINGS, Winding};
use mrt_runtime::LevelError;

/// How blocks are laid around a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapConfig {
    /// One box or a grid.
    pub fit: Fit,
    /// Wanted width of a block, metres; by default the rooms' typical height.
    pub cell: Option<f64>,
    /// Most blocks to make; at least 1.
    pub max_blocks: usize,
    /// Least share of the side between two cells that must be open to join them, in [0, 1].
    pub openness: f64,
    /// Grid lines whose sides disagree by less than this share are taken out, in [0, 1].
    pub tolerance: f64,
    /// Groups of joined cells below this share of the free volume are dropped, in [0, 1].
    pub crumb_share: f64,
    /// Which side of the triangles faces the rooms.
    pub winding: Winding,
}

impl Default for MapConfig {
    fn default() -> Self {
        Self {
            fit: Fit::Grid,
            cell: None,
            max_blocks: 200,
            openness: 0.25,
            tolerance: 0.15,
            crumb_share: 0.01,
            winding: Winding::Auto,
        }
    }
}

/// The kind of level to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Fit {
    /// One closed block around everything.
    Box,
    /// Connected blocks that fill the free space.
    Grid,
}

/// Why a mesh has no level.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// No block is allowed.
    #[error("at most 0 blocks; expected at least 1")]
    NoBlocks,
    /// No point has a floor below and walls around.
    #[error(
        "the scene encloses no free space: found no point with a floor below and faces towards it on most sides"
    )]
    NoFreeSpace,
    /// The mesh is closed and all its faces look outwards.
    #[error(
        "the scene is solid: its faces look outwards and enclose no free space; expected rooms, whose faces look inwards"
    )]
    Solid,
    /// Rooms are lost between voxels as coarse as the cells ask for.
    #[error("cells of {found} m; expected at most {expected:.3} m for rooms of this height")]
    CellTooLarge {
        /// Largest accepted, metres.
        expected: f64,
        /// The size given.
        found: f64,
    },
    /// Too many triangles lie over one another.
    #[error(
        "the scene's triangles overlap too much: found over {MOST_CROSSINGS} crossings of voxel rows; expected a level of \
         rooms"
    )]
    TooDense,
    /// The cell size is not a positive number.
    #[error("cells of {found} m; expected a positive number of metres")]
    Cell {
        /// The size given.
        found: f64,
    },
    /// The free space cannot be found finely enough to tell blocks of this size apart.
    #[error(
        "cells of {found} m; expected at least {expected:.3} m, the edge of the finest voxel for this mesh"
    )]
    CellTooSmall {
        /// Smallest accepted, metres.
        expected: f64,
        /// The size given.
        found: f64,
    },
    /// A share is not in [0, 1].
    #[error("{name} {found}; expected a number from 0 to 1")]
    Share {
        /// Which share.
        name: &'static str,
        /// The value given.
        found: f64,
    },
    /// The blocks found are no level.
    #[error(transparent)]
    Level(#[from] LevelError),
}

impl MapConfig {
    /// Checks all ranges.
    ///
    /// # Errors
    /// [`MapError::Cell`], [`MapError::NoBlocks`] and [`MapError::Share`].
    pub fn check(&self) -> Result<(), MapError> {
        let is_width = |cell: &f64| cell.is_finite() && *cell > 0.0;
        if let Some(found) = self.cell.filter(|cell| !is_width(cell)) {
            return Err(MapError::Cell { found });
        }
        if self.max_blocks == 0 {
            return Err(MapError::NoBlocks);
        }
        for (name, found) in [
            ("openness", self.openness),
            ("tolerance", self.tolerance),
            ("crumbs", self.crumb_share),
        ] {
            if !(0.0..=1.0).contains(&found) {
                return Err(MapError::Share { name, found });
            }
        }
        Ok(())
    }
}
