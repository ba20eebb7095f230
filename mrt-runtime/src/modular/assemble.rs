//! Joins a level and a dictionary into a scene (Loos et al. 2011, sections 6.2 and 6.3).

mod error;

pub use error::AssembleError;

use crate::level::block::{Level, Opening, corner_index};
use crate::level::wall::UnitFromWorld;
use crate::level::warp_form::form_of;
use crate::modular::dictionary::{Dictionary, OperatorMatrix, ShapeOperators, WarpTransport};
use crate::modular::packed::{Operators, PackedShape, PackedTransport};
use crate::modular::path::hole_of;
use crate::modular::propagate;
use crate::modular::scene::{Beyond, Layout, Planes, Portal, Scene, SceneBlock, Surface};
use crate::output::lightmap_atlas::AtlasLayout;
use glam::{DMat3, DVec3, Vec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::geometry::polar_decomposition::rotation_part;
use mrt_core::simd::WIDEST;
use mrt_core::simd::rows::DOT_ROWS;
use mrt_core::storage::Storage;
use std::sync::Arc;

/// Settings of [`assemble`].
#[derive(Clone, Debug, PartialEq)]
pub struct AssembleConfig {
    /// How light is taken from block to block.
    pub coupling: Coupling,
    /// Openings that light may cross, at most: `d_max`. Further blocks read 0 from the source.
    pub max_depth: usize,
    /// Bytes that texels and `T_b->r` may take together.
    pub max_bytes: usize,
    /// How shapes' operators are kept. They are few, so `f32`, the fastest, costs little.
    pub shape_storage: Storage,
    /// How `T_b->r` is kept, the largest part of a large level. `f16` errs by 0.02 %.
    pub transport_storage: Storage,
    /// Share in L2, in [0, 1), of the light from one block to another that may be left out where that saves work.
    ///
    /// `None` goes by the number of modes `k` of the block that light comes from, since few modes err by more: 2 % from 32
    /// modes on, `0.02 (32 / k)²` below, 15 % at most. With four lights in a maze of 41 blocks that saves three tenths of
    /// the products of a standard dictionary and errs by 0.16 %, where its modes err by 2 %; of a mobile one it saves
    /// half, and the mean error of six levels is 6.68 % instead of 6.64.
    pub negligible: Option<f32>,
}

/// How light is taken from block to block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Coupling {
    /// By the dictionary's operator of each whole path of openings, and by lightfields beyond the longest of them; by
    /// lightfields alone where the dictionary was baked without paths, as that of tubes.
    #[default]
    Table,
    /// By lightfields passed on from opening to opening, as in the paper.
    Lightfield,
}

/// Largest [`AssembleConfig::max_depth`]: rings of blocks would be followed for ever.
pub const MAX_DEPTH: usize = 64;

/// Bytes that positions, normals, albedo, frame buffers and lightmap take for a texel.
const BYTES_PER_TEXEL: usize = 4 * 12 + 4 * 12 + 2 * 12;

impl Default for AssembleConfig {
    /// Eight openings and 2 GiB: of what one-bounce light crosses that many, under 0.1 % arrives.
    fn default() -> Self {
        Self {
            coupling: Coupling::default(),
            max_depth: 8,
            max_bytes: 2 << 30,
            shape_storage: Storage::F32,
            transport_storage: Storage::F16,
            negligible: None,
        }
    }
}

/// Checks the level, looks up its shapes and assembles `T_b->r`. Of a
/// [`StoredDictionary`](crate::modular::dictionary::StoredDictionary), what the level uses is decoded; the scene borrows
/// nothing.
///
/// Cost: a k_r x k_e x k_b product for each path of openings that a shape's light takes, and the additions of one such
/// matrix for each path in the level; by lightfields, a k_rlf x k_rlf x k_b product for each opening crossed.
///
/// # Errors
/// [`AssembleError`].
pub fn assemble(
    level: &Level,
    dictionary: &Dictionary<impl OperatorMatrix>,
    config: &AssembleConfig,
) -> Result<Scene, AssembleError> {
    level.check()?;
    if config.max_depth > MAX_DEPTH {
        return Err(AssembleError::Depth {
            found: config.max_depth,
        });
    }
    if let Some(found) = config
        .negligible
        .filter(|share| !(0.0..1.0).contains(share))
    {
        return Err(AssembleError::Negligible { found });
    }
    let (used, operators_of_block) = used_operators(level, dictionary)?;
    let config = &AssembleConfig {
        coupling: usable_coupling(level, dictionary, config.coupling)?,
        ..config.clone()
    };
    let blocks = place_blocks(level, dictionary, &used, &operators_of_block)?;
    let resolution = dictionary.resolution;
    let texel_bytes = BYTES_PER_TEXEL * blocks.last().map_or(0, |b| b.texels.end);
    let operator_bytes =
        config
            .max_bytes
            .checked_sub(texel_bytes)
            .ok_or(AssembleError::TooLarge {
                expected: config.max_bytes,
                found: texel_bytes,
            })?;
    let areas = shape_areas(level, &blocks, &used, resolution);
    let shapes: Vec<PackedShape> = used
        .iter()
        .zip(&areas)
        .map(|(&entry, areas)| pack_shape(entry, areas, resolution, config.shape_storage))
        .collect();
    let layout = Arc::new(layout(&blocks, &shapes));
    let mut scene = Scene {
        resolution,
        surface: surface(level, &blocks, &shapes, &layout, resolution),
        transport: PackedTransport::default(),
        doors: level.doors.iter().map(|door| door.value).collect(),
        probes: dictionary.probes,
        atlas: AtlasLayout::new(&blocks, resolution, &layout),
        blocks,
        shapes,
        layout,
    };
    scene.transport =
        propagate::joint_from_coefficients(&scene, dictionary, &used, config, operator_bytes)?;
    Ok(scene)
}

