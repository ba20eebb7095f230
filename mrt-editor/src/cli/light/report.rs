//! What `mrt light` prints.

use crate::cli::import_args::print_import;
use crate::cli::output::print_row;
use crate::import::report::ImportReport;
use crate::render::lit::Lamp;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) mesh: ImportReport,
    pub(super) blocks: usize,
    pub(super) connections: usize,
    /// Rows of [`lamp_row`].
    pub(super) lights: Vec<[f32; 8]>,
    pub(super) passes: u32,
    pub(super) dictionary_seconds: f64,
    pub(super) assemble_seconds: f64,
    pub(super) frame_milliseconds: f64,
    /// Pixels across and down.
    pub(super) lightmap: [usize; 2],
    pub(super) lightmap_triangles: usize,
    pub(super) views: Vec<ViewReport>,
    pub(super) seconds: f64,
}

#[derive(Serialize)]
pub(super) struct ViewReport {
    pub(super) name: String,
    pub(super) exposure_ev: f32,
    /// Mean over the picture of the relative luminance by direct light.
    pub(super) direct: f32,
    /// The same by indirect light.
    pub(super) indirect: f32,
}

/// Position, radius, strongest channel and intensity.
pub(super) fn lamp_row(lamp: &Lamp) -> [f32; 8] {
    let [x, y, z] = lamp.position.to_array();
    let [r, g, b] = lamp.intensity.to_array();
    let strongest = lamp.intensity.max_element();
    [x, y, z, lamp.radius, strongest, r, g, b]
}

impl Report {
    pub(super) fn print(&self) {
        print_import(&self.mesh);
        print_row("blocks", self.blocks);
        print_row("connections", self.connections);
        for [x, y, z, radius, _, r, g, b] in &self.lights {
            print_row(
                "light",
                format!(
                    "({x:.3}, {y:.3}, {z:.3}) m, radius {radius:.3} m, ({r:.3}, {g:.3}, {b:.3}) W/sr"
                ),
            );
        }
        print_row("dictionary", format!("{:.2} s", self.dictionary_seconds));
        print_row("assembly", format!("{:.2} s", self.assemble_seconds));
        print_row(
            "frame",
            format!(
                "{:.2} ms with direct light, {} passes",
                self.frame_milliseconds, self.passes
            ),
        );
        let [width, height] = self.lightmap;
        print_row(
            "lightmap",
            format!("{width} x {height}, {} triangles", self.lightmap_triangles),
        );
        for view in &self.views {
            print_row(
                &view.name,
                format!(
                    "exposure {:+.1} EV, mean direct {:.4}, indirect {:.4}",
                    view.exposure_ev, view.direct, view.indirect
                ),
            );
        }
        print_row("seconds", format!("{:.2}", self.seconds));
    }
}
