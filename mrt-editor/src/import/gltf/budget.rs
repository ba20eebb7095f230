//! What a scene will take, counted before any of it is made, and the checks of every index of its meshes.

use super::accessors;
use super::document::{Accessor, Document, Mesh, Primitive};
use super::extensions::{self, DRACO};
use super::fault::Fault;
use super::nodes::{self, Placement};
use crate::import::limits::{MAX_POSITIONS, MAX_TRIANGLES};

/// Checks that all meshes name accessors and materials that are there.
pub(super) fn check_indices(document: &Document) -> Result<(), Fault> {
    for (mesh_index, mesh) in document.meshes.iter().enumerate() {
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            let place = primitive_place(mesh_index, index);
            let named = primitive.attributes.values().chain(&primitive.indices);
            for &accessor in named {
                accessors::get(&document.accessors, accessor, &place)?;
            }
            let count = document.materials.len();
            if let Some(material) = primitive.material.filter(|&material| material >= count) {
                return Err(Fault::index(&place, "material", material, count));
            }
            if primitive.mode() > 6 {
                let place = format!("{place}: mode {}", primitive.mode());
                return Err(Fault::at(place, "0 to 6"));
            }
        }
    }
    Ok(())
}

/// Refuses scenes that take too much; returns which materials the rest uses.
pub(super) fn check_sizes(document: &Document, placement: &Placement) -> Result<Vec<bool>, Fault> {
    let mut is_used = vec![false; document.materials.len()];
    let mut total = Size::default();
    for placed in &placement.nodes {
        let node = &document.nodes[placed.node];
        let Some(mesh) = node.mesh else { continue };
        let place = format!("nodes[{}]", placed.node);
        let fault = || Fault::index(&place, "mesh", mesh, document.meshes.len());
        let (mesh, index) = (document.meshes.get(mesh).ok_or_else(fault)?, mesh);
        let joint_count = node.skin.and_then(|skin| document.skins.get(skin));
        let joint_count = joint_count.map_or(0, |skin| skin.joints.len());
        let instance_count = nodes::instance_count(document, placed.node)?;
        let size = mesh_size(document, (mesh, index))?;
        total.positions = total
            .positions
            .saturating_add(size.positions.saturating_mul(instance_count.max(1)))
            .saturating_add(instance_count)
            .saturating_add(joint_count);
        total.triangles = total
            .triangles
            .saturating_add(size.triangles.saturating_mul(instance_count.max(1)));
        if total.positions > MAX_POSITIONS {
            return Err(Fault::at(
                place,
                "at most 50,000,000 positions, counted with instances",
            ));
        }
        if total.triangles > MAX_TRIANGLES {
            return Err(Fault::at(
                place,
                "at most 50,000,000 triangles, counted with instances",
            ));
        }
        for material in mesh.primitives.iter().filter_map(|p| p.material) {
            is_used[material] = true;
        }
    }
    Ok(is_used)
}

/// What a mesh takes: positions, and at least one for each primitive, so that empty ones count as work.
#[derive(Default)]
struct Size {
    positions: usize,
    triangles: usize,
}

fn mesh_size(document: &Document, (mesh, mesh_index): (&Mesh, usize)) -> Result<Size, Fault> {
    let mut size = Size {
        positions: 1,
        triangles: 0,
    };
    for (index, primitive) in mesh.primitives.iter().enumerate() {
        size.positions = size.positions.saturating_add(1);
        let Some(&positions) = primitive.attributes.get("POSITION") else {
            continue;
        };
        let place = primitive_place(mesh_index, index);
        let positions = accessors::get(&document.accessors, positions, &place)?;
        refuse_compressed(document, primitive, positions)?;
        let Some(triangle_count) = triangle_count(document, primitive, positions.count) else {
            continue;
        };
        let copies = 1 + primitive.targets.len();
        size.positions = size
            .positions
            .saturating_add(positions.count.saturating_mul(copies));
        size.triangles = size.triangles.saturating_add(triangle_count);
    }
    Ok(size)
}

/// `None` for points and lines.
fn triangle_count(document: &Document, primitive: &Primitive, vertices: usize) -> Option<usize> {
    let accessor = primitive.indices.and_then(|i| document.accessors.get(i));
    let corners = accessor.map_or(vertices, |accessor| accessor.count);
    match primitive.mode() {
        4 => Some(corners / 3),
        5 | 6 => Some(corners.saturating_sub(2)),
        _ => None,
    }
}

/// Beside compressed data there may be plain ones, unless the extension is required.
fn refuse_compressed(
    document: &Document,
    primitive: &Primitive,
    positions: &Accessor,
) -> Result<(), Fault> {
    let is_required = document.extensions_required.iter().any(|r| r == DRACO);
    let is_plain = positions.buffer_view.is_some() && !is_required;
    if primitive.extensions.draco.is_some() && !is_plain {
        return Err(extensions::compressed(DRACO));
    }
    Ok(())
}

/// Names a primitive in messages.
pub(super) fn primitive_place(mesh: usize, primitive: usize) -> String {
    format!("meshes[{mesh}].primitives[{primitive}]")
}