/// The rotation of canonical axes to the world's: the orthogonal matrix nearest to the warp's derivative in the
/// middle, by Newton's iteration for the polar decomposition (Higham 1986).
fn rotation_of(warp: &Hexahedron) -> DMat3 {
    rotation_part(&warp.jacobian(DVec3::splat(0.5)), POLAR_STEPS)
}

/// Steps of the polar decomposition: warps that pass the level's check are stretched by up to 1e6.
const POLAR_STEPS: usize = 40;

fn rotation_matrix(rotation: CubeRotation) -> DMat3 {
    let [x, y, z] = DVec3::AXES.map(|axis| rotation.direction(axis));
    DMat3::from_cols(x, y, z)
}

/// Areas of a warped block's texels over the mean of its openings' (of all its texels' where it has none), in texels:
/// light that crosses an opening then counts as much on both sides.
fn warped_areas(block: &SceneBlock, resolution: usize) -> Vec<f32> {
    let area = |face: Face, unit: DVec3| {
        let jacobian = block.warp.jacobian(unit);
        let (u, v) = (jacobian.col(face.u_axis()), jacobian.col(face.v_axis()));
        u.cross(v).length()
    };
    let areas: Vec<f64> = block
        .shape
        .texels(resolution)
        .map(|(face, unit)| area(face, unit))
        .collect();
    let openings: Vec<f64> = block
        .shape
        .openings
        .iter()
        .map(|opening| area(opening.face, opening.face.point(0.5, 0.5)))
        .collect();
    let reference = if openings.is_empty() {
        &areas
    } else {
        &openings
    };
    let mean = reference.iter().sum::<f64>() / reference.len().max(1) as f64;
    areas.iter().map(|area| (area / mean) as f32).collect()
}

/// The coupling asked for, or lightfields where the dictionary never had a table.
pub(crate) fn usable_coupling<M>(
    level: &Level,
    dictionary: &Dictionary<M>,
    asked: Coupling,
) -> Result<Coupling, AssembleError> {
    if asked == Coupling::Table && dictionary.paths.depth > 0 {
        return Ok(Coupling::Table);
    }
    if dictionary.lightfields.parity.is_empty() && !level.connections.is_empty() {
        return Err(AssembleError::MissingLightfields);
    }
    Ok(Coupling::Lightfield)
}

/// The operators that the level uses, each once, and for each block which of them.
pub(crate) fn used_operators<'a, M>(
    level: &Level,
    dictionary: &'a Dictionary<M>,
) -> Result<(Vec<&'a ShapeOperators<M>>, Vec<usize>), AssembleError> {
    let mut used: Vec<&ShapeOperators<M>> = Vec::new();
    let mut of_block = Vec::with_capacity(level.blocks.len());
    for (index, block) in level.blocks.iter().enumerate() {
        let position =
            dictionary
                .shape_index(block.shape)
                .ok_or_else(|| AssembleError::MissingShape {
                    block: index,
                    shape: block.shape.name,
                    expected: dictionary
                        .shapes
                        .iter()
                        .map(|entry| entry.shape.name)
                        .collect::<Vec<_>>()
                        .join(", "),
                })?;
        let entry = match block.transport {
            WarpTransport::Canonical => &dictionary.shapes[position],
            transport => {
                let variant = dictionary.variant(block.shape, transport, &form_of(block));
                let missing = || AssembleError::MissingVariant {
                    block: index,
                    shape: block.shape.name,
                    transport: transport.name(),
                };
                &variant.ok_or_else(missing)?.operators
            }
        };
        let known = used.iter().position(|&other| std::ptr::eq(other, entry));
        of_block.push(known.unwrap_or_else(|| {
            used.push(entry);
            used.len() - 1
        }));
    }
    Ok((used, of_block))
}

