//! glTF 2.0, text or binary: the triangles of the default scene where its nodes put them, base colours with their images,
//! vertex colours, emission and lamps. What else a file has is counted.
//!
//! The document is read into structs of our own, of the few parts that are needed. The crate `gltf` checks whole documents,
//! and refuses files that the specification or an extension allows: a scene without nodes, a texture whose image is in an
//! extension, extensions that it does not know. It indexes what it has not checked, and leaves out buffers of several
//! files, sparse and quantised numbers and skins, so that little of it would be used. Every index, offset and size
//! is checked here before it is used, and everything that takes memory is counted before it is made.
//!
//! Compressed meshes are refused. The only reader of Draco in Rust is of one author and larger than this workspace; the one
//! of meshoptimizer is no longer kept, or needs a C++ compiler.

mod fault;
mod document;
mod extensions;
mod container;
mod buffers;
mod accessors;
mod nodes;
mod budget;
mod skins;
mod images;
mod materials;
mod primitives;
mod lamps;
#[cfg(test)]
mod tests;

use super::error::ImportError;
use super::raw_mesh::RawMesh;
use buffers::Buffers;
use container::Content;
use document::Document;
use fault::Fault;
use glam::{DAffine3, Vec2, Vec3};
use materials::ImageCoordinates;
use nodes::{PlacedNode, Placement};
use primitives::{Geometry, PrimitiveAt};
use skins::Pose;
use std::path::Path;

/// Reads a scene; its buffers and images are looked for in its folder.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<RawMesh, ImportError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    read_mesh(folder, bytes).map_err(|fault| fault.into_error(path))
}

fn read_mesh(folder: &Path, bytes: &[u8]) -> Result<RawMesh, Fault> {
    let content: Content<'_> = container::read(bytes)?;
    let document = &content.document;
    budget::check_indices(document)?;
    let placement = nodes::place(document)?;
    let is_used = budget::check_sizes(document, &placement)?;
    let mut mesh = RawMesh::default();
    let mut buffers = Buffers::new(&content, folder);
    let images = materials::read(&mut buffers, &is_used, &mut mesh);
    count_unused(document, &placement, &mut mesh);
    let pose = Pose::new(document, &placement.nodes);
    let mut builder = Builder {
        buffers,
        images,
        pose,
        mesh,
        without_coordinates: 0,
    };
    for placed in &placement.nodes {
        builder.add_node(placed)?;
        lamps::add(document, placed, &mut builder.mesh)?;
    }
    if builder.without_coordinates > 0 {
        builder.mesh.warnings.push(format!(
            "{} primitives have an image but no coordinates in it: the image's upper left corner colours them",
            builder.without_coordinates
        ));
    }
    Ok(builder.mesh)
}

/// Counts what the file has and is not used, but for what belongs to meshes and materials.
fn count_unused(document: &Document, placement: &Placement, mesh: &mut RawMesh) {
    for (kind, count) in [
        ("animations", document.animations.len()),
        ("cameras", document.cameras.len()),
        ("other scenes", document.scenes.len().saturating_sub(1)),
        ("hidden nodes", placement.hidden),
    ] {
        if count > 0 {
            mesh.ignored.insert(kind.to_owned(), count);
        }
    }
    extensions::count_unused(document, &mut mesh.ignored);
}

/// Collects the triangles of nodes.
struct Builder<'a> {
    buffers: Buffers<'a>,
    /// Where the image lies, for each paint; the last is the one of triangles without material.
    images: Vec<Option<ImageCoordinates>>,
    pose: Pose,
    mesh: RawMesh,
    /// Primitives of materials with an image that have no coordinates in it.
    without_coordinates: usize,
}

impl Builder<'_> {
    fn add_node(&mut self, placed: &PlacedNode) -> Result<(), Fault> {
        let document = self.buffers.document;
        let node = &document.nodes[placed.node];
        let Some(mesh_index) = node.mesh else {
            return Ok(());
        };
        let mesh = &document.meshes[mesh_index];
        let joints = match node.skin {
            Some(skin) => Some(self.pose.joints(&mut self.buffers, skin)?),
            None => None,
        };
        let instances = match joints {
            Some(_) => vec![DAffine3::IDENTITY],
            None => nodes::instances(&mut self.buffers, placed)?,
        };
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(kind) = kind_without_surface(primitive.mode()) {
                *self.mesh.ignored.entry(kind.to_owned()).or_default() += 1;
                continue;
            }
            let place = budget::primitive_place(mesh_index, index);
            let paint = primitive.material.unwrap_or(self.images.len() - 1);
            let at = PrimitiveAt {
                primitive,
                place: &place,
                weights: primitives::weights(&node.weights, mesh),
                image: self.images[paint],
            };
            let Some(mut geometry) = primitives::read(&mut self.buffers, at)? else {
                continue;
            };
            if at.image.is_some() && geometry.image_points.is_none() {
                self.without_coordinates += 1;
            }
            if let Some(joints) = &joints {
                let attributes = (&primitive.attributes, place.as_str());
                let positions = &mut geometry.positions;
                if skins::apply(&mut self.buffers, attributes, joints, positions)? {
                    flip(&mut geometry.triangles);
                }
            }
            for world_from_mesh in &instances {
                self.add_instance(&geometry, paint, world_from_mesh);
            }
        }
        Ok(())
    }

    fn add_instance(&mut self, geometry: &Geometry, paint: usize, world_from_mesh: &DAffine3) {
        let mesh = &mut self.mesh;
        let first = mesh.positions.len();
        let positions = geometry.positions.iter();
        mesh.positions
            .extend(positions.map(|&p| world_from_mesh.transform_point3(p)));
        if let Some(colours) = &geometry.colours {
            mesh.colours.resize(first, Vec3::ONE);
            mesh.colours.extend(colours);
        } else if !mesh.colours.is_empty() {
            mesh.colours.resize(mesh.positions.len(), Vec3::ONE);
        }
        let mut triangles = geometry.triangles.clone();
        if world_from_mesh.matrix3.determinant() < 0.0 {
            flip(&mut triangles);
        }
        if !mesh.images.is_empty() {
            let point = |corner: u32| {
                let points = geometry.image_points.as_ref();
                points.map_or(Vec2::ZERO, |points| points[corner as usize])
            };
            mesh.corner_uvs
                .extend(triangles.iter().map(|t| t.map(point)));
        }
        mesh.triangle_materials
            .extend(std::iter::repeat_n(paint as u32, triangles.len()));
        let corners = triangles
            .iter()
            .map(|t| t.map(|corner| first as u32 + corner));
        mesh.triangles.extend(corners);
    }
}

/// What primitives that are no surfaces are.
fn kind_without_surface(mode: u32) -> Option<&'static str> {
    match mode {
        0 => Some("primitives of points"),
        1..=3 => Some("primitives of lines"),
        _ => None,
    }
}

/// Turns triangles over, as a mirror does.
fn flip(triangles: &mut [[u32; 3]]) {
    triangles
        .iter_mut()
        .for_each(|triangle| triangle.swap(1, 2));
}
