//! `mrt map`: writes a level around a mesh.

use crate::cli::import_args::{ImportArgs, import_hint, print_import, warn_of_import};
use crate::cli::output::{ReportError, print_report, print_row};
use crate::cli::output_files::{OutputError, OutputFiles};
use crate::document::level_file::{LevelFileError, write_level};
use crate::fit_level::config::{Fit, MapConfig, MapError};
use crate::fit_level::paint::{Coverage, PaintReport, PaintedMesh};
use crate::fit_level::voxels::Winding;
use crate::fit_level::{Mapped, map_mesh};
use crate::import::error::ImportError;
use crate::import::read_scene;
use crate::import::report::ImportReport;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Maps a mesh to a level of connected blocks.
#[derive(Clone, Debug, clap::Args)]
pub struct MapArgs {
    /// Mesh to map: .obj, .glb or .gltf.
    #[arg(long)]
    pub scene: PathBuf,
    /// Level file to write.
    #[arg(long)]
    pub out: PathBuf,
    /// One closed block around everything, or connected blocks that fill the free space.
    #[arg(long, value_enum, default_value = "grid")]
    pub fit: Fit,
    /// Wanted width of a block, metres [default: the rooms' typical height].
    #[arg(long)]
    pub cell: Option<f64>,
    /// Most blocks to make.
    #[arg(long, default_value_t = MapConfig::default().max_blocks)]
    pub max_blocks: usize,
    /// Least share of the side between two cells that must be open for light to pass.
    #[arg(long, default_value_t = MapConfig::default().openness)]
    pub openness: f64,
    /// Grid lines across which less than this share of the room changes are taken out.
    #[arg(long, default_value_t = MapConfig::default().tolerance)]
    pub tolerance: f64,
    /// Groups of joined cells below this share of the free volume are dropped.
    #[arg(long, default_value_t = MapConfig::default().crumb_share)]
    pub crumbs: f64,
    /// Which side of the triangles faces the rooms.
    #[arg(long, value_enum, default_value = "auto")]
    pub winding: Winding,
    /// How the mesh is read.
    #[command(flatten)]
    pub import: ImportArgs,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Why no level was written.
#[derive(Debug, thiserror::Error)]
pub enum MapCommandError {
    /// The mesh cannot be read.
    #[error("{source}{}", import_hint(source))]
    Import {
        /// Why.
        #[from]
        source: ImportError,
    },
    /// The mesh has no level.
    #[error("{source}{}", hint(source))]
    Map {
        /// Why.
        #[from]
        source: MapError,
    },
    /// The level has no text, or its file cannot be written.
    #[error(transparent)]
    Level(#[from] LevelFileError),
    /// The report has no form as JSON.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The level cannot be written there.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// The flags that may help, as the end of an error's line.
fn hint(error: &MapError) -> &'static str {
    match error {
        MapError::NoFreeSpace => {
            "; try --winding both, or --fit box for one block around everything"
        }
        MapError::Solid => {
            "; if these are rooms seen from behind, try --winding back, or --winding both"
        }
        MapError::CellTooLarge { .. } | MapError::CellTooSmall { .. } => " (see --cell)",
        MapError::TooDense => " (try a larger --cell)",
        _ => "",
    }
}

#[derive(Serialize)]
struct Report {
    mesh: ImportReport,
    blocks: usize,
    connections: usize,
    shapes: BTreeMap<&'static str, usize>,
    cell_m: f64,
    dropped_crumbs: usize,
    dropped_misfits: usize,
    closed_passages: usize,
    faces_reversed: bool,
    area_share: Coverage,
    paint: PaintReport,
    seconds: f64,
}

/// Reads the mesh, maps it, writes the level and prints a report.
///
/// # Errors
/// [`MapCommandError`]; then no file is written or changed.
pub fn run(args: &MapArgs) -> Result<(), MapCommandError> {
    OutputFiles::new([&*args.scene]).check_file("--out", &args.out)?;
    let start = Instant::now();
    let scene = read_scene(&args.scene, &args.import.config())?;
    warn_of_import(&scene.report);
    let painted = PaintedMesh {
        mesh: &scene.mesh,
        colours: &scene.colours,
    };
    let mut mapped = map_mesh(painted, &config(args))?;
    mapped.level.mesh = Some(scene.reading);
    write_level(&args.out, &mapped.level)?;
    let report = Report::new(scene.report, &mapped, start);
    Ok(print_report(&report, args.json, Report::print)?)
}

fn config(args: &MapArgs) -> MapConfig {
    MapConfig {
        fit: args.fit,
        cell: args.cell,
        max_blocks: args.max_blocks,
        openness: args.openness,
        tolerance: args.tolerance,
        crumb_share: args.crumbs,
        winding: args.winding,
    }
}

impl Report {
    fn new(mesh: ImportReport, mapped: &Mapped, start: Instant) -> Self {
        let mut shapes = BTreeMap::new();
        for block in &mapped.level.blocks {
            *shapes.entry(block.shape.name).or_default() += 1;
        }
        Self {
            mesh,
            blocks: mapped.level.blocks.len(),
            connections: mapped.level.connections.len(),
            shapes,
            cell_m: mapped.cell,
            dropped_crumbs: mapped.crumbs,
            dropped_misfits: mapped.misfits,
            closed_passages: mapped.closed_passages,
            faces_reversed: mapped.is_reversed,
            area_share: mapped.coverage,
            paint: mapped.paint,
            seconds: start.elapsed().as_secs_f64(),
        }
    }

    fn print(&self) {
        print_import(&self.mesh);
        print_row("blocks", self.blocks);
        print_row("connections", self.connections);
        for (shape, count) in &self.shapes {
            print_row(&format!("  {shape}"), count);
        }
        print_row("cell", format!("{:.3} m", self.cell_m));
        print_row("dropped crumbs", self.dropped_crumbs);
        print_row("dropped misfits", self.dropped_misfits);
        print_row("closed passages", self.closed_passages);
        if self.faces_reversed {
            print_row(
                "faces",
                "turned away from the rooms; taken as reversed (a solid, such as a statue, has no rooms)",
            );
        }
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        print_row("area inside blocks", percent(self.area_share.inside));
        print_row("area in or near", percent(self.area_share.near));
        let moved = self.paint.moved_walls;
        print_row("albedos of walls", format!("{moved} moved into 0.05..0.9"));
        let watts = |[r, g, b]: [f64; 3]| format!("({r:.3}, {g:.3}, {b:.3}) W");
        if self.mesh.emissive_materials > 0 {
            let walls = self.paint.emissive_walls;
            let emitted = watts(self.paint.emitted_w);
            print_row("emission", format!("{emitted} from {walls} walls"));
        }
        if self.paint.lost_emission_w != [0.0; 3] {
            let lost = watts(self.paint.lost_emission_w);
            print_row("  left out", format!("{lost} too far from every block"));
        }
        print_row("seconds", format!("{:.2}", self.seconds));
    }
}
