//! How the mesh around which a level was made is read from its file.

use crate::level::error::LevelError;
use glam::DVec3;

/// How the mesh around which a level was made is read from its file, so that whoever lights it reads it alike.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReading {
    /// Metres per unit of the file; finite and positive.
    pub scale: f64,
    /// The file's vertical axis.
    pub up: UpAxis,
    /// The point of the scaled and turned mesh at which the level has its origin, metres: a point of the mesh is the
    /// level's point plus this. Zero unless the mesh lies so far from its own origin that `f32` would round it visibly.
    pub origin: DVec3,
    /// Patterns of names of materials whose triangles are left out; `*` stands for any text.
    pub skip_materials: Vec<String>,
    /// If not empty, patterns of names of the only materials whose triangles are read.
    pub only_materials: Vec<String>,
    /// True if triangles with the names that level editors give to helper faces are read too.
    pub keeps_tool_materials: bool,
}

/// The vertical axis of a mesh's file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// As in the level.
    #[default]
    Y,
    /// As in many modellers; the mesh is turned about x so that this axis becomes +Y.
    Z,
}

impl Default for MeshReading {
    fn default() -> Self {
        Self {
            scale: 1.0,
            up: UpAxis::Y,
            origin: DVec3::ZERO,
            skip_materials: Vec::new(),
            only_materials: Vec::new(),
            keeps_tool_materials: false,
        }
    }
}

impl UpAxis {
    /// Both axes.
    pub const ALL: [Self; 2] = [Self::Y, Self::Z];

    /// `y` or `z`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// The axis with a name of [`UpAxis::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|axis| axis.name() == name)
    }
}

impl MeshReading {
    pub(super) fn check(&self) -> Result<(), LevelError> {
        if !(self.scale.is_finite() && self.scale > 0.0) {
            return Err(LevelError::MeshScale { found: self.scale });
        }
        if !self.origin.is_finite() {
            return Err(LevelError::MeshOrigin { found: self.origin });
        }
        Ok(())
    }
}
