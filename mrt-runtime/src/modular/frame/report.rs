//! The report of a frame.

use crate::level::block_index::BlockIndex;
use crate::light::limits::MAX_LIGHTS;
use crate::modular::frame::light_list::SkippedLight;
#[cfg(feature = "timing")]
use crate::modular::frame::stage_clock::StageTimes;
use crate::output::lightmap_atlas::{LightmapAtlas, Tile};
use std::sync::Arc;

/// Numbers of blocks that a frame worked on; a block counts once in each pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameWork {
    /// Blocks whose direct light was computed.
    pub direct: usize,
    /// Blocks whose coefficients b were computed.
    pub sources: usize,
    /// Blocks whose indirect light was computed.
    pub targets: usize,
    /// Blocks that changed light was sent to, but whose own light would change by no more than
    /// [`FrameConfig::tolerance`](crate::modular::frame::config::FrameConfig::tolerance), and therefore stayed the
    /// same.
    pub kept: usize,
    /// Colour channels that were scaled down because more light arrived than left. The next pass then computes all
    /// blocks again.
    pub limited: usize,
}

/// What a solve did: lights that were skipped, blocks and tiles that changed, and the work that it took.
///
/// Later solves do not change a report. A solve allocates a new one if the previous report still exists.
#[derive(Clone, Debug)]
pub struct FrameReport(Arc<ReportData>);

impl FrameReport {
    /// Lights that did not shine in this frame, and why. All other lights did.
    pub fn skipped_lights(&self) -> &[SkippedLight] {
        &self.0.skipped
    }

    /// Fails if a light did not shine: for tools, whose lights must all shine.
    ///
    /// # Errors
    /// The first [`SkippedLight`].
    pub fn require_all_lights(&self) -> Result<(), SkippedLight> {
        self.0.skipped.first().map_or(Ok(()), |&light| Err(light))
    }

    /// Blocks whose indirect light was written, in no particular order. The light of all other blocks, in
    /// [`Frame::probes`](crate::modular::frame::Frame::probes) too, is unchanged.
    pub fn changed_blocks(&self) -> &[BlockIndex] {
        &self.0.blocks
    }

    /// Tiles of the lightmap that were written, in ascending order; all other tiles are unchanged. Empty without a
    /// lightmap.
    pub fn changed_tiles(&self) -> impl ExactSizeIterator<Item = Tile> + '_ {
        let (columns, size) = (self.0.columns.max(1), self.0.tile_size);
        let tiles = self.0.tiles.iter();
        tiles.map(move |&tile| Tile::of_grid(tile as usize, columns, size))
    }

    /// Numbers of blocks that the frame worked on.
    pub fn work(&self) -> FrameWork {
        self.0.work
    }

    /// Number of passes over the reduced operators: one for each bounce that was computed.
    pub fn passes(&self) -> u32 {
        self.0.passes
    }

    /// Time of each stage, summed over the passes.
    #[cfg(feature = "timing")]
    pub fn times(&self) -> StageTimes {
        self.0.times
    }
}

/// The data of a report.
#[derive(Debug, Default)]
pub(super) struct ReportData {
    pub skipped: Vec<SkippedLight>,
    pub blocks: Vec<BlockIndex>,
    pub tiles: Vec<u32>,
    pub work: FrameWork,
    pub passes: u32,
    #[cfg(feature = "timing")]
    pub times: StageTimes,
    columns: usize,
    tile_size: usize,
}

/// Makes the reports of a frame, and uses their memory again.
#[derive(Debug)]
pub(super) struct ReportSlot {
    last: Arc<ReportData>,
    blocks: usize,
    tiles: usize,
    columns: usize,
    tile_size: usize,
}

impl ReportSlot {
    /// For a scene with `blocks` blocks.
    pub(super) fn new(blocks: usize, atlas: &LightmapAtlas) -> Self {
        let mut slot = Self {
            last: Arc::default(),
            blocks,
            tiles: atlas.tile_list_size(),
            columns: atlas.columns(),
            tile_size: atlas.tile_size(),
        };
        slot.last = Arc::new(slot.empty());
        slot
    }

    /// An empty report to fill in.
    pub(super) fn begin(&mut self) -> &mut ReportData {
        // The caller still has the last report, which must not change.
        if Arc::get_mut(&mut self.last).is_none() {
            self.last = Arc::new(self.empty());
        }
        let empty = self.empty_without_room();
        let data = Arc::get_mut(&mut self.last).expect("nobody else has a new report");
        let (mut skipped, mut blocks, mut tiles) = (
            std::mem::take(&mut data.skipped),
            std::mem::take(&mut data.blocks),
            std::mem::take(&mut data.tiles),
        );
        skipped.clear();
        blocks.clear();
        tiles.clear();
        *data = ReportData {
            skipped,
            blocks,
            tiles,
            ..empty
        };
        data
    }

    /// The report of the present solve. [`ReportSlot::begin`] must come before.
    pub(super) fn data(&mut self) -> &mut ReportData {
        Arc::get_mut(&mut self.last).expect("a report is given away only when it is finished")
    }

    /// The finished report, for the caller.
    pub(super) fn finish(&self) -> FrameReport {
        FrameReport(self.last.clone())
    }

    fn empty(&self) -> ReportData {
        ReportData {
            skipped: Vec::with_capacity(MAX_LIGHTS),
            blocks: Vec::with_capacity(self.blocks),
            tiles: Vec::with_capacity(self.tiles),
            ..self.empty_without_room()
        }
    }

    fn empty_without_room(&self) -> ReportData {
        ReportData {
            columns: self.columns,
            tile_size: self.tile_size,
            ..ReportData::default()
        }
    }
}
