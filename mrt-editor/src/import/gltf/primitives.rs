//! Triangles of meshes, with what hangs on their vertices.

use super::accessors::{self, component_count};
use super::buffers::Buffers;
use super::document::{Attributes, Mesh, Primitive};
use super::fault::Fault;
use super::materials::ImageCoordinates;
use glam::{DVec3, Vec2, Vec3};

/// A primitive as the file has it, before a node places it.
pub(super) struct Geometry {
    pub(super) positions: Vec<DVec3>,
    /// Counter-clockwise as seen from in front.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Linear RGB of each position.
    pub(super) colours: Option<Vec<Vec3>>,
    /// Place of each position in the material's image.
    pub(super) image_points: Option<Vec<Vec2>>,
}

/// A primitive, and where the file has it.
#[derive(Clone, Copy)]
pub(super) struct PrimitiveAt<'a> {
    pub(super) primitive: &'a Primitive,
    pub(super) place: &'a str,
    /// Of the morph targets.
    pub(super) weights: &'a [f64],
    pub(super) image: Option<ImageCoordinates>,
}

/// The weights of morph targets at a node.
pub(super) fn weights<'a>(node: &'a [f64], mesh: &'a Mesh) -> &'a [f64] {
    if node.is_empty() { &mesh.weights } else { node }
}

/// Reads the triangles of a primitive of triangles, strips or fans; `None` if it has no positions.
pub(super) fn read(
    buffers: &mut Buffers<'_>,
    at: PrimitiveAt<'_>,
) -> Result<Option<Geometry>, Fault> {
    let PrimitiveAt {
        primitive, place, ..
    } = at;
    let attributes = &primitive.attributes;
    let Some(&accessor) = attributes.get("POSITION") else {
        return Ok(None);
    };
    let count = accessors::get(&buffers.document.accessors, accessor, place)?.count;
    let corners = match primitive.indices {
        None => (0..count as u32).collect(),
        Some(accessor) => accessors::read_indices(buffers, accessor, place)?,
    };
    if let Some(bad) = corners.iter().find(|&&corner| corner as usize >= count) {
        return Err(Fault::index(place, "vertex", *bad as usize, count));
    }
    let image_set = at
        .image
        .map(|image| (image, format!("TEXCOORD_{}", image.set)));
    let image_points = match image_set {
        Some((image, set)) => read_image_points(buffers, at, (count, &set))?
            .map(|points| points.into_iter().map(|p| point(&image, p)).collect()),
        None => None,
    };
    Ok(Some(Geometry {
        positions: read_positions(buffers, at, (accessor, count))?,
        triangles: triangles(primitive.mode(), &corners),
        colours: read_colours(buffers, attributes, (count, place))?,
        image_points,
    }))
}

/// Three corners a triangle, by the order that the specification gives each mode.
fn triangles(mode: u32, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        5 => corners
            .windows(3)
            .enumerate()
            .map(|(k, c)| {
                if k % 2 == 0 {
                    [c[0], c[1], c[2]]
                } else {
                    [c[0], c[2], c[1]]
                }
            })
            .collect(),
        6 => match corners.split_first() {
            Some((&hub, rim)) => rim.windows(2).map(|c| [hub, c[0], c[1]]).collect(),
            None => Vec::new(),
        },
        _ => corners.as_chunks::<3>().0.to_vec(),
    }
}

/// Positions with the morph targets that have a weight.
fn read_positions(
    buffers: &mut Buffers<'_>,
    at: PrimitiveAt<'_>,
    (accessor, count): (usize, usize),
) -> Result<Vec<DVec3>, Fault> {
    let positions = accessors::read::<3>(buffers, accessor, count, at.place)?;
    let mut positions: Vec<DVec3> = positions.into_iter().map(DVec3::from_array).collect();
    for (target, &weight) in at.primitive.targets.iter().zip(at.weights) {
        let Some(&accessor) = target.get("POSITION").filter(|_| weight != 0.0) else {
            continue;
        };
        let offsets = accessors::read::<3>(buffers, accessor, count, at.place)?;
        for (position, offset) in positions.iter_mut().zip(offsets) {
            *position += weight * DVec3::from_array(offset);
        }
    }
    Ok(positions)
}

fn read_image_points(
    buffers: &mut Buffers<'_>,
    at: PrimitiveAt<'_>,
    (count, set): (usize, &str),
) -> Result<Option<Vec<[f64; 2]>>, Fault> {
    let accessor = at.primitive.attributes.get(set);
    accessor
        .map(|&accessor| accessors::read::<2>(buffers, accessor, count, at.place))
        .transpose()
}

fn point(image: &ImageCoordinates, [u, v]: [f64; 2]) -> Vec2 {
    let point = Vec2::new(u as f32, v as f32);
    let point = image.image_from_set.transform_point2(point);
    if point.is_finite() { point } else { Vec2::ZERO }
}

/// Opacity, the fourth number, is not used.
fn read_colours(
    buffers: &mut Buffers<'_>,
    attributes: &Attributes,
    (count, place): (usize, &str),
) -> Result<Option<Vec<Vec3>>, Fault> {
    let Some(&accessor) = attributes.get("COLOR_0") else {
        return Ok(None);
    };
    let shape = &accessors::get(&buffers.document.accessors, accessor, place)?.shape;
    let colour = |[r, g, b]: [f64; 3]| {
        let colour = Vec3::new(r as f32, g as f32, b as f32);
        if colour.is_finite() {
            colour.max(Vec3::ZERO)
        } else {
            Vec3::ONE
        }
    };
    Ok(Some(if component_count(shape) == 3 {
        let colours = accessors::read::<3>(buffers, accessor, count, place)?;
        colours.into_iter().map(colour).collect()
    } else {
        let colours = accessors::read::<4>(buffers, accessor, count, place)?;
        colours
            .into_iter()
            .map(|[r, g, b, _]| colour([r, g, b]))
            .collect()
    }))
}
