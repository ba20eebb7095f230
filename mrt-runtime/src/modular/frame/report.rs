//! What a frame says about itself.

use crate::level::block_index::BlockIndex;
use crate::modular::frame::light_list::SkippedLight;
#[cfg(feature = "timing")]
use crate::modular::frame::stage_clock::StageTimes;
use crate::output::lightmap_atlas::{LightmapAtlas, Tile};
use std::sync::Arc;

/// Blocks that a frame worked on, each once a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameWork {
    /// Blocks whose direct light was computed.
    pub direct: usize,
    /// Blocks whose coefficients b were computed.
    pub sources: usize,
    /// Blocks whose indirect light was computed.
    pub targets: usize,
    /// Blocks that changed light was sent to, but whose own light changes by no more than
    /// [`FrameConfig::tolerance`](crate::modular::frame::config::FrameConfig::tolerance) and therefore stays as it was.
    pub kept: usize,
    /// Channels that were scaled down because more light arrived in them than left; the next frame then computes all
    /// blocks anew.
    pub limited: usize,
}

/// What a frame did: lights left out, light that changed, and the work behind it.
///
/// A report is a snapshot that outlives the next frame. Frames allocate nothing as long as the report of the frame
/// before has been dropped by then.
#[derive(Clone, Debug)]
pub struct FrameReport(Arc<ReportData>);

impl FrameReport {
    /// Lights that did not shine in this frame, and why: values out of range, or a place in no block. All others did.
    pub fn skipped_lights(&self) -> &[SkippedLight] {
        &self.0.skipped
    }

    /// The first light that did not shine, as an error: for tools, whose lights must all shine.
    ///
    /// # Errors
    /// [`SkippedLight`], if there is one.
    pub fn require_all_lights(&self) -> Result<(), SkippedLight> {
        self.0.skipped.first().map_or(Ok(()), |&light| Err(light))
    }

    /// Blocks whose indirect light was written, in no order; what [`Frame::probes`](crate::modular::frame::Frame::probes)
    /// has for all others is as it was.
    pub fn changed_blocks(&self) -> &[BlockIndex] {
        &self.0.blocks
    }

    /// Tiles of the lightmap that were written, ascending; all others are as they were. None without a lightmap.
    pub fn changed_tiles(&self) -> impl ExactSizeIterator<Item = Tile> + '_ {
        let (columns, size) = (self.0.columns.max(1), self.0.tile_size);
        let tiles = self.0.tiles.iter();
        tiles.map(move |&tile| Tile::of_grid(tile as usize, columns, size))
    }

    /// Blocks that the frame worked on.
    pub fn work(&self) -> FrameWork {
        self.0.work
    }

    /// Passes over the reduced operators: one for each bounce that was computed.
    pub fn passes(&self) -> u32 {
        self.0.passes
    }

    /// Time that each stage took, summed over the passes.
    #[cfg(feature = "timing")]
    pub fn times(&self) -> StageTimes {
        self.0.times
    }
}

/// The data of a report, before it is given away.
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

/// Reports of a frame, whose memory is used again.
#[derive(Debug)]
pub(super) struct ReportSlot {
    last: Arc<ReportData>,
    blocks: usize,
    tiles: usize,
    columns: usize,
    tile_size: usize,
}

impl ReportSlot {
    /// For scenes of so many blocks.
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
        // The caller still has the last one: it stays as it is.
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

    /// The report that [`ReportSlot::begin`] gave to fill in.
    pub(super) fn data(&mut self) -> &mut ReportData {
        Arc::get_mut(&mut self.last).expect("a report is given away only when it is finished")
    }

    /// Gives away what [`ReportSlot::begin`] gave to fill in.
    pub(super) fn finish(&self) -> FrameReport {
        FrameReport(self.last.clone())
    }

    fn empty(&self) -> ReportData {
        ReportData {
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
