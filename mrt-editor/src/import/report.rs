//! What was read from a scene, left out and made up.

use super::raw_mesh::{Paint, RawMesh};
use mrt_core::geometry::mesh::{MeshReport, TriangleMesh};
use serde::Serialize;

/// What was read, left out and made up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Triangles kept.
    pub triangles: usize,
    /// Triangles without area, left out.
    pub degenerate_triangles: usize,
    /// Triangles with a coordinate that is not finite, left out.
    pub not_finite_triangles: usize,
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
    /// Materials that triangles use.
    pub materials: usize,
    /// Used materials whose colour in the file was moved into [`ALBEDO_RANGE`](super::limits::ALBEDO_RANGE).
    pub clamped_albedos: usize,
    /// Used materials whose colour was made up from their name.
    pub made_up_albedos: usize,
}

impl ImportReport {
    /// Counts what the cleaned mesh holds of the file; scale and size are left at zero.
    pub(super) fn new(mesh: &TriangleMesh, cleaned: &MeshReport, raw: &RawMesh) -> Self {
        let mut is_used = vec![false; raw.paints.len()];
        for &material in &mesh.triangle_materials {
            is_used[material as usize] = true;
        }
        let used = |test: fn(&Paint) -> bool| {
            let paints = raw.paints.iter().zip(&is_used);
            paints.filter(|&(paint, &used)| used && test(paint)).count()
        };
        Self {
            triangles: mesh.triangles.len(),
            degenerate_triangles: cleaned.degenerate_triangles,
            not_finite_triangles: cleaned.not_finite_triangles,
            unused_vertices: cleaned.unused_vertices + raw.unused_vertices,
            non_manifold_edges: cleaned.non_manifold_edges,
            boundary_edges: cleaned.boundary_edges,
            materials: used(|_| true),
            clamped_albedos: used(Paint::is_clamped),
            made_up_albedos: used(|paint| paint.colour.is_none()),
            ..Self::default()
        }
    }
}
