//! How to read a scene.

use super::error::ImportError;
use glam::DVec3;
use mrt_runtime::blocks::UpAxis;

/// How to read a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportConfig {
    /// Metres per unit of the file.
    pub scale: f64,
    /// Which axis of the file points up.
    pub up: UpAxis,
    /// Albedo for everything, instead of the file's colours.
    pub albedo: Option<f32>,
    /// Materials whose triangles are left out, by name; `*` stands for any text.
    pub skip_materials: Vec<String>,
    /// If not empty, only triangles of these materials are read.
    pub only_materials: Vec<String>,
    /// Whether triangles are read whose materials are named like helper faces of level editors.
    pub keeps_tool_materials: bool,
    /// Point of the scaled and turned mesh, metres, that becomes the origin; by default the mesh's own, or whole metres
    /// near its centre if that is so far away that `f32` would round positions visibly.
    pub origin: Option<DVec3>,
}

impl Default for ImportConfig {
    fn default() -> Self {
        Self {
            scale: 1.0,
            up: UpAxis::Y,
            albedo: None,
            skip_materials: Vec::new(),
            only_materials: Vec::new(),
            keeps_tool_materials: false,
            origin: None,
        }
    }
}

impl ImportConfig {
    /// Checks scale and albedo.
    ///
    /// # Errors
    /// [`ImportError::Scale`] and [`ImportError::Albedo`].
    pub(super) fn check(&self) -> Result<(), ImportError> {
        let found = self.scale;
        if !(found.is_finite() && found > 0.0) {
            return Err(ImportError::Scale { found });
        }
        match self.albedo {
            Some(found) if !(0.0..=1.0).contains(&found) => Err(ImportError::Albedo { found }),
            _ => Ok(()),
        }
    }
}
