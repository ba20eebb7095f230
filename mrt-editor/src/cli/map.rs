//! `mrt map`: writes a level around a mesh.

use crate::cli::output::is_same_place;
use crate::fit_level::paint::Coverage;
use crate::fit_level::voxels::Winding;
use crate::fit_level::{Fit, MapConfig, MapError, Mapped, map_mesh};
use crate::import::error::ImportError;
use crate::import::report::ImportReport;
use crate::import::{ImportConfig, UpAxis, read_scene};
use mrt_core::container::{ContainerError, write_file_atomically};
use mrt_runtime::LevelTextError;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Maps a mesh to a level of connected blocks.
#[derive(Clone, Debug, clap::Args)]
pub struct MapArgs {
    /// Mesh to map: .obj or .glb.
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

/// How a mesh is read; `map` and `light` must be given the same.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ImportArgs {
    /// Metres per unit of the mesh file.
    #[arg(long, default_value_t = 1.0)]
    pub scale: f64,
    /// The mesh file's vertical axis.
    #[arg(long, value_enum, default_value = "y")]
    pub up: UpAxis,
    /// Albedo for everything, 0 to 1, instead of the mesh's colours.
    #[arg(long)]
    pub albedo: Option<f32>,
}

impl ImportArgs {
    /// The same as settings.
    pub fn config(&self) -> ImportConfig {
        ImportConfig {
            scale: self.scale,
            up: self.up,
            albedo: self.albedo,
        }
    }
}

/// Why no level was written.
#[derive(Debug, thiserror::Error)]
pub enum MapCommandError {
    /// The mesh cannot be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The mesh has no level.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The level has no text.
    #[error(transparent)]
    Text(#[from] LevelTextError),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] ContainerError),
    /// The level would replace the mesh.
    #[error("--out {}: found the mesh itself; expected another file", path.display())]
    OutIsScene {
        /// The file.
        path: PathBuf,
    },
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
    seconds: f64,
}

/// Reads the mesh, maps it, writes the level and prints a report.
///
/// # Errors
/// [`MapCommandError`]; then no file is written or changed.
pub fn run(args: &MapArgs) -> Result<(), MapCommandError> {
    if is_same_place(&args.scene, &args.out) {
        return Err(MapCommandError::OutIsScene {
            path: args.out.clone(),
        });
    }
    let start = Instant::now();
    let scene = read_scene(&args.scene, &args.import.config())?;
    let config = MapConfig {
        fit: args.fit,
        cell: args.cell,
        max_blocks: args.max_blocks,
        openness: args.openness,
        tolerance: args.tolerance,
        crumb_share: args.crumbs,
        winding: args.winding,
    };
    let mapped = map_mesh(&scene.mesh, &config)?;
    write_file_atomically(&args.out, mapped.level.to_text()?.as_bytes())?;
    let report = Report::new(scene.report, &mapped, start);
    if args.json {
        // A struct of numbers and names always has a text.
        crate::report_line!("{}", serde_json::to_string(&report).unwrap_or_default());
    } else {
        report.print();
    }
    Ok(())
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
            seconds: start.elapsed().as_secs_f64(),
        }
    }

    fn print(&self) {
        let mesh = &self.mesh;
        mesh.print();
        let row = |name: &str, value: String| crate::report_line!("{name:<22} {value}");
        row("blocks", self.blocks.to_string());
        row("connections", self.connections.to_string());
        for (shape, count) in &self.shapes {
            row(&format!("  {shape}"), count.to_string());
        }
        row("cell", format!("{:.3} m", self.cell_m));
        row("dropped crumbs", self.dropped_crumbs.to_string());
        row("dropped misfits", self.dropped_misfits.to_string());
        row("closed passages", self.closed_passages.to_string());
        if self.faces_reversed {
            row(
                "faces",
                "turned away from the rooms; taken as reversed".to_owned(),
            );
        }
        row(
            "area inside blocks",
            format!("{:.1} %", 100.0 * self.area_share.inside),
        );
        row(
            "area in or near",
            format!("{:.1} %", 100.0 * self.area_share.near),
        );
        row("seconds", format!("{:.2}", self.seconds));
    }
}

impl ImportReport {
    /// Prints the report's rows.
    pub fn print(&self) {
        let row = |name: &str, value: String| crate::report_line!("{name:<22} {value}");
        let [x, y, z] = self.size_m;
        row("triangles", self.triangles.to_string());
        row(
            "  left out",
            format!(
                "{} without area, {} not finite; {} unused vertices",
                self.degenerate_triangles, self.not_finite_triangles, self.unused_vertices
            ),
        );
        row(
            "edges",
            format!(
                "{} non-manifold, {} boundary",
                self.non_manifold_edges, self.boundary_edges
            ),
        );
        row(
            "size",
            format!("{x:.3} x {y:.3} x {z:.3} m at {} m a unit", self.scale),
        );
        row(
            "materials",
            format!(
                "{}; {} moved into 0.05..0.9, {} made up from names",
                self.materials, self.clamped_albedos, self.made_up_albedos
            ),
        );
    }
}