pub(crate) fn place_blocks(
    level: &Level,
    dictionary: &Dictionary<impl OperatorMatrix>,
    used: &[&ShapeOperators<impl OperatorMatrix>],
    operators_of_block: &[usize],
) -> Result<Vec<SceneBlock>, AssembleError> {
    let neighbours = level.neighbours();
    let doors = level.door_of_openings();
    let mut blocks = Vec::with_capacity(level.blocks.len());
    let (mut texel, mut coefficient, mut joint) = (0, 0, 0);
    for (index, block) in level.blocks.iter().enumerate() {
        let shape_index = operators_of_block[index];
        let entry = used[shape_index];
        let (modes, joint_modes) = (entry.modes(), entry.joint_modes());
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
        let warp = block.canonical_warp();
        let portals = block.shape.openings.iter();
        blocks.push(SceneBlock {
            shape_index,
            shape: block.shape,
            orientation: block.orientation,
            portals: portals.map(|opening| Portal::new(&warp, opening)).collect(),
            bounds: warp.bounds(),
            world_from_probe: match block.transport {
                WarpTransport::Canonical => rotation_of(&warp),
                // A variant's probes have the level's axes, turned back by the orientation alone.
                _ => rotation_matrix(block.orientation),
            },
            unit_from_world: UnitFromWorld::new(&warp),
            warp,
            beyond,
            texels: texel..texel + texels,
            coefficients: coefficient..coefficient + modes,
            joint: joint..joint + joint_modes,
            doors: std::array::from_fn(|face| {
                doors[index][block.orientation.face(Face::ALL[face]).index()]
            }),
        });
        texel += texels;
        coefficient += modes;
        joint += joint_modes;
    }
    Ok(blocks)
}

