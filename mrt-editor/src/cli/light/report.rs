//! What `mrt light` prints.

use super::View;
use crate::import::report::ImportReport;
use crate::render::Picture;
use crate::render::lit::SphereLight;
use crate::render::tone::luminance;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) mesh: ImportReport,
    pub(super) blocks: usize,
    pub(super) connections: usize,
    pub(super) lights: Vec<[f32; 8]>,
    pub(super) passes: u32,
    pub(super) dictionary_seconds: f64,
    pub(super) assemble_seconds: f64,
    pub(super) frame_milliseconds: f64,
    pub(super) lightmap: [usize; 2],
    pub(super) lightmap_triangles: usize,
    pub(super) views: Vec<ViewReport>,
    pub(super) seconds: f64,
}

#[derive(Serialize)]
pub(super) struct ViewReport {
    pub(super) name: String,
    pub(super) exposure_ev: f32,
    /// Means over the picture of relative luminance.
    pub(super) direct: f32,
    pub(super) indirect: f32,
}

/// Position, radius, strongest channel and intensity.
pub(super) fn light_row(light: &SphereLight) -> [f32; 8] {
    let [x, y, z] = light.position.to_array();
    let [r, g, b] = light.intensity.to_array();
    let strongest = light.intensity.max_element();
    [x, y, z, light.radius, strongest, r, g, b]
}

impl View {
    pub(super) fn report(&self) -> ViewReport {
        let mean = |picture: &Picture| {
            let sum: f32 = picture.pixels.iter().map(|&colour| luminance(colour)).sum();
            sum / picture.pixels.len() as f32
        };
        ViewReport {
            name: self.name.clone(),
            exposure_ev: self.exposure.log2(),
            direct: mean(&self.pictures[0]),
            indirect: mean(&self.pictures[1]),
        }
    }
}

impl Report {
    pub(super) fn print(&self) {
        self.mesh.print();
        let row = |name: &str, value: String| crate::report_line!("{name:<22} {value}");
        row("blocks", self.blocks.to_string());
        row("connections", self.connections.to_string());
        for [x, y, z, radius, _, r, g, b] in &self.lights {
            row(
                "light",
                format!(
                    "({x:.3}, {y:.3}, {z:.3}) m, radius {radius:.3} m, ({r:.3}, {g:.3}, {b:.3}) W/sr"
                ),
            );
        }
        row("dictionary", format!("{:.2} s", self.dictionary_seconds));
        row("assembly", format!("{:.2} s", self.assemble_seconds));
        row(
            "frame",
            format!(
                "{:.2} ms with direct light, {} passes",
                self.frame_milliseconds, self.passes
            ),
        );
        let [width, height] = self.lightmap;
        row(
            "lightmap",
            format!("{width} x {height}, {} triangles", self.lightmap_triangles),
        );
        for view in &self.views {
            row(
                &view.name,
                format!(
                    "exposure {:+.1} EV, mean direct {:.4}, indirect {:.4}",
                    view.exposure_ev, view.direct, view.indirect
                ),
            );
        }
        row("seconds", format!("{:.2}", self.seconds));
    }
}
