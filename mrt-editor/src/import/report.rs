//! What was read from a scene, left out and made up.

use super::raw_mesh::RawMesh;
use super::surface_colours::{MadeUp, used};
use glam::Vec3;
use mrt_core::geometry::mesh::{MeshReport, TriangleMesh, bounds};
use serde::Serialize;
use std::collections::BTreeMap;

/// Sentences kept, at most.
const MOST_WARNINGS: usize = 100;

/// What was read, left out and made up.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Triangles kept.
    pub triangles: usize,
    /// Triangles without area, left out.
    pub degenerate_triangles: usize,
    /// Triangles with a coordinate that is not finite, left out.
    pub not_finite_triangles: usize,
    /// Triangles left out because of their material, by its name.
    pub left_out_materials: BTreeMap<String, usize>,
    /// Vertices that no triangle uses, left out.
    pub unused_vertices: usize,
    /// Edges of three or more triangles.
    pub non_manifold_edges: usize,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Metres per unit of the file.
    pub scale: f64,
    /// Size along x, y and z, metres.
    pub size_m: [f32; 3],
    /// Point of the mesh, metres, that became the origin because the mesh is too far from its own.
    pub origin_m: [f64; 3],
    /// Materials that triangles use.
    pub materials: usize,
    /// Used materials for which nothing states a colour; they are grey.
    pub made_up_albedos: usize,
    /// Used materials that send out light.
    pub emissive_materials: usize,
    /// Images read.
    pub images: usize,
    /// Lamps read.
    pub lamps: usize,
    /// What the file has and is not used, by kind, and how often.
    pub ignored: BTreeMap<String, usize>,
    /// Sentences about what is missing or faulty and was worked around.
    pub warnings: Vec<String>,
}

impl ImportReport {
    /// Counts what the cleaned mesh holds of the file; lamps, what was left out, scale and origin are not set.
    pub(super) fn new(
        mesh: &TriangleMesh,
        cleaned: &MeshReport,
        raw: &mut RawMesh,
        made_up: MadeUp,
    ) -> Self {
        let [low, high] = bounds(mesh).unwrap_or_default();
        let is_used = used(mesh, raw.paints.len());
        let used_paints = || raw.paints.iter().zip(&is_used).filter(|&(_, &used)| used);
        let emissive = used_paints().filter(|(paint, _)| paint.emission != Vec3::ZERO);
        let mut report = Self {
            triangles: mesh.triangles.len(),
            degenerate_triangles: cleaned.degenerate_triangles,
            not_finite_triangles: cleaned.not_finite_triangles,
            unused_vertices: cleaned.unused_vertices + raw.unused_vertices,
            non_manifold_edges: cleaned.non_manifold_edges,
            boundary_edges: cleaned.boundary_edges,
            size_m: (high - low).to_array(),
            materials: used_paints().count(),
            made_up_albedos: made_up.colours,
            emissive_materials: emissive.count(),
            images: made_up.images,
            ignored: std::mem::take(&mut raw.ignored),
            warnings: std::mem::take(&mut raw.warnings),
            ..Self::default()
        };
        report.warnings.extend(made_up.warnings);
        report.bound_warnings();
        report
    }

    /// Keeps the first warnings and says how many there were.
    fn bound_warnings(&mut self) {
        let more = self.warnings.len().saturating_sub(MOST_WARNINGS);
        if more > 0 {
            self.warnings.truncate(MOST_WARNINGS);
            self.warnings.push(format!("and {more} more warnings"));
        }
    }
}
