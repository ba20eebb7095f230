//! Flags of commands that read a mesh, and what they say about it.

use crate::cli::output::print_row;
use crate::import::error::ImportError;
use crate::import::report::ImportReport;
use crate::import::{ImportConfig, UpAxis};

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

/// The flag that may help, as the end of an error's line.
pub fn import_hint(error: &ImportError) -> &'static str {
    match error {
        ImportError::OutOfRange { .. } => " (see --scale)",
        _ => "",
    }
}

/// Prints what was read.
pub fn print_import(report: &ImportReport) {
    let [x, y, z] = report.size_m;
    print_row("triangles", report.triangles);
    print_row(
        "  left out",
        format!(
            "{} without area, {} not finite; {} unused vertices",
            report.degenerate_triangles, report.not_finite_triangles, report.unused_vertices
        ),
    );
    print_row(
        "edges",
        format!(
            "{} non-manifold, {} boundary",
            report.non_manifold_edges, report.boundary_edges
        ),
    );
    print_row(
        "size",
        format!("{x:.3} x {y:.3} x {z:.3} m at {} m a unit", report.scale),
    );
    print_row(
        "materials",
        format!(
            "{}; {} moved into 0.05..0.9, {} made up from names",
            report.materials, report.clamped_albedos, report.made_up_albedos
        ),
    );
}