/// How the canonical cubes on both sides of a connection stand to each other, read off the corners that
/// meet.
fn crossing(
    level: &Level,
    dictionary: &Dictionary<impl OperatorMatrix>,
    here: Opening,
    there: Opening,
) -> Result<Beyond, AssembleError> {
    let canonical_face =
        |end: Opening| level.blocks[end.block].orientation.inverse().face(end.face);
    let (face_here, face_there) = (canonical_face(here), canonical_face(there));
    let warp_here = level.blocks[here.block].canonical_warp();
    let warp_there = level.blocks[there.block].canonical_warp();
    // The corner of this block's cube that coincides with a corner of the other's face.
    let matching = |unit_there: DVec3| {
        let world = warp_there.corners[corner_index(unit_there)];
        face_here
            .rectangle([0.0, 1.0], [0.0, 1.0])
            .into_iter()
            .min_by(|a, b| {
                let distance =
                    |unit: &DVec3| warp_here.corners[corner_index(*unit)].distance(world);
                distance(a).total_cmp(&distance(b))
            })
            .unwrap_or(unit_there)
    };
    let origin = matching(face_there.point(0.0, 0.0));
    let images = [
        (
            face_there.u_axis(),
            matching(face_there.point(1.0, 0.0)) - origin,
        ),
        (
            face_there.v_axis(),
            matching(face_there.point(0.0, 1.0)) - origin,
        ),
        (
            face_there.axis(),
            -face_here.outward() * face_there.outward()[face_there.axis()],
        ),
    ];
    let image_of = |axis: usize| {
        images
            .iter()
            .find(|(a, _)| *a == axis)
            .and_then(|(_, d)| Face::ALL.into_iter().find(|face| face.outward() == *d))
    };
    let rotation = match (image_of(0), image_of(1)) {
        (Some(x), Some(y)) => CubeRotation::from_images(x, y),
        _ => None,
    };
    let up = image_of(1);
    // Holes know which way is up, and so do dictionaries whose shapes open sideways only.
    let outline = level.blocks[here.block].shape.opening(face_here);
    let has_hole = outline.is_some_and(|opening| hole_of(opening.outline).is_some());
    let keeps_up = match up {
        Some(Face::PosY) => true,
        // Half a turn is two mirrors; a dictionary of version 1 does not know its modes' parities.
        Some(Face::NegY) => !has_hole && dictionary.knows_parities(),
        _ => dictionary.has_exchanges() && !has_hole,
    };
    let proper = rotation.filter(|r| keeps_up && Some(r.face(Face::PosZ)) == image_of(2));
    match proper {
        Some(here_from_there) => Ok(Beyond::Block {
            block: there.block,
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

/// Areas of the texels of each shape; none where all are 1.
fn shape_areas(
    level: &Level,
    blocks: &[SceneBlock],
    used: &[&ShapeOperators<impl OperatorMatrix>],
    resolution: usize,
) -> Vec<Vec<f32>> {
    let of_shape = |entry: &&ShapeOperators<_>| entry.shape.relative_texel_areas(resolution);
    let mut areas: Vec<Vec<f32>> = used.iter().map(of_shape).collect();
    let mut known = vec![false; areas.len()];
    for (block, placed) in level.blocks.iter().zip(blocks) {
        let shape = placed.shape_index;
        if block.transport != WarpTransport::Canonical && !known[shape] {
            areas[shape] = warped_areas(placed, resolution);
            known[shape] = true;
        }
    }
    areas
}

fn pack_shape(
    entry: &ShapeOperators<impl OperatorMatrix>,
    areas: &[f32],
    resolution: usize,
    storage: Storage,
) -> PackedShape {
    let operators = Operators {
        coefficients_from_direct: &entry.coefficients_from_direct.decode(),
        joint_basis: &entry.joint_basis.decode(),
        probe_basis: &entry.probe_basis.decode(),
        vector_basis: &entry.vector_basis.decode(),
        areas,
    };
    PackedShape::new(entry.shape, resolution, &operators, storage)
}

/// Blocks sorted by shape, and where each one's part begins.
fn layout(blocks: &[SceneBlock], shapes: &[PackedShape]) -> Layout {
    let mut order: Vec<u32> = (0..blocks.len() as u32).collect();
    let shape_of = |block: u32| blocks[block as usize].shape_index;
    order.sort_by_key(|&block| (shape_of(block), block));
    let mut rank = vec![0; order.len()];
    let mut slots = Vec::with_capacity(order.len());
    let mut next = 0;
    for (place, &block) in order.iter().enumerate() {
        rank[block as usize] = place as u32;
        let count = shapes[shape_of(block)].folding.slots();
        slots.push(next..next + count);
        next += count;
    }
    let most = shapes.iter().map(|shape| shape.rows).max().unwrap_or(0);
    Layout {
        shapes: order.iter().map(|&block| shape_of(block) as u32).collect(),
        row_of_mode: shapes
            .iter()
            .map(|shape| shape.row_of_mode[..shape.modes].to_vec())
            .collect(),
        slot_of_texel: shapes
            .iter()
            .map(|shape| shape.folding.slot_of_texel.clone())
            .collect(),
        // Kernels write groups of rows, and the last may be of one.
        rows: (most + DOT_ROWS - 1).next_multiple_of(WIDEST),
        order,
        rank,
        slots,
    }
}

fn surface(
    level: &Level,
    blocks: &[SceneBlock],
    shapes: &[PackedShape],
    layout: &Layout,
    resolution: usize,
) -> Surface {
    let planes = || Planes::new(layout.slot_count());
    let mut surface = Surface {
        positions: planes(),
        normals: planes(),
        albedo: planes(),
        emission: planes(),
        uniform: Vec::with_capacity(layout.block_count()),
        emitting: Vec::new(),
        revision: Surface::next_revision(),
    };
    for (place, &index) in layout.order.iter().enumerate() {
        let (block, placed) = (&level.blocks[index as usize], &blocks[index as usize]);
        let texels: Vec<(Face, DVec3)> = placed.shape.texels(resolution).collect();
        let start = layout.slots[place].start;
        let mut emits = false;
        let folding = &shapes[placed.shape_index].folding;
        for (slot, &texel) in folding.texel_of_slot.iter().enumerate() {
            let slot = start + slot;
            let Some(&(face, unit)) = texels.get(texel as usize) else {
                // Nobody's: it stands in the middle and, without a normal, gets no light.
                surface.positions.set(slot, placed.warp.center().as_vec3());
                continue;
            };
            let normal = match placed.shape.tube() {
                None => {
                    let (u, v) = (unit[face.u_axis()], unit[face.v_axis()]);
                    placed.warp.face_normal(face, u, v)
                }
                Some(form) => {
                    let (face, u, v) = form.chart_of(unit);
                    let point = placed.shape.wall_point(face, u, v);
                    point.warped_normal(&placed.warp)
                }
            };
            surface
                .positions
                .set(slot, placed.warp.point(unit).as_vec3());
            surface.normals.set(slot, normal.as_vec3());
            // What is in a hole neither reflects nor emits.
            if !placed.shape.is_in_hole(face, unit) {
                let turned = placed.orientation.face(face).index();
                surface.albedo.set(slot, block.albedo[turned]);
                surface.emission.set(slot, block.emission[turned]);
                emits |= block.emission[turned] != Vec3::ZERO;
            }
        }
        let slots = layout.slots[place].clone();
        let uniform = surface.albedo.uniform(slots, &folding.texel_of_slot);
        surface.uniform.push(uniform);
        if emits {
            surface.emitting.push(place as u32);
        }
    }
    surface
}
