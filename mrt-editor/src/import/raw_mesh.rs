//! A mesh as a file has it, before faulty triangles are taken out.

use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;

/// A mesh as the file has it; all indices are in range.
#[derive(Clone, Debug, Default)]
pub(super) struct RawMesh {
    /// In units of the file.
    pub(super) positions: Vec<DVec3>,
    /// Linear RGB of each position, a factor of the paint's colour; empty if the file has none.
    pub(super) colours: Vec<Vec3>,
    /// Indices into the positions.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Index into the paints of each triangle.
    pub(super) triangle_materials: Vec<u32>,
    /// Where each triangle's corners lie in the image of its paint: (0, 0) is the image's upper left corner and (1, 1) its
    /// lower right one, before wrapping; empty if no triangle has an image.
    pub(super) corner_uvs: Vec<[Vec2; 3]>,
    /// The file's materials.
    pub(super) paints: Vec<Paint>,
    /// Images that paints use.
    pub(super) images: Vec<RawImage>,
    /// Lamps of the file.
    pub(super) lamps: Vec<RawLamp>,
    /// What the file has and is not used, by kind, and how often.
    pub(super) ignored: BTreeMap<String, usize>,
    /// Sentences about what is missing or faulty and was worked around, such as a library that is not there.
    pub(super) warnings: Vec<String>,
    /// Vertices of the file that no face uses and that are not among the positions.
    pub(super) unused_vertices: usize,
}

/// A material of the file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Paint {
    pub(super) name: String,
    /// Linear RGB, finite; `None` where the file states no colour.
    pub(super) colour: Option<Vec3>,
    /// Image whose texels multiply the colour.
    pub(super) image: Option<PaintImage>,
    /// Radiance that it sends out, linear RGB, W/(m² sr); zero for most.
    pub(super) emission: Vec3,
}

/// How a paint uses an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PaintImage {
    /// Index into [`RawMesh::images`].
    pub(super) image: usize,
    /// Beyond the image, across and down.
    pub(super) wrap: [Wrap; 2],
}

/// What stands beyond an image's edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Wrap {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// An image as its file has it: PNG, JPEG or WebP.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RawImage {
    /// Its file's name, or its place in the scene's file; for messages.
    pub(super) name: String,
    /// Empty if they cannot be had, about which the reader has a warning; the image then counts as grey.
    pub(super) bytes: Vec<u8>,
}

/// A lamp in units and axes of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RawLamp {
    pub(super) kind: LampKind,
    pub(super) position: DVec3,
    /// Unit vector along which a spot or the sun shines.
    pub(super) direction: DVec3,
    /// Linear RGB: W/sr, or W/m² for the sun. Photometric values of the file are taken as radiometric ones.
    pub(super) intensity: Vec3,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LampKind {
    Point,
    /// Angles from the axis to where the light begins to fall off and to where it ends, radians.
    Spot {
        inner_angle: f32,
        outer_angle: f32,
    },
    Sun,
}

impl Paint {
    pub(super) fn new(name: &str, colour: Option<Vec3>) -> Self {
        Self {
            name: name.to_owned(),
            colour: colour.filter(|colour| colour.is_finite()),
            image: None,
            emission: Vec3::ZERO,
        }
    }

    /// For triangles that name no material.
    pub(super) fn unnamed() -> Self {
        Self::new(UNNAMED, None)
    }
}

/// Name of the material of triangles that name none.
const UNNAMED: &str = "unnamed";
