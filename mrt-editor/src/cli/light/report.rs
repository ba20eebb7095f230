//! What `mrt light` prints.

use crate::cli::import_args::print_import;
use crate::cli::output::print_row;
use crate::import::report::ImportReport;
use crate::render::lamp::position;
use glam::{DVec3, Vec3};
use mrt_runtime::Light;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) mesh: ImportReport,
    pub(super) blocks: usize,
    pub(super) connections: usize,
    /// Spheres and spots.
    pub(super) lights: Vec<LampRow>,
    /// Directions and irradiances of suns, W/m².
    pub(super) suns: Vec<[f32; 6]>,
    /// Whether the lights are those of the mesh's file.
    pub(super) lights_of_mesh: bool,
    /// Walls of the level that shine by themselves.
    pub(super) emissive_walls: usize,
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

/// Position in the mesh's coordinates, radius, strongest channel and intensity.
pub(super) type LampRow = (f64, f64, f64, f32, f32, f32, f32, f32);

/// The rows of spheres and spots of a level with its origin at `origin` of the mesh.
pub(super) fn lamp_rows(lamps: &[Light], origin: DVec3) -> Vec<LampRow> {
    let row = |lamp: &Light| {
        let (Light::Sphere {
            radius, intensity, ..
        }
        | Light::Spot {
            radius, intensity, ..
        }) = *lamp
        else {
            return None;
        };
        let [x, y, z] = in_mesh(position(lamp)?, origin).to_array();
        let [r, g, b] = intensity.to_array();
        Some((x, y, z, radius, intensity.max_element(), r, g, b))
    };
    lamps.iter().filter_map(row).collect()
}

/// Directions and irradiances of suns.
pub(super) fn sun_rows(lamps: &[Light]) -> Vec<[f32; 6]> {
    let row = |lamp: &Light| match *lamp {
        Light::Directional {
            direction,
            irradiance,
        } => {
            let ([x, y, z], [r, g, b]) = (direction.to_array(), irradiance.to_array());
            Some([x, y, z, r, g, b])
        }
        _ => None,
    };
    lamps.iter().filter_map(row).collect()
}

/// A point of the level in the mesh's coordinates, to the micrometre: the digits beyond come from f32.
pub(super) fn in_mesh(point: Vec3, origin: DVec3) -> DVec3 {
    ((point.as_dvec3() + origin) * 1e6).round() / 1e6
}

impl Report {
    pub(super) fn print(&self) {
        print_import(&self.mesh);
        print_row("blocks", self.blocks);
        print_row("connections", self.connections);
        for (x, y, z, radius, _, r, g, b) in &self.lights {
            print_row(
                "light",
                format!(
                    "({x:.3}, {y:.3}, {z:.3}) m, radius {radius:.3} m, ({r:.3}, {g:.3}, {b:.3}) W/sr"
                ),
            );
        }
        for [x, y, z, r, g, b] in &self.suns {
            print_row(
                "sun",
                format!("towards ({x:.3}, {y:.3}, {z:.3}), ({r:.3}, {g:.3}, {b:.3}) W/m²"),
            );
        }
        if self.lights_of_mesh {
            print_row("  from", "the mesh's file");
        }
        if self.emissive_walls > 0 {
            print_row("walls that shine", self.emissive_walls);
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
