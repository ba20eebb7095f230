//! Brings each block of a level to its canonical frame, and finds its neighbours beyond its openings.

use crate::level::block::{Level, Opening, corner_index};
use crate::level::block_grid::BlockGrid;
use crate::level::block_index::BlockIndex;
use crate::level::placed::{BLOCK_TOLERANCE, Beyond, PlacedBlock, PlacedLevel, Portal};
use crate::level::unit_from_world::UnitFromWorld;
use crate::level::warp_transport::WarpTransport;
use crate::modular::assemble::error::AssembleError;
use crate::modular::dictionary::{Dictionary, OperatorMatrix, ShapeOperators};
use crate::modular::path::hole_of;
use crate::modular::scene::SceneBlock;
use glam::{DMat3, DVec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::geometry::polar_decomposition::rotation_part;

/// The blocks of a checked level in their canonical frames, with `dictionary.resolution`² texels a wall.
///
/// # Errors
/// [`AssembleError::RolledInterface`], if the dictionary does not support how two blocks are turned against each other.
pub(crate) fn place_level<M>(
    level: &Level,
    dictionary: &Dictionary<M>,
) -> Result<PlacedLevel, AssembleError> {
    let neighbours = level.neighbours();
    let doors = level.door_of_openings();
    let mut blocks = Vec::with_capacity(level.blocks.len());
    let mut texel = 0;
    for (index, block) in level.blocks.iter().enumerate() {
        let texels = block.shape.texel_count(dictionary.resolution);
        let mut beyond = [Beyond::Wall; 6];
        for opening in block.shape.openings {
            let face = opening.face;
            let turned = block.orientation.face(face);
            beyond[face.index()] = match neighbours[index][turned.index()] {
                None => Beyond::Outside,
                Some(there) => {
                    let here = Opening {
                        block: index,
                        face: turned,
                    };
                    crossing(level, dictionary, here, there)?
                }
            };
        }
        let turned = |face: usize| block.orientation.face(Face::ALL[face]).index();
        let warp = block.canonical_warp();
        let portals = block.shape.openings.iter();
        blocks.push(PlacedBlock {
            shape: block.shape,
            orientation: block.orientation,
            portals: portals.map(|opening| Portal::new(&warp, opening)).collect(),
            bounds: warp.bounds(),
            unit_from_world: UnitFromWorld::new(&warp),
            warp,
            beyond,
            texels: texel..texel + texels,
            doors: std::array::from_fn(|face| doors[index][turned(face)]),
            albedo: std::array::from_fn(|face| block.albedo[turned(face)]),
            emission: std::array::from_fn(|face| block.emission[turned(face)]),
        });
        texel += texels;
    }
    let bounds: Vec<_> = blocks.iter().map(|block| block.bounds).collect();
    Ok(PlacedLevel {
        resolution: dictionary.resolution,
        blocks,
        doors: level.doors.iter().map(|door| door.value).collect(),
        grid: BlockGrid::new(&bounds, BLOCK_TOLERANCE),
    })
}

/// Data of modular transport for each block: its operators, and its ranges of coefficients.
pub(super) fn scene_blocks(
    level: &Level,
    used: &[&ShapeOperators<impl OperatorMatrix>],
    operators_of_block: &[usize],
) -> Vec<SceneBlock> {
    let (mut coefficient, mut joint) = (0, 0);
    let blocks = level.blocks.iter().zip(operators_of_block);
    let place = blocks.map(|(block, &shape_index)| {
        let (modes, joint_modes) = (used[shape_index].modes(), used[shape_index].joint_modes());
        coefficient += modes;
        joint += joint_modes;
        SceneBlock {
            shape_index,
            coefficients: coefficient - modes..coefficient,
            joint: joint - joint_modes..joint,
            world_from_probe: match block.transport {
                WarpTransport::Canonical => rotation_of(&block.canonical_warp()),
                // Probes of a variant have the axes of the level, turned back by the orientation.
                _ => rotation_matrix(block.orientation),
            },
        }
    });
    place.collect()
}

/// What lies beyond a connected opening.
fn crossing(
    level: &Level,
    dictionary: &Dictionary<impl Sized>,
    here: Opening,
    there: Opening,
) -> Result<Beyond, AssembleError> {
    let canonical_face =
        |end: Opening| level.blocks[end.block].orientation.inverse().face(end.face);
    let (face_here, face_there) = (canonical_face(here), canonical_face(there));
    let images = images_of_axes(
        (&level.blocks[here.block].canonical_warp(), face_here),
        (&level.blocks[there.block].canonical_warp(), face_there),
    );
    let rotation = match images {
        [Some(x), Some(y), _] => CubeRotation::from_images(x, y),
        _ => None,
    };
    let up = images[1];
    // +y must stay up for holes, and for dictionaries whose shapes open sideways only.
    let outline = level.blocks[here.block].shape.opening(face_here);
    let has_hole = outline.is_some_and(|opening| hole_of(opening.outline).is_some());
    let keeps_up = match up {
        Some(Face::PosY) => true,
        // Half a turn is a product of two mirrors; dictionaries of version 1 do not have the parities of modes under
        // both.
        Some(Face::NegY) => !has_hole && dictionary.knows_parities(),
        _ => dictionary.has_exchanges() && !has_hole,
    };
    let proper = rotation.filter(|r| keeps_up && Some(r.face(Face::PosZ)) == images[2]);
    match proper {
        Some(here_from_there) => Ok(Beyond::Block {
            block: BlockIndex::new(there.block),
            face: face_there,
            here_from_there,
        }),
        None => Err(AssembleError::RolledInterface {
            block: here.block,
            face: here.face,
            other: there.block,
            other_face: there.face,
            found: up.map_or("no single direction".to_owned(), |face| face.to_string()),
        }),
    }
}

/// Where +x, +y and +z of the canonical cube there point in the canonical cube here, read off the corners that meet in
/// the joined faces. `None` for an axis that has no single direction.
fn images_of_axes(
    (warp_here, face_here): (&Hexahedron, Face),
    (warp_there, face_there): (&Hexahedron, Face),
) -> [Option<Face>; 3] {
    // The corner of the face here that is nearest to a corner of the face there.
    let matching = |unit_there: DVec3| {
        let world = warp_there.corners[corner_index(unit_there)];
        let distance = |unit: &DVec3| warp_here.corners[corner_index(*unit)].distance(world);
        face_here
            .rectangle([0.0, 1.0], [0.0, 1.0])
            .into_iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(unit_there)
    };
    let face_along = |direction: DVec3| {
        let mut faces = Face::ALL.into_iter();
        faces.find(|face| face.outward() == direction)
    };
    let origin = matching(face_there.point(0.0, 0.0));
    let axis = face_there.axis();
    let mut images = [None; 3];
    images[face_there.u_axis()] = face_along(matching(face_there.point(1.0, 0.0)) - origin);
    images[face_there.v_axis()] = face_along(matching(face_there.point(0.0, 1.0)) - origin);
    images[axis] = face_along(-face_here.outward() * face_there.outward()[axis]);
    images
}

/// The rotation from canonical axes to world axes: the orthogonal matrix nearest to the derivative of the warp at its
/// middle, by Newton's iteration for the polar decomposition (Higham 1986).
fn rotation_of(warp: &Hexahedron) -> DMat3 {
    rotation_part(&warp.jacobian(DVec3::splat(0.5)), POLAR_STEPS)
}

/// Steps of the polar decomposition: enough for warps that are stretched by 1e6, the most that the check of a level
/// accepts.
const POLAR_STEPS: usize = 40;

fn rotation_matrix(rotation: CubeRotation) -> DMat3 {
    let [x, y, z] = DVec3::AXES.map(|axis| rotation.direction(axis));
    DMat3::from_cols(x, y, z)
}
